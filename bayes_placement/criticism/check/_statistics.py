"""Chi2, whiteness and predictive p-values of any group of residuals."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy import stats

from ._residuals import Chosen, Draws, Residuals, Values

LAGS = 5
"""Lines apart up to which residuals are compared."""

FEWEST_PAIRS = 16
"""Pairs of lines below which nothing is said of whiteness."""

_SPREAD_DRAWS = 256
_LARGEST = 3.0
"""Residuals beyond so many deviations count no more: a few peaks must not decide of whiteness."""

Pairs = Float[np.ndarray, "lag sensor actuator frequency part"]


@dataclass(frozen=True)
class Statistics:
    """Statistics of any group of residuals; what all groups share is computed once."""

    data: Residuals

    def of(self, group: Chosen) -> dict[str, float]:
        """All statistics of one group."""
        count = {"data": float(np.sum(self.data.present[..., 0] & group))}
        found = count | self.chi2(group) | {"whiteness": self.whiteness(group)}
        return found | {"predictive": self.predictive(group)}

    def chi2(self, group: Chosen) -> dict[str, float]:
        """Chi2 per datum at the posterior mean response, with what a right model gives.

        The residual of a right model has the covariance (noise) - (posterior covariance of the
        response); the mean of chi2 follows from its trace whatever the shape of the posterior,
        the spread and the p-value (Satterthwaite) as if it were Gaussian.
        """
        names = ("chi2_per_datum", "expected", "spread", "p_value")
        here = self.data.present & group[..., None]
        count = int(here.sum())
        if self.data.deviation is None or count == 0:
            return dict.fromkeys(names, float("nan"))
        found = float(np.sum((self.data.residual / self.data.scale)[here] ** 2))
        first, second = self._absorbed(here)
        mean = max(count - first, 0.0)
        variance = 2 * max(mean - first + second, mean**2 / count)
        values = (found / count, mean / count, np.sqrt(variance) / count)
        return dict(zip(names, (*values, _upper_tail(found, mean, variance)), strict=True))

    def whiteness(self, group: Chosen) -> float:
        """p-value of residuals of neighbouring lines that have nothing to do with each other.

        The variance ratio test that allows for any change of the noise along the lines (Lo and
        MacKinlay, 1988, doi:10.1093/rfs/1.1.41), on the side on which neighbours are alike, as
        what a model leaves out makes them.
        """
        products, squares = (np.sum(pairs[:, group], axis=(1, 2)) for pairs in self._lagged)
        if np.sum(self._lagged[1][0, group] > 0) < FEWEST_PAIRS:
            return float("nan")
        weight = 1 - np.arange(1, products.size + 1) / (products.size + 1)
        return float(stats.norm.sf(weight @ products / np.sqrt(weight**2 @ squares)))

    def predictive(self, group: Chosen) -> float:
        """Posterior predictive p-value: the share of draws whose replicate misfits them more.

        The discrepancy is chi2 of data and of replicate about the response of the same draw
        (Gelman, Meng and Stern, 1996).
        """
        if self.data.replicates is None:
            return float("nan")
        return float(np.mean(np.sum(self._excess[:, group], axis=1) >= 0))

    def _absorbed(self, here: np.ndarray) -> tuple[float, float]:
        """Traces of S and S S, S the covariance of the response over that of the noise.

        tr S is the number of parameters that the data determine; it exceeds the number of
        unknowns where a posterior of several modes misfits in several ways, which is no fit.
        """
        spread = self._spread
        count = spread.shape[0] - 1
        whole = np.sum(spread[:, self.data.present] ** 2) / count
        share = min(1.0, self.data.unknowns / whole) if whole > 0 else 1.0
        gram = spread[:, here] @ spread[:, here].T / count
        first = float(np.trace(gram))
        second = (float(np.sum(gram**2)) - first**2 / count) / (1 + 1 / count)
        return share * first, share**2 * max(second, 0.0)

    @cached_property
    def _spread(self) -> Draws:
        """Draws of the response about their mean, over the noise."""
        stride = max(1, -(-self.data.draws.shape[0] // _SPREAD_DRAWS))
        thinned = self.data.draws[::stride]
        return (thinned - thinned.mean(axis=0)) / self.data.scale

    @cached_property
    def _excess(self) -> Float[np.ndarray, "draw sensor actuator frequency"]:
        """Squares of replicates less squares of the data, about each draw, over the noise."""
        data = self.data
        weight = np.where(data.present, data.scale**-2.0, 0.0)
        replicated, observed = data.replicates - data.draws, data.measured - data.draws
        return np.sum(weight * (replicated**2 - observed**2), axis=-1)

    @cached_property
    def _lagged(self) -> tuple[Pairs, Pairs]:
        """Products of residuals some lines apart, less what a fit leaves, and their squares."""
        lags = range(1, min(LAGS, self.data.frequency.size - 1) + 1)
        pairs = [self._pairs(lag) for lag in lags] or [(np.zeros_like(self.data.residual),) * 2]
        return np.stack([one[0] for one in pairs]), np.stack([one[1] for one in pairs])

    def _pairs(self, lag: int) -> tuple[Values, Values]:
        data, scale = self.data, self.data.scale
        scaled = np.clip(data.residual / scale, -_LARGEST, _LARGEST)
        same_run = data.force_level[lag:] == data.force_level[:-lag]
        both = data.present[:, :, lag:] & data.present[:, :, :-lag] & same_run[:, None]
        product = np.where(both, scaled[:, :, lag:] * scaled[:, :, :-lag], 0.0)
        # Fitting takes from the residuals the covariance of the response.
        about = data.draws - data.mean
        fitted = np.mean(about[:, :, :, lag:] * about[:, :, :, :-lag], axis=0)
        fitted = np.where(both, fitted / (scale[:, :, lag:] * scale[:, :, :-lag]), 0.0)
        fill = [(0, 0), (0, 0), (0, lag), (0, 0)]
        return np.pad(product + fitted, fill), np.pad(product**2, fill)


def _upper_tail(value: float, mean: float, variance: float) -> float:
    """Tail of the scaled chi2 distribution of this mean and variance; unknown below one degree."""
    if mean < 1:
        return float("nan")
    scale = variance / (2 * mean)
    return float(stats.chi2.sf(value / scale, mean / scale))
