"""Model files that misbehave end with a sentence and a code, and nothing half written."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.cli.app import app
from tests.cli.misbehaving_models import ENDED, MISBEHAVIOURS, model_files
from tests.cli.studies import EXPERIMENT

ALONE = [each for each in MISBEHAVIOURS if each.alone]
REFUSED = [each for each in MISBEHAVIOURS if each.words in (ENDED, "jax_enable_x64")]


@pytest.mark.parametrize("each", REFUSED, ids=lambda each: each.line)
def test_a_model_that_ends_the_program_or_changes_numbers_is_refused(tmp_path, each):
    path = tmp_path / "study.py"
    path.write_text(f"import os\nos.chdir('/')\n{each.line}\n")
    before = Path.cwd()
    with pytest.raises(InputError, match=f"study.py.* {each.words}"):
        bp.io.model.read(path)
    assert Path.cwd() == before


def check(folder, each, answer, code, complaint):
    """Refuse an exit code, an answer or files that are not those of a misbehaviour."""
    out = folder / "out"
    assert code == each.code, (each, complaint)
    assert each.words in complaint.strip().splitlines()[-1] if each.words else True, complaint
    assert json.loads(answer).get("exit_code") == code
    assert out.exists() == (code == 0)
    assert not [path for path in out.rglob("*") if path.name.startswith(".")]


@pytest.mark.long
def test_a_hundred_models_that_misbehave(tmp_path, monkeypatch):
    cases = [(each, text) for each, text in model_files() if not each.alone]
    assert len(cases) >= 100
    for number, (each, text) in enumerate(cases):
        folder = tmp_path / str(number)
        folder.mkdir()
        monkeypatch.chdir(folder)
        Path("study.py").write_text(text)
        answer = CliRunner().invoke(app, ["show", "study.py", "--out", "out", "--json"])
        check(folder, each, answer.stdout, answer.exit_code, answer.stderr)


@pytest.mark.long
@pytest.mark.parametrize(
    "each",
    [
        pytest.param(each, marks=[pytest.mark.longest] * (number > 1))
        for number, each in enumerate(ALONE)
    ],
    ids=[each.line for each in ALONE],
)
def test_what_outlasts_a_model_file_spoils_no_answer(tmp_path, each):
    (tmp_path / "study.py").write_text(f"{EXPERIMENT}{each.line}\n")
    words = [sys.executable, "-m", "bayes_placement", "show", "study.py", "--out", "out", "--json"]
    root = str(Path(__file__).parents[2])
    done = subprocess.run(
        words,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": root},
    )
    check(tmp_path, each, done.stdout, done.returncode, done.stderr)
