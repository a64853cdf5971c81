"""Readers that can end, hang or fill the interpreter: each runs in a separate process."""

import importlib.util
import json
import math
import os
import re
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .._shared.errors import MissingExtraError
from .._shared.files import Json
from ._gate import UnreadableError, seconds
from ._npz_archive import NpzArchive

SECONDS_OF_WAITING = 60.0
"""How long a process may wait besides computing: for a disk, or for its turn on a busy machine."""

_MISSING = re.compile(r"No module named '(\w+)")
_CHILD = Path(__file__).with_name("_child.py")
_LIBRARIES = Path(__file__).with_name("_library_process.py")

# HDF5 loads filters from folders that the environment names; a file could ask for one of them.
_NO_PLUGINS = {"HDF5_PLUGIN_PRELOAD": "::"}


LIBRARIES = {
    "ansys": ("ansys.mapdl.reader", 60.0),  # brings VTK
    "mdf": ("asammdf", 0.0),
    "mesh": ("meshio", 0.0),
    "nastran": ("pyyeti", 20.0),  # brings pandas
    "tdms": ("nptdms", 0.0),
}
"""Library of each extra, and the time that importing it may take where the disk is slow [s]."""


class ReaderResult(NamedTuple):
    """What a process wrote: arrays by name, metadata, and its complaints."""

    arrays: dict[str, np.ndarray]
    metadata: Json
    complaints: str


def run(script: Path, path: Path, import_seconds: float = 0.0, **settings: object) -> ReaderResult:
    """Read a file by `read(path, **settings)` of a script, whose time and memory are limited.

    It returns arrays by name and metadata that JSON can hold; nothing of this package is imported
    there. A process that ends otherwise than with a result raises UnreadableError, of which
    `reading` makes a sentence.
    """
    path.open("rb").close()  # raises PermissionError, which says more than a failed process
    cpu_allowed = math.ceil(seconds(path) + import_seconds)
    allowed = cpu_allowed + SECONDS_OF_WAITING
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "result.npz"
        inputs = [_CHILD, script, path.absolute(), result, cpu_allowed]
        try:
            done = subprocess.run(
                [sys.executable, "-P", *map(str, inputs)],
                input=json.dumps(settings).encode(),
                capture_output=True,
                timeout=allowed,
                check=False,
                env={**os.environ, **_NO_PLUGINS},
            )
        except subprocess.TimeoutExpired as error:
            raise UnreadableError(f"it did not end within {allowed:.0f} s of waiting") from error
        if done.returncode == -getattr(signal, "SIGXCPU", 0):
            raise UnreadableError(f"it did not end within {cpu_allowed} s of computing")
        complaints = " ".join(done.stderr.decode("utf-8", "replace").split())
        missing = _MISSING.search(complaints) if done.returncode else None
        if missing:
            raise _missing(path, missing[1], missing[1])
        if done.returncode or not result.is_file():
            raise UnreadableError(complaints[-300:] or f"its process ended with {done.returncode}")
        return _unpacked(NpzArchive(result, "a result"), complaints)


def run_library(path: Path, extra: str, **settings: object) -> ReaderResult:
    """Read a file by the library of an extra alone, as the script of libraries does."""
    library, import_seconds = LIBRARIES[extra]
    if not is_installed(library):
        raise _missing(path, library, f'"bayes_placement[{extra}]"')
    return run(_LIBRARIES, path, import_seconds, extra=extra, **settings)


def is_installed(library: str) -> bool:
    """Whether a module can be imported, looked for within each package that it is in."""
    parts = library.split(".")
    names = [".".join(parts[:end]) for end in range(1, len(parts) + 1)]
    return all(importlib.util.find_spec(name) is not None for name in names)


def _missing(path: Path, library: str, package: str) -> MissingExtraError:
    return MissingExtraError(
        f"{path} cannot be read, since {library} is not installed, which its reader needs for this "
        f"format. Install it: pip install {package}."
    )


def _unpacked(archive: NpzArchive, complaints: str) -> ReaderResult:
    """Arrays by the names in `metadata`, which is JSON; a name of an array may hold anything."""
    metadata = json.loads(str(archive.array("metadata")))
    arrays = {name: archive.array(f"array {n}") for n, name in enumerate(metadata.pop("names"))}
    return ReaderResult(arrays, metadata, complaints)
