"""Chunks that are shared among processes; each result is stored as soon as it arrives."""

from collections.abc import Generator, Sequence
from concurrent.futures import Executor
from contextlib import closing
from pathlib import Path
from typing import TypeAlias

import numpy as np

from ..._shared.errors import InputError
from ..._shared.parts import done_by, shared_in_any_order
from ..._shared.progress import Progress
from ._store import Store
from .chunks import Chunk, compute, compute_packed

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
