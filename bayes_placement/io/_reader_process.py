"""Readers that can end, hang or fill the interpreter: each runs in a separate process."""

import json
import math
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._types import InputError, MissingExtraError
from ._npz_archive import NpzArchive

SECONDS, CPU_SECONDS, SECONDS_PER_MEGABYTE = 20.0, 8.0, 2.0
"""Time that reading a file may take, on the clock and of the processor, which other work on the
machine does not prolong, and either for each megabyte besides."""

_MISSING = re.compile(r"No module named '(\w+)")
_CHILD = Path(__file__).with_name("_child.py")

# HDF5 loads filters from folders that the environment names; a file could ask for one of them.
_NO_PLUGINS = {"HDF5_PLUGIN_PRELOAD": "::"}


class ReaderResult(NamedTuple):
    """What a process wrote: arrays by name, metadata, and its complaints."""

    arrays: dict[str, np.ndarray]
    metadata: dict[str, Any]
    complaints: str


def run(
    script: Path,
    path: Path,
    contents: str,
    refused: Callable[[str], InputError],
    *,
    further_seconds: float = 0.0,
    **settings: int,
) -> ReaderResult:
    """Read a file by `read(path)` of a script, whose time and memory are limited.

    Parameters
    ----------
    script
        Defines `read`, which returns arrays by name and metadata that JSON can hold. Nothing of
        this package is imported there.
    path
        The file.
    contents
        What it holds, for messages.
    refused
        Makes the error of a reason.
    further_seconds
        Time that a library takes to be imported, where that is long.
    **settings
        Further arguments of `read`.
    """
    path.open("rb").close()  # raises PermissionError, which says more than a failed process
    further = further_seconds + SECONDS_PER_MEGABYTE * path.stat().st_size / 1e6
    allowed, cpu_allowed = SECONDS + further, math.ceil(CPU_SECONDS + further)
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "result.npz"
        inputs = [_CHILD, script, path.absolute(), result, cpu_allowed]
        command = [sys.executable, "-P", *map(str, inputs)]
        environment = {**os.environ, **_NO_PLUGINS}
        try:
            done = subprocess.run(
                command,
                input=json.dumps(settings).encode(),
                capture_output=True,
                timeout=allowed,
                check=False,
                env=environment,
            )
        except subprocess.TimeoutExpired as error:
            raise refused(f"it did not end within {allowed:.0f} s") from error
        if done.returncode == -getattr(signal, "SIGXCPU", 0):
            raise refused(f"it did not end within {cpu_allowed} s of computing")
        complaints = " ".join(done.stderr.decode("utf-8", "replace").split())
        missing = _MISSING.search(complaints) if done.returncode else None
        if missing:
            raise MissingExtraError(
                f"{path} cannot be read as {contents}, since {missing[1]} is not installed, which "
                f"its reader needs for this format. Install it: pip install {missing[1]}."
            )
        if done.returncode or not result.is_file():
            raise refused(complaints[-300:] or f"its process ended with {done.returncode}")
        return _unpacked(NpzArchive(result, contents), complaints)


def _unpacked(archive: NpzArchive, complaints: str) -> ReaderResult:
    """Arrays by the names in `metadata`, which is JSON; a name of an array may hold anything."""
    metadata = json.loads(str(archive.array("metadata")))
    arrays = {name: archive.array(f"array {n}") for n, name in enumerate(metadata.pop("names"))}
    return ReaderResult(arrays, metadata, complaints)
