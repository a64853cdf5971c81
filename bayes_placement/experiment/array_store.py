"""Finished parts of a computation in a folder, one file each, read again by a later run."""

import io
import tempfile
import zipfile
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .._shared.errors import InputError, warn
from .._shared.files import write_atomically


class ArrayStore:
    """A folder with a NumPy file for each finished part, named by a hash of all its inputs.

    Each file holds its name too, so that one that was copied under another is not believed.
    Files are complete or absent: a run that is killed leaves at most a temporary file, which is
    never read, and two runs may share a folder.
    """

    def __init__(self, folder: str | Path):
        self.folder = Path(folder)
        _make_writable(self.folder)

    def __contains__(self, key: str) -> bool:
        """Whether there is a file, which may be damaged."""
        return self._path(key).exists()

    def read(self, key: str) -> dict[str, np.ndarray] | None:
        """Arrays by name; None if the file is missing or, with a warning, damaged."""
        path = self._path(key)
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        try:
            return _checked(content, key)
        except (OSError, RuntimeError, ValueError, KeyError, zipfile.BadZipFile) as error:
            warn(
                f"{path} is damaged ({error}). What it held is computed again, and it is replaced."
            )
            return None

    def write(self, key: str, arrays: Mapping[str, Any]) -> None:
        """Store arrays by name."""
        write_atomically(self._path(key), partial(np.savez, key=np.array(key), **arrays))

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.npz"


def _make_writable(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise InputError(
            f"store={str(folder)!r} is a file. A folder is needed, which is made if it does not "
            'exist, since each finished part is a file in it: store="finished".'
        )
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass  # fails here and not after the first part if the folder is not writable


def _checked(content: bytes, key: str) -> dict[str, np.ndarray]:
    """Arrays in a file, after a check of its check sums (CRC-32) and of its key."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        if archive.testzip() is not None:
            raise InputError("its numbers are not those that were written")
    with np.load(io.BytesIO(content)) as file:
        arrays = dict(file)
    if str(arrays.pop("key")) != key:
        raise InputError("it holds another part, which was copied under this name")
    return arrays
