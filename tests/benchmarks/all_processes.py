"""What a program and all processes that it begins take: time of cores and memory, by /proc."""

import json
import re
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from tests.benchmarks.fresh import environment
from tests.benchmarks.page import ROOT

EVERY = 0.25
"""Seconds between two looks."""

TICKS = 100
"""Of a second, in which Linux tells the time of cores."""


class Taken(NamedTuple):
    """What a program told in its last line, and what all its processes took.

    Parameters
    ----------
    told
        Its last line, as JSON.
    wall, cores
        Seconds from its start to its end, and of all cores together.
    memory
        Peak of the memory of all processes together [GiB], pages that they share counted once.
    """

    told: Any
    wall: float
    cores: float
    memory: float


def taken_by(module: str, folder: Path, variables: Mapping[str, str]) -> Taken:
    """What a module takes, begun as a user does, with further variables of the environment."""
    began, cores, memory = time.perf_counter(), dict[int, float](), 0.0
    command = [sys.executable, "-m", module]
    variables = environment(folder) | dict(variables)
    with subprocess.Popen(command, cwd=ROOT, env=variables, stdout=subprocess.PIPE) as program:
        while program.poll() is None:
            processes = [*descendants(program.pid)]
            cores |= {number: seconds_of(number) for number in processes}
            memory = max(memory, sum(map(memory_of, processes)))
            time.sleep(EVERY)
        assert program.stdout is not None
        lines = program.stdout.read().decode().splitlines()
    assert program.returncode == 0
    wall = time.perf_counter() - began
    return Taken(json.loads(lines[-1]), wall, sum(cores.values()), memory)


def descendants(number: int) -> Iterator[int]:
    """A process, and all that it or these have begun."""
    yield number
    for child in read(number, f"task/{number}/children").split():
        yield from descendants(int(child))


def seconds_of(number: int) -> float:
    """Time that cores have worked for a process [s]."""
    after_name = read(number, "stat").rpartition(")")[2].split()
    return sum(map(int, after_name[11:13])) / TICKS


def memory_of(number: int) -> float:
    """Memory of a process [GiB], of a page that others have as well its share."""
    found = re.search(r"^Pss:\s*(\d+) kB", read(number, "smaps_rollup"), re.MULTILINE)
    return int(found[1]) / 2**20 if found else 0.0


def read(number: int, name: str) -> str:
    """A file of a process; empty once it has ended."""
    try:
        return Path(f"/proc/{number}/{name}").read_text()
    except OSError:
        return ""
