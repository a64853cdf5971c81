"""Systems that turn on a run: clocks that lie, disks that become read-only; known weaknesses."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.studies import EXPERIMENT

ROOT = str(Path(__file__).parents[2])
COMMAND = [sys.executable, "-m", "bayes_placement", "show", "study.py", "--out", "out"]
FAKED = [*Path("/usr/lib").glob("*/faketime/libfaketime.so.1")]

READ_ONLY = """
import subprocess
subprocess.run(["mount", "--bind", "out", "out"], check=True)
subprocess.run(["mount", "-o", "remount,bind,ro", "out"], check=True)
"""
"""Lines of a model file that make the folder of the results read-only in the middle of its run."""


def run(folder, study, *before, **environment):
    (folder / "study.py").write_text(study)
    return subprocess.run(
        [*before, *COMMAND],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": ROOT, **environment},
        capture_output=True,
        text=True,
        check=False,
    )


def may_mount():
    words = ["unshare", "--map-root-user", "--mount", "true"]
    return bool(shutil.which("unshare")) and not subprocess.run(words, check=False).returncode


@pytest.mark.long
@pytest.mark.skipif(not may_mount(), reason="unshare may not make a space of mounts here")
def test_a_folder_that_becomes_read_only_is_a_sentence(tmp_path):
    done = run(tmp_path, EXPERIMENT + READ_ONLY, "unshare", "--map-root-user", "--mount")
    assert done.returncode == 4, done.stderr
    assert "out/channels.csv could not be written (Read-only file system)" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.long
@pytest.mark.skipif(not FAKED, reason="libfaketime is not installed: apt-get install faketime")
@pytest.mark.parametrize("clock", ["@1970-01-02 00:00:00", "-1d i-1"])
def test_a_clock_that_lies_changes_a_date_alone(tmp_path, clock):
    done = run(tmp_path, EXPERIMENT, LD_PRELOAD=str(FAKED[0]), FAKETIME=clock)
    assert done.returncode == 0, done.stderr
    record = json.loads((tmp_path / "out" / "run.json").read_text())["show"]
    assert record["finished"] and "geometry.png" in record["files"]


@pytest.mark.long
def test_no_library_has_a_known_weakness():
    pytest.importorskip("pip_audit", reason="pip-audit is not installed: pip install pip-audit")
    command = [sys.executable, "-m", "pip_audit", "--skip-editable", "--progress-spinner", "off"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if "ConnectionError" in done.stderr or "ServiceError" in done.stderr:
        pytest.skip("the list of weaknesses cannot be reached from here")
    assert done.returncode == 0, done.stdout
