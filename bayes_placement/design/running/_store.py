"""Finished chunks in a folder."""

from importlib.metadata import version
from pathlib import Path

import numpy as np

from ...experiment.array_store import ArrayStore
from ...experiment.content_hash import content_hash
from .chunks import Chunk

VERSION = version("bayes_placement")
"""Part of the name of each file, since results of another version may differ."""

GAIN, JACKKNIFE = "information_gain", "information_gain_jackknife"


class Store:
    """A folder with a file for each finished chunk, see `ArrayStore`.

    Parameters
    ----------
    folder
        The folder, made if it does not exist; None stores nothing.
    """

    def __init__(self, folder: str | Path | None):
        self._files = None if folder is None else ArrayStore(folder)

    def read(self, chunk: Chunk) -> np.ndarray | None:
        """Information gain of a chunk; None if it is missing or, with a warning, damaged."""
        arrays = None if self._files is None else self._files.read(_key(chunk))
        return None if arrays is None else np.column_stack([arrays[GAIN], arrays[JACKKNIFE]])

    def write(self, chunk: Chunk, gain: np.ndarray) -> None:
        """Store the information gain of a chunk [cell, 1 + replicate]."""
        if self._files is None:
            return
        settings = np.array(str(chunk.task.settings()))
        gains = {GAIN: gain[:, 0], JACKKNIFE: gain[:, 1:]}
        self._files.write(_key(chunk), gains | {"settings": settings} | chunk.recorded())


def _key(chunk: Chunk) -> str:
    return content_hash(VERSION, chunk.content())
