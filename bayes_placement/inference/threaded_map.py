"""A function of several inputs on all cores: NumPy and compiled functions leave Python free."""

import functools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from .._processes import has_one_core

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
