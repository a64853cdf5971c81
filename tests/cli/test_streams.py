"""What a terminal shows, and what becomes of a command whose words nobody can read."""

import io
import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from bayes_placement.cli import _program, _streams
from bayes_placement.cli._errors import UNPRINTED
from tests.cli.studies import EXPERIMENT

ROOT = str(Path(__file__).parents[2])


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("s1\x1b[2J", "s1\\x1b[2J"),
        ("s1\u202ecba", "s1\\u202ecba"),
        ("a\0b\udcff", "a\\x00b\\udcff"),
        ("α²\tµ\n", "α²\tµ\n"),
    ],
)
def test_no_text_steers_a_terminal(text, shown):
    assert _streams.printable(text) == shown


def test_paths_are_shown_as_they_may_be_typed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _streams.begin_here()
    text = f"Results are in {tmp_path}/out/, not in /other{tmp_path}/out/"
    assert _streams.printable(text) == f"Results are in out/, not in /other{tmp_path}/out/"


def test_a_stream_outlasts_its_reader():
    read, write = os.pipe()
    stream = _streams.LastingStream(write)
    os.close(read)
    text = io.TextIOWrapper(io.BufferedWriter(stream))
    text.write("lost")
    text.flush()
    text.write("lost as well")
    text.flush()
    assert isinstance(stream.fault, BrokenPipeError)


@pytest.mark.parametrize("daemon", [False, True])
def test_threads_that_go_on_are_named_where_they_keep_a_program(monkeypatch, capsys, daemon):
    """An interrupted search was said to have left a thread of the model file, which had none."""
    monkeypatch.setattr(_program, "PATIENCE", 0.0)
    monkeypatch.setattr(os, "_exit", lambda code: None)
    going_on = threading.Event()
    thread = threading.Thread(target=going_on.wait, name="a\x1b[2J", daemon=daemon)
    thread.start()
    _program._end(0)
    going_on.set()
    thread.join()  # else the next test may still see it
    assert ("a thread goes on: a\\x1b[2J." in capsys.readouterr().err) != daemon


def begun(folder, *words, **settings):
    command = [sys.executable, "-m", "bayes_placement", *words]
    environment = {**os.environ, "PYTHONPATH": ROOT, **settings.pop("env", {})}
    return subprocess.Popen(
        command, cwd=folder, env=environment, stderr=subprocess.PIPE, text=True, **settings
    )


@pytest.mark.long
@pytest.mark.parametrize("full", [False, pytest.param(True, marks=pytest.mark.longest)])
def test_a_closed_or_full_output_ends_the_printing_alone(tmp_path, full):
    study = f"{EXPERIMENT}measurement = experiment.nominal_measurement()"
    (tmp_path / "study.py").write_text(study)
    read, write = os.pipe()
    os.close(read)
    with Path("/dev/full").open("w") as device:
        process = begun(tmp_path, "show", "study.py", stdout=device if full else write)
        complaint = process.communicate(timeout=120)[1]
    os.close(write)
    assert process.returncode == UNPRINTED
    assert ("No space left" if full else "Broken pipe") in complaint
    record = json.loads((tmp_path / "results/study/show-1/run.json").read_text())["show"]
    assert record["finished"] and record["exit_code"] == 0


@pytest.mark.long
@pytest.mark.parametrize("encoding", ["ascii", pytest.param("cp1252", marks=pytest.mark.longest)])
def test_a_terminal_without_greek_letters_shows_their_numbers(tmp_path, encoding):
    study = EXPERIMENT.replace('"s1"', '"\N{GREEK SMALL LETTER SIGMA}1"')
    warning = "import warnings; warnings.warn('a\x1b[2J')"
    (tmp_path / "study.py").write_text(study + warning)
    process = begun(
        tmp_path, "show", "study.py", stdout=subprocess.PIPE, env={"PYTHONIOENCODING": encoding}
    )
    answer, complaint = process.communicate(timeout=120)
    assert process.returncode == 0, complaint
    assert "\\u03c31" in answer
    assert "UserWarning: a\\x1b[2J" in complaint


@pytest.mark.long
def test_a_folder_that_was_deleted_is_a_sentence(tmp_path):
    command = f'mkdir gone && cd gone && rmdir ../gone && "{sys.executable}" -m bayes_placement '
    done = subprocess.run(
        ["sh", "-c", f"{command} show study.py"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": ROOT},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr.startswith("error: The folder in which the command was typed was deleted")
