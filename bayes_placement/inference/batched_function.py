"""A compiled function of batches at any number of points, as many batches at once as cores."""

import functools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float, Int, Shaped

from .._shared.processes import has_one_core

BATCH = 8
"""Points evaluated together: more cost memory, fewer cost compiled calls."""


class BatchedFunction:
    """A function of batches of points, at any number of them.

    It maps points [BATCH, unknown] and further arguments to arrays [BATCH, ...], and is compiled at
    its first call.
    """

    def __init__(self, function: Callable[..., tuple[Any, ...]]):
        self._function = function
        self._is_compiled = False

    def fill(
        self,
        arrays: Sequence[np.ndarray],
        points: Float[np.ndarray, "point unknown"],
        *arguments: Any,
    ) -> None:
        """Write what the function returns into arrays [point, ...]: nothing is copied twice."""
        write = functools.partial(self._write, arrays, points, arguments)
        begins = range(0, len(points), BATCH)
        if begins and not self._is_compiled:  # alone, since two threads would both compile
            write(begins[0])
            self._is_compiled, begins = True, begins[1:]
        threaded_map(write, begins)

    def _write(
        self,
        arrays: Sequence[np.ndarray],
        points: np.ndarray,
        arguments: tuple[Any, ...],
        begin: int,
    ) -> None:
        batch = points[begin : begin + BATCH]
        padded = np.concatenate([batch, np.repeat(batch[-1:], BATCH - len(batch), axis=0)])
        for array, values in zip(arrays, self._function(padded, *arguments), strict=True):
            array[begin : begin + BATCH] = np.asarray(values)[: len(batch)]


MOST_AT_ONCE = 4
"""Most calls at once: linear algebra in them waits for threads of JAX, see `LEAST_THREADS`."""

Input = TypeVar("Input")
Output = TypeVar("Output")


def threaded_map(function: Callable[[Input], Output], inputs: Sequence[Input]) -> list[Output]:
    """Outputs of a function, in the order of its inputs."""
    threads = None if has_one_core() else _threads(os.getpid())
    if threads is None or len(inputs) < 2:
        return [function(value) for value in inputs]
    return list(threads.map(function, inputs))


@functools.cache
def _threads(process: int) -> ThreadPoolExecutor | None:
    """One thread for each core, none where there is a single one.

    By the number of the process: one that is forked has no thread of its parent, and would wait.
    """
    count = min(os.cpu_count() or 1, MOST_AT_ONCE)
    return ThreadPoolExecutor(count, thread_name_prefix="threaded_map") if count > 1 else None


def distinct_rows(
    rows: Shaped[np.ndarray, "row column"],
) -> tuple[Int[np.ndarray, "different"], Int[np.ndarray, "row"]]:
    """Return the first index of each distinct row, and for each row which of these it is."""
    number: dict[bytes, int] = {}
    which = np.array([number.setdefault(row.tobytes(), len(number)) for row in rows], dtype=int)
    _, first = np.unique(which, return_index=True)
    return first, which
