"""Errors of which a few are far larger than the others.

Box and Tiao, A Bayesian approach to some outlier problems, Biometrika 55 (1968),
doi:10.1093/biomet/55.1.119.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import bdtrc

OUTLIERS, SIZE_OF_OUTLIERS = 0.01, 10.0
"""Share of data that are outliers, and factor on their deviation."""


class Mixture(NamedTuple):
    """Errors that are normal, or with a small probability far larger.

    `gain` is the log likelihood over that of normal errors of the fitted deviations; a datum is an
    outlier with a probability that is zero where nothing was measured.
    """

    gain: float
    probability: Float[np.ndarray, "datum"]

    @property
    def outliers(self) -> float:
        """Expected number of outliers."""
        return float(np.sum(self.probability))


def p_value(outliers: float, count: int) -> float:
    """Probability of at least as many outliers among so many data, of the share that is assumed.

    More of them are a misfit at many lines.
    """
    return float(bdtrc(np.ceil(outliers) - 1, count, OUTLIERS))


def mixture(residual: Float[np.ndarray, "datum"], count: int) -> Mixture:
    """Fit a mixture to residuals.

    The level of all is the most probable one, since outliers have raised the one that was fitted.

    Residuals are over their fitted standard deviations, zero where nothing was measured; `count`
    data were.
    """
    squares = residual**2

    def parts(log_level: float) -> tuple[np.ndarray, np.ndarray]:
        errors = -0.5 * squares * np.exp(-2 * log_level)
        outliers = errors / SIZE_OF_OUTLIERS**2 - np.log(SIZE_OF_OUTLIERS)
        return np.log1p(-OUTLIERS) + errors, np.log(OUTLIERS) + outliers

    def loss(log_level: float) -> float:
        return count * log_level - float(np.sum(np.logaddexp(*parts(log_level))))

    from scipy.optimize import minimize_scalar  # it takes long to import

    best = minimize_scalar(loss, bounds=(-np.log(SIZE_OF_OUTLIERS), 0.0))
    normal, outlying = parts(best.x)
    probability = np.exp(outlying - np.logaddexp(normal, outlying))
    gain = float(0.5 * np.sum(squares) - best.fun)
    return Mixture(gain, np.where(residual != 0, probability, 0.0))
