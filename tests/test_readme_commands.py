"""The commands of README.md run as they stand, in their order: minutes, so by `-m longest`."""

import re
import shlex
import shutil

import pytest
from typer.testing import CliRunner

from bayes_placement.cli.app import app
from tests.code_blocks import ROOT, blocks

LINE = re.compile(r"^ {4}(?:pip install \. && )?bayes-placement (.+)$", re.MULTILINE)
OF_THE_READER = ("measured.mat", "path/to/case", "model.py --state", "--model-error")
"""What only a reader has: files of their own, and options that are shown without a model."""


def commands():
    """Words of each command that runs on files of the repository and of README itself."""
    lines = LINE.findall((ROOT / "README.md").read_text())
    return [line for line in lines if not any(words in line for words in OF_THE_READER)]


def test_commands_are_found():
    begun = [line.split()[0] for line in commands()]
    assert {"improve", "report", "check", "explain", "update", "place"} <= set(begun)


@pytest.mark.long
@pytest.mark.longest
@pytest.mark.usefixtures("optimised")
def test_commands_run_in_their_order(tmp_path, monkeypatch):
    shutil.copytree(ROOT / "models", tmp_path / "models")
    saved = {block.file: block.code for block in blocks((ROOT / "README.md").read_text())}
    (tmp_path / "my_model.py").write_text(saved["my_model.py"])
    monkeypatch.chdir(tmp_path)
    for line in commands():
        done = CliRunner().invoke(app, shlex.split(line))
        fails_its_check = line.startswith("check")
        assert done.exit_code == fails_its_check, (line, done.output, done.exception)
        if not line.startswith("report"):
            (folder,) = re.findall(r"^Results are in (.+)/$", done.output, re.MULTILINE)
            assert (tmp_path / folder / "run.json").is_file()
    assert "18 °C" in (tmp_path / "results/hidden_effect/improve-1/report.html").read_text()
