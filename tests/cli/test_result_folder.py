"""The folder of the results: looked at first, of one run at a time; what a stopped run leaves."""

import errno
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bayes_placement._shared.files import UNFINISHED, write_atomically
from bayes_placement.cli import _result_folder, check
from bayes_placement.cli.app import app
from tests.cli.studies import EXPERIMENT
from tests.design import killed

ROOT = Path(__file__).parents[2]
READ_FIRST = "raise RuntimeError('the model was read before the folder was looked at')\n"


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.py"
    path.write_text(EXPERIMENT + "measurement = experiment.nominal_measurement()\n")
    return path


def run(study, out):
    return CliRunner().invoke(app, ["check", str(study), "--out", str(out)])


def refused(study, out):
    """Sentence of a run that was refused before the model was read."""
    study.write_text(READ_FIRST)
    answer = run(study, out)
    assert answer.exit_code == 2, answer.output
    (line,) = answer.output.splitlines()
    assert line.startswith(f"error: --out {out} ")
    return line


def test_a_file_is_refused_before_the_model_is_read(study, tmp_path):
    out = tmp_path / "results"
    out.touch()
    assert "is a file. A folder is needed" in refused(study, out)


def test_a_folder_that_cannot_be_made_is_refused_before_the_model_is_read(study):
    assert "cannot be written to (Not a directory)" in refused(study, study / "results")


def test_a_read_only_folder_is_refused_before_the_model_is_read(study, tmp_path, monkeypatch):
    def read_only(*arguments):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(_result_folder.os, "write", read_only)
    assert "cannot be written to (Read-only file system)" in refused(study, tmp_path / "results")
    assert not (tmp_path / "results").exists()


def test_a_full_disk_is_refused_before_the_model_is_read(study, tmp_path, monkeypatch):
    usage = shutil.disk_usage(tmp_path)._replace(free=2_500_000)
    monkeypatch.setattr(_result_folder.shutil, "disk_usage", lambda folder: usage)
    assert "is on a disk with 2.5 MB left; 34 MB are needed" in refused(study, tmp_path / "out")


def test_a_folder_in_which_nothing_was_written_is_deleted(study, tmp_path):
    (tmp_path / "deep").mkdir()
    study.write_text("experiment = 1\n")
    assert run(study, tmp_path / "deep" / "new" / "results").exit_code == 3
    assert list((tmp_path / "deep").iterdir()) == []


def test_a_second_run_into_a_folder_is_refused_and_told_whose_it_is(study, tmp_path):
    out = tmp_path / "results"
    with _result_folder.result_folder(study, "check", out):
        line = refused(study, out)
    assert f"is in use by another run (process {os.getpid()} on " in line
    assert "one run at a time is needed, since both would write the same files" in line


def test_after_a_run_that_was_killed_the_next_says_so_and_deletes_what_was_not_finished(
    study, tmp_path, monkeypatch
):
    out = tmp_path / "results"
    (out / "chunks").mkdir(parents=True)
    (out / _result_folder.RUNNING).write_text("process 9 on here since 2026-01-01: improve a.py\n")
    for folder in (out, out / "chunks"):
        (folder / f".misfit{UNFINISHED}x.csv").touch()
    monkeypatch.setattr(check, "run", lambda *arguments: 0)
    answer = run(study, out)
    assert answer.exit_code == 0
    assert answer.output == (
        f"An earlier run into {out} did not end (process 9 on here since 2026-01-01: improve a.py)."
        " What it wrote is complete.\n"
    )
    assert [path.name for path in out.rglob("*")] == ["chunks"]


AGAIN = "Run it again to go on."


def stop_after(names):
    def stopped(path, data, engine, output, *further):
        out = output.folder.path
        for name in names:
            (out / name).parent.mkdir(exist_ok=True)
            (out / name).write_text("new")
        raise KeyboardInterrupt

    return stopped


@pytest.mark.parametrize(
    ("names", "words"),
    [
        ([], "Stopped. Nothing of this run is in {out} yet."),
        (["b"], "Stopped. What was finished is complete and stays in {out}: b."),
        (
            [*"bcdefg", "chunks/1", "chunks/2"],
            "Stopped. What was finished is complete and stays in {out}: b, c, d, e, 2 more, "
            "2 in chunks/.",
        ),
    ],
)
def test_ctrl_c_is_one_line_with_what_is_kept(study, tmp_path, monkeypatch, names, words):
    out = tmp_path / "results"
    out.mkdir()
    (out / "a").write_text("of an earlier run")
    monkeypatch.setattr(check, "run", stop_after(names))
    answer = run(study, out)
    assert answer.exit_code == 130
    assert answer.output == f"{words.format(out=out)} {AGAIN}\n"


def test_a_folder_that_becomes_a_file_is_one_sentence(study, tmp_path, monkeypatch):
    def replaced(path, data, engine, output, *further):
        out = output.folder.path
        (out / _result_folder.RUNNING).unlink()
        out.rmdir()
        out.touch()
        return write_atomically(out / "a.txt", lambda path: path.write_text("a"))

    monkeypatch.setattr(check, "run", replaced)
    answer = run(study, tmp_path / "results")
    assert answer.exit_code == 4
    assert answer.output.startswith(f"error: {tmp_path / 'results' / 'a.txt'} could not be written")


def test_a_path_that_is_too_long_is_one_sentence(study, tmp_path):
    answer = run(study, tmp_path / ("a" * 300))
    assert answer.exit_code == 2
    assert ": the system says 'File name too long'; a file or folder" in answer.output


def test_ctrl_c_before_anything_is_one_line(study, tmp_path, monkeypatch):
    def stopped(folder):
        raise KeyboardInterrupt

    monkeypatch.setattr(_result_folder, "_made", stopped)
    answer = run(study, tmp_path / "results")
    assert (answer.exit_code, answer.output) == (
        130,
        f"Stopped before anything was computed. {AGAIN}\n",
    )


LISTENING = """
import signal
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background jobs ignore it
from bayes_placement.cli._program import run
run()
"""
ENDLESS = "import os, time\nopen(__file__ + '.read', 'w').close()\ntime.sleep(100)\n"


@pytest.mark.long
@pytest.mark.parametrize(
    "number",
    [
        signal.SIGINT,
        *(pytest.param(n, marks=pytest.mark.longest) for n in (signal.SIGTERM, signal.SIGHUP)),
    ],
)
def test_a_process_that_is_stopped_says_one_line(study, tmp_path, number):
    study.write_text(ENDLESS)
    command = [sys.executable, "-c", LISTENING, "improve"]
    with subprocess.Popen(
        [*command, str(study), "--out", str(tmp_path / "out")],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        killed.until(lambda: study.with_name("study.py.read").exists())
        process.send_signal(number)
        complaint = process.communicate(timeout=30)[1]
    assert process.returncode == 128 + number
    assert complaint == f"Stopped. Nothing of this run is in {tmp_path / 'out'} yet. {AGAIN}\n"
    assert not (tmp_path / "out").exists()
