"""A compiled function of batches at any number of points, as many batches at once as cores."""

import functools
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from jaxtyping import Float

BATCH = 8
"""Points evaluated together: more cost memory, fewer cost compiled calls."""

MOST_AT_ONCE = 4
"""Most batches at once: linear algebra in them waits for threads of JAX, see `LEAST_THREADS`."""

Values = tuple[np.ndarray, ...]


class InBatches:
    """A function of batches of points, at any number of them.

    Parameters
    ----------
    function
        From points [BATCH, unknown] and further arguments to arrays [BATCH, ...]. It is compiled at
        its first call.
    """

    def __init__(self, function: Callable[..., tuple[Any, ...]]):
        self._function = function
        self._is_compiled = False

    def __call__(self, points: Float[np.ndarray, "point unknown"], *arguments: Any) -> Values:
        """Arrays [point, ...] at the points."""
        count = len(points)
        padded = np.concatenate([points, np.repeat(points[-1:], -count % BATCH, axis=0)])
        batches = padded.reshape(len(padded) // BATCH, BATCH, points.shape[1])
        at = functools.partial(self._at, arguments)
        # Alone, since two threads would both compile.
        first = [] if self._is_compiled else [at(batches[0])]
        self._is_compiled = True
        parts = [*first, *_at_once(at, batches[len(first) :])]
        return tuple(np.concatenate(values)[:count] for values in zip(*parts, strict=True))

    def _at(self, arguments: tuple[Any, ...], batch: np.ndarray) -> Values:
        return tuple(np.asarray(values) for values in self._function(batch, *arguments))


def _at_once(at: Callable[[np.ndarray], Values], batches: np.ndarray) -> list[Values]:
    """Values of each batch, on all cores."""
    threads = _threads()
    if threads is None or len(batches) < 2:
        return [at(batch) for batch in batches]
    return list(threads.map(at, batches))


@functools.cache
def _threads() -> ThreadPoolExecutor | None:
    """One thread for each core, none where there is a single one."""
    count = min(os.cpu_count() or 1, MOST_AT_ONCE)
    return ThreadPoolExecutor(count, thread_name_prefix="batches") if count > 1 else None
