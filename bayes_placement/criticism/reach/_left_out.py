"""A fit without some of its data, to first order: what anything done to these could explain.

Whatever was done to a channel, its data are at best as probable as without any residual. So the
evidence is at most that of all other data, times their greatest density.
"""

import functools

import numpy as np
from jaxtyping import Bool

from ...inference.engines.levenberg_marquardt import Fit
from ...inference.residuals import Problem


class LeftOut:
    """A fit, of which some data are left out."""

    def __init__(self, problem: Problem, fit: Fit):
        self._problem, self._fit = problem, fit
        self._covariance = fit.gaussian.covariance

    def squares(self, data: Bool[np.ndarray, "datum"]) -> float:
        """Sum of squares of the others and of the prior, once all is fitted to them."""
        return self._fit.squares - 2 * self._gained(data)[0]

    def most_evidence(self, data: Bool[np.ndarray, "datum"]) -> float:
        """Log evidence that nothing done to these data exceeds; infinite of unknown noise.

        A level of noise may fall as low as it likes where nothing is left of the residuals.
        """
        if not self._problem.squares.known_noise:
            return float("inf")
        gained, volume = self._gained(data)
        return self._fit.log_evidence + gained + volume

    def _gained(self, data: Bool[np.ndarray, "datum"]) -> tuple[float, float]:
        """Decrease of the cost, and of half the log determinant of the curvature."""
        changes, along, residual = self._at_fit
        unknowns = np.flatnonzero(changes[:, data].any(axis=1))
        group = self._problem.squares.column_groups.group[unknowns]
        slopes = along[np.ix_(group, data)] * changes[np.ix_(unknowns, data)]
        left, pull = residual[data], slopes @ residual[data]
        covariance = self._covariance[np.ix_(unknowns, unknowns)]
        told = np.eye(len(unknowns)) - covariance @ (slopes @ slopes.T)
        gained = 0.5 * (left @ left + pull @ np.linalg.solve(told, covariance @ pull))
        return float(gained), float(-0.5 * np.linalg.slogdet(told)[1])

    @functools.cached_property
    def _at_fit(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Which data each unknown changes, slopes along the groups, and residuals."""
        squares = self._problem.squares
        residual, _, along, _ = squares.along_groups(self._fit.point[None])
        return squares.column_groups.changes, along[0], residual[0]
