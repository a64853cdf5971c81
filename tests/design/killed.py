"""Runs in separate processes that are killed, and the files that they leave."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from tests.design.small_maps import CELLS

ROOT = Path(__file__).parents[2]


def begun(module, *words):
    """Begin a run."""
    path = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", f"tests.design.{module}", *map(str, words)]
    return subprocess.Popen(command, cwd=ROOT, env=os.environ | {"PYTHONPATH": path})


def kill(process):
    """Kill a run."""
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert process.returncode == -signal.SIGKILL, "it ended by itself"


def killed_half_way(folder, *address):
    """Kill a map once a third is in the store; return chunks computed, and the workers."""
    with begun("small_maps", folder / "store", folder / "log", *address) as process:
        until(lambda: len(finished(folder / "store")) >= CELLS // 3 or process.poll() is not None)
        kill(process)
    lines = [line.split() for line in (folder / "log").read_text().splitlines()]
    return [int(number) for number, _ in lines], {int(worker) for _, worker in lines}


def finished(store):
    """Files of a store, without what a killed writer may have left."""
    return [path for path in store.glob("*.npz") if not path.name.startswith(".")]


def until(condition, seconds=120.0):
    """Wait."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def gone(worker):
    """Tell whether there is no such process any more."""
    try:
        os.kill(worker, 0)
        state = Path(f"/proc/{worker}/stat").read_text().rpartition(")")[2].split()[0]
    except (ProcessLookupError, FileNotFoundError):
        return True
    return state == "Z"  # ended, and nobody asked how


def goes_on(folder, before, run_again, counted, twice=1):
    """Check that a second run computes what is missing, and at most so many chunks twice."""
    stored = {path: path.stat().st_mtime_ns for path in finished(folder / "store")}
    assert CELLS // 3 <= len(stored) < CELLS
    run_again()
    assert len(counted) == CELLS - len(stored)
    assert len(set(before)) == len(before) <= len(stored) + twice
    assert all(path.stat().st_mtime_ns == time for path, time in stored.items())
    assert len(finished(folder / "store")) == CELLS
