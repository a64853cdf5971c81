"""_estimates: in, a fitted hypothesis; out, its unknowns by name, with intervals.

Not known here: candidates, what is claimed.
"""

from typing import Any, NamedTuple

import numpy as np

from ..estimates import scalars
from ._hypotheses import Hypothesis

DRAWS = 2000
OUTER = (0.005, 0.995)
"""Probabilities between which the interval lies: 99 %."""


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
    """Every unknown, from draws [draw, unknown] or from Laplace's Gaussian."""
    problem = hypothesis.problem
    drawn = _laplace(hypothesis) if points is None else points
    values = problem.coordinates.named(drawn)
    units = {one.name: one.unit for one in problem.experiment.unknowns}
    return {
        word: _estimate(np.asarray(column).ravel(), units[name])
        for name, whole in values.items()
        for word, column in scalars(name, whole[None])
    }


def _laplace(hypothesis: Hypothesis) -> np.ndarray:
    normal = np.random.default_rng(0).standard_normal((DRAWS, hypothesis.problem.dimension))
    return hypothesis.fit.point + normal @ np.linalg.cholesky(hypothesis.fit.covariance).T


def _estimate(draws: Any, unit: str) -> Estimate:
    low, high = np.quantile(draws, OUTER)
    return Estimate(float(np.mean(draws)), float(np.std(draws)), float(low), float(high), unit)
