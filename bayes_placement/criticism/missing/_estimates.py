"""_estimates: in, a fitted hypothesis; out, its unknowns by name, with intervals.

Not known here: candidates, what is claimed.
"""

from typing import NamedTuple

import numpy as np

from ...inference.estimates import scalars
from ._hypotheses import Hypothesis

DRAWS = 2000
OUTER = 2.5758
"""Standard deviations between which 99 % of a normal law lie."""


class Estimate(NamedTuple):
    """What is known of one unknown.

    Parameters
    ----------
    mean, standard_deviation
        Of the posterior.
    low, high
        Its 99 % interval.
    unit
        Unit of the above.
    """

    mean: float
    standard_deviation: float
    low: float
    high: float
    unit: str

    def __str__(self) -> str:
        """Mean and standard deviation, with the unit."""
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        return f"{self.mean:.5g} ± {self.standard_deviation:.2g}{unit}"


def estimates(hypothesis: Hypothesis, points: np.ndarray | None = None) -> dict[str, Estimate]:
    """Every unknown, from draws [draw, unknown] or from Laplace's Gaussian.

    Intervals are those of a normal law in standard normal coordinates, as wide as the draws: a
    few hundred draws would not tell their own outermost percents.
    """
    problem = hypothesis.problem
    drawn = laplace(hypothesis) if points is None else points
    spread = OUTER * drawn.std(axis=0)
    ends = drawn.mean(axis=0) + np.array([-1.0, 1.0])[:, None] * spread
    values, sides = problem.coordinates.named(drawn), problem.coordinates.named(ends)
    units = {one.name: one.unit for one in problem.experiment.unknowns}
    return {
        word: _estimate(column.ravel(), side.ravel(), units[name])
        for name, whole in values.items()
        for (word, column), (_, side) in zip(
            scalars(name, whole[None]), scalars(name, sides[name][None]), strict=True
        )
    }


def laplace(hypothesis: Hypothesis) -> np.ndarray:
    """Draws [draw, unknown] from Laplace's Gaussian."""
    normal = np.random.default_rng(0).standard_normal((DRAWS, hypothesis.problem.dimension))
    return hypothesis.fit.point + normal @ np.linalg.cholesky(hypothesis.fit.covariance).T


def _estimate(draws: np.ndarray, sides: np.ndarray, unit: str) -> Estimate:
    low, high = sorted(map(float, sides))
    return Estimate(float(np.mean(draws)), float(np.std(draws)), low, high, unit)
