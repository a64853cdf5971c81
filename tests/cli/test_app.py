"""Version, `python -m bayes_placement`, completion, `--quiet` and `--json` of the command line."""

import json
import os
import subprocess
import sys

import pytest
from typer.testing import CliRunner

import bayes_placement as bp
from bayes_placement.cli.app import app
from tests.cli.studies import EXPERIMENT

STUDY = EXPERIMENT + (
    "measurement = experiment.nominal_measurement()\nengine = bp.engines.Importance(draws=60)\n"
)


def run(folder, *options, text=STUDY):
    path = folder / "study.py"
    path.write_text(text)
    words = ["update", str(path), "--engine", "importance", "--out", str(folder / "out")]
    return CliRunner().invoke(app, [*words, *options])


def test_the_version():
    done = CliRunner().invoke(app, ["--version"])
    assert (done.exit_code, done.stdout) == (0, f"bayes-placement {bp.__version__}\n")


def test_the_package_can_be_run_as_a_module():
    words = [sys.executable, "-m", "bayes_placement", "--version"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout == f"bayes-placement {bp.__version__}\n"


def test_commands_are_completed():
    environment = os.environ | {
        "_BAYES_PLACEMENT_COMPLETE": "complete_bash",
        "COMP_WORDS": "bayes-placement im",
        "COMP_CWORD": "1",
    }
    done = subprocess.run(
        [sys.executable, "-m", "bayes_placement"],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "improve" in done.stdout.split()


def test_a_quiet_command_says_its_verdict_and_its_folder(tmp_path):
    done = run(tmp_path, "--quiet")
    assert done.exit_code == 0, done.output
    *verdict, last = done.output.splitlines()
    assert last == f"Results are in {tmp_path / 'out'}/"
    assert len(verdict) == 1


def test_json_is_one_object_on_standard_output(tmp_path):
    done = run(tmp_path, "--json")
    assert done.exit_code == 0, done.output
    content = json.loads(done.stdout)
    assert content["folder"] == str(tmp_path / "out")
    assert content["exit_code"] == 0
    assert content["finished"] is True
    assert "result.nc" in content["files"]
    assert content["result"]


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_progress_is_no_part_of_the_answer(tmp_path, stream):
    done = run(tmp_path)
    assert ("took" in getattr(done, stream)) == (stream == "stderr")
