"""Sizes of errors that have the greatest evidence in a linear model, the errors integrated out.

MacKay (1992, doi:10.1162/neco.1992.4.3.415). His fixed point, by which the squares of the errors of
a size sum up to the number of them that the data determine, is a maximum of the evidence; where
few are determined a fixed-point iteration goes there slowly, a descent along the gradient does not.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.linalg import LinAlgError
from scipy.linalg import cho_factor, cho_solve

Logs = Float[np.ndarray, "size"]
Slope = Callable[[Logs], tuple[float, Logs]]


class LinearModel(NamedTuple):
    """Minus log likelihood, half u' A u - b' u, of errors with normal priors."""

    information: Float[np.ndarray, "unknown unknown"]
    """A, Fisher's information of the data."""
    pull: Float[np.ndarray, "unknown"]
    """b, what the data pull at."""
    precision: Float[np.ndarray, "unknown"]
    """Precision of the prior of each unknown."""
    errors: Sequence[Int[np.ndarray, "error"]]
    """Unknowns whose priors have one size, for each size."""

    def log_evidence(self, logs: Logs) -> tuple[float, Logs]:
        """Log evidence but for a constant, and its slopes along the logs of factors on the sizes.

        Minus infinity where rounding leaves no positive definite matrix.
        """
        precision = self.precision.copy()
        for places, log in zip(self.errors, logs, strict=True):
            precision[places] = self.precision[places] * np.exp(-2 * log)
        try:
            factor = cho_factor(self.information + np.diag(precision), lower=True)
        except LinAlgError:  # what the prior determines alone is lost in rounding
            return -np.inf, np.zeros(len(logs))
        covariance = cho_solve(factor, np.eye(len(precision)))
        mean = covariance @ self.pull
        volume = 0.5 * np.sum(np.log(precision)) - np.sum(np.log(np.diag(factor[0])))
        spread = precision * (mean**2 + np.diag(covariance))
        slopes = [np.sum(spread[places]) - len(places) for places in self.errors]
        return float(0.5 * self.pull @ mean + volume), np.array(slopes)

    def best_sizes(
        self, low: Logs, high: Logs, log_prior: Slope | None = None
    ) -> tuple[Logs, float]:
        """Logs of the factors on the sizes of the greatest evidence, and the log evidence gained.

        Zero lies between the least and the greatest log of each. Their prior is uniform by default.
        """

        def cost(logs: Logs) -> tuple[float, Logs]:
            value, slopes = self.log_evidence(logs)
            prior, of_prior = (0.0, 0.0) if log_prior is None else log_prior(logs)
            return -value - prior, -slopes - of_prior

        start = np.zeros(len(self.errors))
        if not start.size or not np.isfinite(before := cost(start)[0]):
            return start, 0.0
        bounds = np.transpose([low, high])
        from scipy.optimize import minimize  # it takes long to import

        result = minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds)
        return np.asarray(result.x), float(before - result.fun)
