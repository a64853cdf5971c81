"""Commands of README.md and of how-to pages run as they stand: minutes, so by `-m longest`."""

import re
import shlex
import shutil

import pytest
from typer.testing import CliRunner

from bayes_placement.cli.app import app
from tests.code_blocks import ROOT, blocks

LINE = re.compile(r"^ {4}(?:pip install \. && )?bayes-placement (.+)$", re.MULTILINE)
PAGES = ("README.md", *(f"notebooks/docs/how_to/{name}.md" for name in ("results", "parameters")))
"""Pages whose commands run on files of the repository, one after another."""

WITHOUT_RESULTS = ("report", "results")
"""Commands that make no folder of results."""


def commands():
    """Words of each command of these pages, and of those on a model of the repository."""
    lines = [line for page in PAGES for line in LINE.findall((ROOT / page).read_text())]
    others = sorted(
        {*(ROOT / "notebooks/docs/how_to").glob("*.md")} - {ROOT / page for page in PAGES}
    )
    further = [line for page in others for line in LINE.findall(page.read_text())]
    # A page is served until someone closes it.
    further = [line for line in further if re.fullmatch(r"(?!explore)\w+ models/\S+", line)]
    return [*dict.fromkeys(line.split("#")[0].strip() for line in [*lines, *further])]


def test_commands_are_found():
    begun = [line.split()[0] for line in commands()]
    asked = {"improve", "check", "explain", "update", "place"}
    assert {*asked, *WITHOUT_RESULTS} == set(begun)


@pytest.mark.long
@pytest.mark.longest
@pytest.mark.usefixtures("optimised")
def test_commands_run_in_their_order(tmp_path, monkeypatch):
    shutil.copytree(ROOT / "models", tmp_path / "models")
    (saved,) = (block for block in blocks((ROOT / "README.md").read_text()) if block.file)
    (tmp_path / saved.file).write_text(saved.code)
    monkeypatch.chdir(tmp_path)
    for line in [*commands(), "show my_model.py"]:
        done = CliRunner().invoke(app, shlex.split(line, comments=True))
        fails_its_check = line.startswith("check")
        assert done.exit_code == fails_its_check, (line, done.output, done.exception)
        if line.split()[0] not in WITHOUT_RESULTS:
            (folder,) = re.findall(r"^Results are in (.+)/$", done.output, re.MULTILINE)
            assert (tmp_path / folder / "run.json").is_file()
    assert "18 °C" in (tmp_path / "results/hidden_effect/improve-1/report.html").read_text()
