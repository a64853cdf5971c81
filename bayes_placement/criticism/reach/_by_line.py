"""What any law leaves of the misfit line by line, all else held: shares for each part of the band.

A fit of all else to that part alone may remove more, so that such a share bounds nothing.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ...inference.residuals import Problem
from ..kept_fits import NONE, stored_or_computed
from ._at_port import Point, ReachOfPort
from ._free_law import complex_residuals, in_parts, squares_by_line, tells_phase

OF_LAW = 2
"""Numbers that a free law takes at each line, whatever they explain."""


class LeftByLine(NamedTuple):
    """Sums of squares at each line, all unknowns being held.

    `given` is of the model as given, `left` with a law that may be any, for each place: of a
    `Reach` the rows of its `curves`. So many numbers were `measured` at the line.
    """

    given: Float[np.ndarray, "line"]
    left: Float[np.ndarray, "row line"]
    measured: Int[np.ndarray, "line"]

    def any_law(self, lines: Any) -> Float[np.ndarray, "row"]:
        """Share of the misfit above noise at some lines that any law could remove [1]."""
        given, freed = self.given[lines].sum(), OF_LAW * self.given[lines].size
        above = given - self.measured[lines].sum()
        left = self.left[:, lines].sum(axis=1) + freed
        return np.clip((given - left) / above, 0.0, 1.0) if above > 0 else 0.0 * left


_LAYOUT = LeftByLine(NONE, NONE, NONE)
"""Its structure alone matters."""


def left_by_line(problem: Problem, point: Point, reaches: Sequence[Any]) -> LeftByLine | None:
    """Return what laws leave at each line; None of amplitudes and modes, and of two states."""
    is_known = problem.baseline is None and tells_phase(problem)
    if not is_known or not all(isinstance(reached, ReachOfPort) for reached in reaches):
        return None

    def computed() -> LeftByLine:
        residual = complex_residuals(problem.squares.residuals(point[None])[0], problem)
        left = np.concatenate([_left(reached) for reached in reaches])
        return LeftByLine(squares_by_line(residual)[0], left, measured_by_line(problem))

    return stored_or_computed(computed, _LAYOUT, problem, point)


def measured_by_line(problem: Problem) -> Int[np.ndarray, "line"]:
    """Return how many numbers were measured at each line."""
    measured = np.asarray(problem.data.measured)
    count: np.ndarray = measured.reshape(-1, measured.shape[-1]).sum(axis=0)
    return count


def _left(reached: ReachOfPort) -> Float[np.ndarray, "place line"]:
    parts = (reached.free.at(points) for points in in_parts(reached.points, reached.problem))
    return np.concatenate([squares_by_line(at.left(at.best())) for at in parts])
