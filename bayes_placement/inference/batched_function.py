"""A compiled function of batches at any number of points, as many batches at once as cores."""

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from .threaded_map import threaded_map

BATCH = 8
"""Points evaluated together: more cost memory, fewer cost compiled calls."""


class BatchedFunction:
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
