"""_running: in, chunks and an executor; out, their results, each kept as soon as it is there.

Not known here: what a chunk is about. The one seam between the computation and where it runs.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, as_completed
from pathlib import Path

import numpy as np

from .._files import write_whole
from .._types import Progress
from ._cells import Chunk, compute


def run(
    chunks: Sequence[Chunk],
    executor: Executor | None,
    store: str | Path | None,
    progress: Progress,
) -> Iterator[tuple[Chunk, np.ndarray]]:
    """Results of all chunks, in any order; those in the store are read, not computed."""
    kept = _Store(store)
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
    computed = _here(missing) if executor is None else _handed_out(missing, executor)
    for one, result in computed:
        kept.write(one, result)
        done += 1
        progress(done / len(chunks))
        yield one, result


def _here(chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, np.ndarray]]:
    return ((one, compute(one)) for one in chunks)


def _handed_out(chunks: Sequence[Chunk], executor: Executor) -> Iterator[tuple[Chunk, np.ndarray]]:
    """Results as they come.

    Raises
    ------
    RuntimeError
        If the executor lost a worker and cannot go on.
    """
    futures = {executor.submit(compute, one): one for one in chunks}
    try:
        for future in as_completed(futures):
            yield futures[future], future.result()
    except BrokenExecutor as error:
        raise RuntimeError(
            "A worker was lost, and its executor cannot go on. Chunks that were finished are in "
            "the store, if one was given: run again with the same store=... and a new executor, "
            "and only what is missing is computed."
        ) from error


class _Store:
    """A folder with a file for each finished chunk, named by all that determines it."""

    def __init__(self, folder: str | Path | None):
        self.folder = None if folder is None else Path(folder)

    def read(self, chunk: Chunk) -> np.ndarray | None:
        """Result of a chunk; None where it is missing."""
        if self.folder is None:
            return None
        path = self._path(chunk)
        return np.load(path) if path.is_file() else None

    def write(self, chunk: Chunk, result: np.ndarray) -> None:
        """Keep the result of a chunk."""
        if self.folder is not None:
            write_whole(self._path(chunk), lambda beside: np.save(beside, result))

    def _path(self, chunk: Chunk) -> Path:
        assert self.folder is not None
        return self.folder / f"{chunk.fingerprint()}.npy"
