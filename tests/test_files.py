"""Files are complete or not there: full disks, killed writers, two writers at once."""

import errno
import os
import resource
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
import xarray as xr

import bayes_placement as bp
from bayes_placement._shared import files as _files
from bayes_placement._shared.errors import WritingError
from bayes_placement._shared.files import write_atomically
from bayes_placement.cli import _result_folder, _run


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def fail_half_way(path):
    path.write_text("half")
    raise OSError(errno.ENOSPC, "No space left on device")


def test_an_earlier_file_stays_where_a_new_one_fails(tmp_path):
    write_atomically(tmp_path / "a.txt", lambda path: path.write_text("whole"))
    with pytest.raises(WritingError, match=r"a.txt could not be written \(No space left"):
        write_atomically(tmp_path / "a.txt", fail_half_way)
    assert names(tmp_path) == ["a.txt"] and (tmp_path / "a.txt").read_text() == "whole"


@pytest.mark.parametrize(("mask", "mode"), [(0o077, 0o600), (0o022, 0o644)])
def test_files_have_the_permissions_of_the_user(tmp_path, mask, mode):
    before = os.umask(mask)
    try:
        write_atomically(tmp_path / "a.txt", lambda path: path.write_text("whole"))
    finally:
        os.umask(before)
    assert (tmp_path / "a.txt").stat().st_mode & 0o777 == mode


def test_a_folder_that_is_a_file_is_said(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(WritingError, match=r"could not be written \((File exists|Not a directory)"):
        write_atomically(tmp_path / "file" / "a.txt", lambda path: path.write_text("whole"))


@contextmanager
def files_of_at_most(size):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


NUMBERS = xr.Dataset({"a": ("draw", np.random.default_rng(0).standard_normal(5000))})


def figure():
    drawn = plt.figure()
    plt.close(drawn)
    return drawn


def measured():
    frf = np.random.default_rng(0).standard_normal((1, 1, 500)) + 1j
    return bp.Measurement.from_arrays(
        frf, np.arange(1.0, 501.0), sensors=["s1"], actuators=["a1"], quantity="mobility"
    )


def run_in(folder):
    """A run of a command whose results go to a folder."""
    output = _run.Output(_result_folder.ResultFolder(folder, folder))
    return output.begin("check", folder / "study.py")


WRITERS = {
    "result.nc": lambda path: bp.io.netcdf.write(xr.DataTree(NUMBERS), path),
    "map.nc": lambda path: run_in(path.parent).dataset(path.name, NUMBERS),
    "a.csv": lambda path: run_in(path.parent).table(path.name, pd.DataFrame(NUMBERS["a"])),
    "a.txt": lambda path: run_in(path.parent).text(path.name, "words " * 5000),
    "a.png": lambda path: run_in(path.parent).figures(lambda: {path.name: figure()}),
    "a.uff": lambda path: bp.io.uff.write(path, measured()),
    "a.npz": lambda path: write_atomically(path, lambda at: np.savez(at, a=NUMBERS["a"])),
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_is_one_sentence_and_leaves_nothing(tmp_path, name):
    with files_of_at_most(1000), pytest.raises(WritingError, match=f"{name} could not be written"):
        WRITERS[name](tmp_path / name)
    assert names(tmp_path) == []
    WRITERS[name](tmp_path / name)
    assert set(names(tmp_path)) - {"run.json"} == {name}


def test_what_a_killed_writer_left_is_deleted_by_the_next(tmp_path):
    (tmp_path / f".b{_files.UNFINISHED}abc.npz").write_bytes(b"half")
    (tmp_path / ".of_somebody_else").touch()
    write_atomically(tmp_path / "a.txt", lambda path: path.write_text("whole"))
    assert names(tmp_path) == [".of_somebody_else", "a.txt"]


def test_what_another_is_writing_stays(tmp_path):
    def write_both(path):
        write_atomically(tmp_path / "b.txt", lambda inner: inner.write_text("b"))
        path.write_text("a")

    write_atomically(tmp_path / "a.txt", write_both)
    assert names(tmp_path) == ["a.txt", "b.txt"]


def killed_writers(folder, moments):
    root = Path(__file__).parents[1]
    command = [sys.executable, "-m", "tests.killed_writers", str(folder), str(moments)]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return int(done.stdout)


def test_a_file_that_another_took_for_left_over_is_begun_anew(tmp_path, monkeypatch):
    """Another process may lock a new file, and delete it, before its writer has locked it."""
    locked, seen = _files.lock, []

    def late(handle):
        if not seen:
            seen.append(names(tmp_path))
            _files.delete_leftovers(tmp_path)
        locked(handle)

    def write(path):
        path.write_text("whole")
        _files.delete_leftovers(tmp_path)  # that of a third one

    monkeypatch.setattr(_files, "lock", late)
    write_atomically(tmp_path / "a.txt", write)
    assert len(seen[0]) == 1  # the first temporary file
    assert names(tmp_path) == ["a.txt"] and (tmp_path / "a.txt").read_text() == "whole"


def test_killed_writers_leave_complete_files(tmp_path):
    assert killed_writers(tmp_path, 20) > 0, "no moment was within a file"
    write_atomically(tmp_path / "last.txt", lambda path: path.write_text("whole"))
    assert names(tmp_path) == ["last.txt", "result.npz", "result.txt"]


@pytest.mark.long
@pytest.mark.longest
def test_writers_that_are_killed_often_leave_complete_files(tmp_path):
    killed_writers(tmp_path, 500)


def test_no_text_of_a_table_is_a_formula_of_a_spreadsheet(tmp_path):
    table = pd.DataFrame({"@a": ["=1+1", "-0.5", "+x", "s1"], "b": [-1.0, 2.0, 3.0, 4.0]})
    _files.write_csv(tmp_path / "table.csv", table, index=False)
    lines = (tmp_path / "table.csv").read_text().splitlines()
    assert lines == ["'@a,b", "'=1+1,-1.0", "-0.5,2.0", "'+x,3.0", "s1,4.0"]
