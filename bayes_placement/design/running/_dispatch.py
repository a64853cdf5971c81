"""Chunks submitted to an executor; each result is stored as soon as it arrives."""

import itertools
from collections.abc import Generator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    wait,
)
from contextlib import closing
from pathlib import Path
from typing import TypeAlias

import numpy as np

from ..._shared.errors import InputError, WorkerError
from ..._shared.processes import shared_in_any_order
from ..._shared.progress import Progress
from ._store import Store
from .chunks import Chunk, compute, compute_packed
from .executors import WorkerProcesses

Computed: TypeAlias = tuple[Chunk, np.ndarray]

IN_FLIGHT = 200
"""Chunks submitted at once: enough for as many workers, few enough for a scheduler."""

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
    if executor is not None:
        return _by_executor(chunks, executor)
    if len(chunks) < LEAST_SHARED:
        return ((chunk, compute(chunk)) for chunk in chunks)
    return _with_helpers(chunks)


def _with_helpers(chunks: Sequence[Chunk]) -> Generator[Computed, None, None]:
    """Results of this process and of helpers on its other cores, see `shared`."""
    try:
        tasks = [(chunk.packed(),) for chunk in chunks]
    except InputError:  # what cannot be sent is computed here
        yield from ((chunk, compute(chunk)) for chunk in chunks)
        return
    for number, gain in shared_in_any_order(compute_packed, tasks):
        yield chunks[number], gain[: len(chunks[number].cells)]


def _by_executor(chunks: Sequence[Chunk], executor: Executor) -> Generator[Computed, None, None]:
    """Results as they arrive; chunks of a lost worker are submitted again."""
    missing = dict(enumerate(chunks))
    while missing:
        try:
            with closing(_submitted(missing, executor)) as results:
                for number, gain in results:
                    chunk = missing.pop(number)
                    yield chunk, gain[: len(chunk.cells)]
        except (BrokenExecutor, CancelledError) as error:
            if not (isinstance(executor, WorkerProcesses) and executor.replace()):
                raise WorkerError(
                    "A worker was lost, or the scheduler, and the executor cannot go on. Chunks "
                    "that were finished are in the store, if one was given: run again with the "
                    "same store=... and a new executor, and only what is missing is computed. "
                    "Where every worker is lost at once, look at what it said: it may lack memory, "
                    'or a script lacks its line `if __name__ == "__main__":`.'
                ) from error


def _submitted(
    chunks: Mapping[int, Chunk], executor: Executor
) -> Generator[tuple[int, np.ndarray], None, None]:
    """Results by number as they arrive; chunks that still wait at the end are cancelled."""
    waiting = iter(list(chunks.items()))
    futures: dict[Future[np.ndarray], int] = {}
    try:
        while True:
            for number, chunk in itertools.islice(waiting, IN_FLIGHT - len(futures)):
                futures[executor.submit(compute_packed, chunk.packed())] = number
            if not futures:
                return
            finished = wait(futures, return_when=FIRST_COMPLETED).done
            # Results are yielded before a failure in the same batch is raised.
            for future in sorted(finished, key=_failed):
                yield futures.pop(future), future.result()
    finally:
        for future in futures:
            future.cancel()


def _failed(future: Future[np.ndarray]) -> bool:
    return future.cancelled() or future.exception() is not None
