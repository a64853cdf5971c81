"""Programs measured in processes of their own, as a user begins them."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from tests.benchmarks.page import ROOT

OF_TESTS = ("JAX_", "XLA_", "OPENBLAS_", "OMP_")
"""How variables begin that tests set, such as a cache of compiled functions."""

OF_ONE_CORE = ("PJRT_", "LOKY_")
"""Those that leave a process one core. What is measured in this process is measured on one."""


def environment(caches: Path) -> dict[str, str]:
    """Environment of a user whose caches are in this folder."""
    of_tests = OF_TESTS + OF_ONE_CORE
    inherited = {name: value for name, value in os.environ.items() if not name.startswith(of_tests)}
    return inherited | {"XDG_CACHE_HOME": str(caches), "PYTHONPATH": str(ROOT)}


def seconds_of(command: list[str], folder: Path, caches: Path | None = None) -> float:
    """Seconds that a command takes, with its start; it is run in a folder."""
    return seconds_of_python(["-m", "bayes_placement", *command], folder, caches)


def seconds_of_python(words: list[str], folder: Path, caches: Path | None = None) -> float:
    """Seconds that Python takes with these words, with its start; it is run in a folder."""
    began = time.perf_counter()
    finished = subprocess.run(
        [sys.executable, *words],
        cwd=folder,
        env=environment(caches or folder / "caches"),
        capture_output=True,
        text=True,
    )
    took = time.perf_counter() - began
    assert finished.returncode == 0, finished.stderr
    return took


def told_by(
    module: str, *arguments: str, folder: Path, variables: Mapping[str, str] = MappingProxyType({})
) -> Any:
    """What a module says in its last line, as JSON; with further variables of the environment."""
    finished = subprocess.run(
        [sys.executable, "-m", module, *arguments],
        cwd=ROOT,
        env=environment(folder) | dict(variables),
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return json.loads(finished.stdout.splitlines()[-1])
