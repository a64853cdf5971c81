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


WRITERS = {"init": "A model was written to ", "report": "Report to hand on: "}
"""What the commands say that compute nothing."""


def written(command, folder, *options):
    """Answer of a command that computes nothing."""
    results = folder / "results"
    results.mkdir()
    if command == "report":
        rows = "s1,information_gain,information_gain_se\n0.2,0.1,0\n"
        (results / "placements.csv").write_text(rows)
    return CliRunner().invoke(app, [command, str(results), *options])


@pytest.mark.parametrize("command", WRITERS)
def test_commands_without_results_are_quiet_too(tmp_path, command):
    done = written(command, tmp_path, "--quiet")
    assert (done.exit_code, len(done.stdout.splitlines())) == (0, 1), done.output
    assert done.stdout.startswith(WRITERS[command])


@pytest.mark.parametrize("command", WRITERS)
def test_commands_without_results_answer_with_json_too(tmp_path, command):
    done = written(command, tmp_path, "--json")
    assert done.exit_code == 0, done.output
    content = json.loads(done.stdout)
    assert content["verdict"].startswith(WRITERS[command])
    assert (content["command"], content["exit_code"], content["finished"]) == (command, 0, True)
    there = {file.name for file in (tmp_path / "results").iterdir()} - {"placements.csv"}
    assert set(content["files"]) == there
    assert content["folder"] == str(tmp_path / "results")


@pytest.mark.parametrize("command", WRITERS)
def test_errors_of_commands_without_results_are_json_too(tmp_path, command):
    (tmp_path / "model.py").write_text("")
    folder = tmp_path if command == "init" else tmp_path / "nowhere"
    done = CliRunner().invoke(app, [command, str(folder), "--json"])
    assert done.exit_code == 2
    content = json.loads(done.stdout)
    assert content["exit_code"] == 2
    assert "is there" in content["error"] or "There is no" in content["error"]


@pytest.mark.parametrize("command", sorted({*WRITERS, "update", "check", "explain", "place"}))
def test_every_command_has_the_same_options_for_scripts(command):
    words = CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "200"}).stdout
    assert all(option in words for option in ("--quiet", "--json", "--traceback"))


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_progress_is_no_part_of_the_answer(tmp_path, stream):
    done = run(tmp_path)
    assert ("took" in getattr(done, stream)) == (stream == "stderr")
