"""_running: in, chunks and an executor; out, their results, each kept as soon as it is there.

Not known here: what a chunk is about. The one seam between the computation and where it runs.
"""

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

from ..._types import Progress
from ._cells import Chunk, compute, compute_sent
from ._executors import Processes
from ._store import Store

Computed: TypeAlias = tuple[Chunk, np.ndarray]

AHEAD = 200
"""Chunks handed out at once: enough for as many workers, few enough for a scheduler to hold."""


def run(
    chunks: Sequence[Chunk],
    executor: Executor | None,
    store: str | Path | None,
    progress: Progress,
) -> Generator[Computed, None, None]:
    """Results of all chunks, in any order; those in the store are read, not computed."""
    kept = Store(store)
    missing = []
    done = 0
    for one in chunks:
        result = kept.read(one)
        if result is None:
            missing.append(one)
            continue
        done += 1
        yield one, result
    progress(done / len(chunks))
    with closing(_computed(missing, executor)) as computed:
        for one, result in computed:
            kept.write(one, result)
            done += 1
            progress(done / len(chunks))
            yield one, result


def _computed(
    chunks: Sequence[Chunk], executor: Executor | None
) -> Generator[Computed, None, None]:
    if executor is None:
        return ((one, compute(one)) for one in chunks)
    return _elsewhere(chunks, executor)


def _elsewhere(chunks: Sequence[Chunk], executor: Executor) -> Generator[Computed, None, None]:
    """Results as they come; what a lost worker leaves is handed out again.

    Raises
    ------
    RuntimeError
        If the executor cannot go on.
    """
    missing = dict(enumerate(chunks))
    while missing:
        try:
            with closing(_handed_out(missing, executor)) as results:
                for number, result in results:
                    one = missing.pop(number)
                    yield one, result[: len(one.place)]
        except (BrokenExecutor, CancelledError) as error:
            if not (isinstance(executor, Processes) and executor.renew()):
                raise RuntimeError(
                    "A worker was lost, and its executor cannot go on. Chunks that were finished "
                    "are in the store, if one was given: run again with the same store=... and a "
                    "new executor, and only what is missing is computed. Where every worker is "
                    "lost at once, look at what it said: it may lack memory, or a script lacks "
                    'its line `if __name__ == "__main__":`.'
                ) from error


def _handed_out(
    chunks: Mapping[int, Chunk], executor: Executor
) -> Generator[tuple[int, np.ndarray], None, None]:
    """Results by number as they come; whatever ends this leaves nothing waiting."""
    waiting = iter(list(chunks.items()))
    futures: dict[Future[np.ndarray], int] = {}
    try:
        while True:
            for number, one in itertools.islice(waiting, AHEAD - len(futures)):
                futures[executor.submit(compute_sent, one.sent())] = number
            if not futures:
                return
            finished = wait(futures, return_when=FIRST_COMPLETED).done
            # What came is kept before anything that failed is told.
            for future in sorted(finished, key=_failed):
                yield futures.pop(future), future.result()
    finally:
        for future in futures:
            future.cancel()


def _failed(future: Future[np.ndarray]) -> bool:
    return future.cancelled() or future.exception() is not None
