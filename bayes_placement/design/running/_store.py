"""Finished chunks in a folder, one file each, read again by a later run."""

import io
import tempfile
import warnings
import zipfile
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from ..._files import write_atomically
from ..._types import InputError
from ...experiment.content_hash import content_hash
from .chunks import Chunk

VERSION = version("bayes_placement")
"""Part of the name of each file, since results of another version may differ."""


class Store:
    """A folder with a NumPy file for each finished chunk, named by a hash of all its inputs.

    Each file holds its name too, so that one that was copied under another is not believed.
    Files are complete or absent: a run that is killed leaves at most a temporary file, which is
    never read, and two runs may share a folder.

    Parameters
    ----------
    folder
        The folder, made if it does not exist; None stores nothing.

    Raises
    ------
    InputError
        If it is a file.
    """

    def __init__(self, folder: str | Path | None):
        self.folder = None if folder is None else Path(folder)
        if self.folder is not None:
            _make_writable(self.folder)

    def read(self, chunk: Chunk) -> np.ndarray | None:
        """Information gain of a chunk; None if it is missing or, with a warning, damaged."""
        if self.folder is None:
            return None
        path = self._path(self.folder, chunk)
        try:
            content = path.read_bytes()
        except FileNotFoundError:
            return None
        try:
            return _checked(content, path.stem)
        except (OSError, RuntimeError, ValueError, KeyError, zipfile.BadZipFile) as error:
            warnings.warn(
                f"{path} is damaged ({error}). Its cells are computed again, and it is replaced.",
                stacklevel=2,
            )
            return None

    def write(self, chunk: Chunk, gain: np.ndarray) -> None:
        """Store the information gain of a chunk [cell, 1 + replicate]."""
        if self.folder is None:
            return
        path = self._path(self.folder, chunk)
        arrays: dict[str, Any] = {
            "key": np.array(path.stem),
            "information_gain": gain[:, 0],
            "information_gain_jackknife": gain[:, 1:],
            "settings": np.array(str(chunk.task.settings())),
            **chunk.recorded(),
        }
        write_atomically(path, partial(np.savez, **arrays))

    def _path(self, folder: Path, chunk: Chunk) -> Path:
        return folder / f"{content_hash(VERSION, chunk.content())}.npz"


def _make_writable(folder: Path) -> None:
    if folder.exists() and not folder.is_dir():
        raise InputError(
            f"store={str(folder)!r} is a file. A folder is needed, which is made if it does not "
            'exist, since each finished chunk is a file in it: store="finished".'
        )
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass  # fails here and not after the first chunk if the folder is not writable


def _checked(content: bytes, key: str) -> np.ndarray:
    """Information gain in a file, after a check of its check sums (CRC-32) and of its key."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        if archive.testzip() is not None:
            raise InputError("its numbers are not those that were written")
    with np.load(io.BytesIO(content)) as arrays:
        if str(arrays["key"]) != key:
            raise InputError("it holds another chunk, which was copied under this name")
        return np.column_stack([arrays["information_gain"], arrays["information_gain_jackknife"]])
