"""Chunks that are shared among processes, and finished ones in a folder."""

from collections.abc import Generator, Sequence
from concurrent.futures import Executor
from contextlib import closing
from importlib.metadata import version
from pathlib import Path
from typing import TypeAlias

import numpy as np

from ..._shared.errors import InputError
from ..._shared.parts import done_by, shared_in_any_order
from ..._shared.progress import Progress
from ...experiment.array_store import ArrayStore
from ...experiment.content_hash import content_hash
from .chunks import Chunk, compute, compute_packed

VERSION = version("bayes_placement")
"""Part of the name of each file, since results of another version may differ."""

GAIN, JACKKNIFE = "information_gain", "information_gain_jackknife"


class Store:
    """A folder with a file for each finished chunk, made if need be; None stores nothing."""

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


Computed: TypeAlias = tuple[Chunk, np.ndarray]

LEAST_SHARED = 16
"""Chunks of which this process has helpers; a helper starts in the time of five."""


def run(
    chunks: Sequence[Chunk],
    executor: Executor | None,
    store: str | Path | None,
    progress: Progress,
) -> Generator[Computed, None, None]:
    """Results of all chunks, in any order; those in the store are read, not computed.

    Only this process writes to the store.
    """
    finished = Store(store)
    missing, done = [], 0
    for chunk in chunks:
        gain = finished.read(chunk)
        if gain is None:
            missing.append(chunk)
            continue
        done += 1
        yield chunk, gain
    progress(done / len(chunks))
    with closing(_computed(missing, executor)) as computed:
        for chunk, gain in computed:
            finished.write(chunk, gain)
            done += 1
            progress(done / len(chunks))
            yield chunk, gain


def _computed(
    chunks: Sequence[Chunk], executor: Executor | None
) -> Generator[Computed, None, None]:
    """Results of an executor, or of this process and of helpers on its other cores."""
    if executor is None and len(chunks) < LEAST_SHARED:
        yield from ((chunk, compute(chunk)) for chunk in chunks)
        return
    try:
        tasks = [(chunk.packed(),) for chunk in chunks]
    except InputError:
        if executor is not None:
            raise
        yield from ((chunk, compute(chunk)) for chunk in chunks)  # what cannot be sent
        return
    with done_by(executor):
        for number, gain in shared_in_any_order(compute_packed, tasks):
            yield chunks[number], gain[: len(chunks[number].cells)]
