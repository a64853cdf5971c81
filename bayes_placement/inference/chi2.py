"""Chi2 of a fitted model: its value, what is expected of a correct model, and its p-value."""

from collections.abc import Mapping
from functools import cached_property

import numpy as np
import xarray as xr
from scipy.special import chdtrc

from .output_residuals import Chosen, Draws, Residuals, output_residuals
from .units import three_digits

LEVEL = 0.01
"""Probability that a correct model does not pass."""

_SPREAD_DRAWS = 256


class Chi2:
    """Chi2 of any group of residuals at the posterior mean response."""

    def __init__(self, data: Residuals) -> None:
        self.data = data

    def of(self, group: Chosen) -> dict[str, float]:
        """Chi2 per datum at the posterior mean response, with its distribution for a correct model.

        The residual of a correct model has the covariance (noise) - (posterior covariance of the
        response). The mean of chi2 follows from its trace for any posterior; the spread and the
        p-value (Satterthwaite) hold for a Gaussian one.
        """
        names = ("chi2_per_datum", "expected", "spread", "p_value")
        mask = self.data.present & group[..., None]
        count = int(mask.sum())
        if self.data.deviation is None or count == 0:
            return dict.fromkeys(names, float("nan"))
        chi2 = float(np.sum((self.data.residual / self.data.scale)[mask] ** 2))
        first, second = self._absorbed(mask)
        mean = max(count - first, 0.0)
        variance = 2 * max(mean - first + second, mean**2 / count)
        values = (chi2 / count, mean / count, np.sqrt(variance) / count)
        return dict(zip(names, (*values, _upper_tail(chi2, mean, variance)), strict=True))

    def _absorbed(self, mask: np.ndarray) -> tuple[float, float]:
        """Traces of S and S S, S the covariance of the response over that of the noise.

        tr S is the number of parameters that the data determine. It exceeds the number of unknowns
        where modes of the posterior are far apart in the response, and is then limited to it: such
        a spread does not excuse a misfit.
        """
        spread = self._spread
        count = spread.shape[0] - 1
        total = np.sum(spread[:, self.data.present] ** 2) / count
        share = min(1.0, self.data.unknowns / total) if total > 0 else 1.0
        gram = spread[:, mask] @ spread[:, mask].T / count
        first = float(np.trace(gram))
        second = (float(np.sum(gram**2)) - first**2 / count) / (1 + 1 / count)
        return share * first, share**2 * max(second, 0.0)

    @cached_property
    def _spread(self) -> Draws:
        """Draws of the response less their mean, in noise deviations."""
        stride = max(1, -(-self.data.draws.shape[0] // _SPREAD_DRAWS))
        thinned = self.data.draws[::stride]
        return (thinned - thinned.mean(axis=0)) / self.data.scale


def misfit_sentence(result: xr.DataTree) -> str:
    """Say that a model fails, where its noise is known and chi2 says so; else nothing."""
    predicted = result["posterior_predictive"]
    if predicted.sizes.get("chain", 1) * predicted.sizes.get("draw", 1) < 2:
        return ""
    data = output_residuals(result)
    statistics = Chi2(data).of(np.ones(data.present.shape[:3], dtype=bool))
    if not statistics["p_value"] < LEVEL:
        return ""
    return (
        f"The model fails: reduced chi-square is {chi2_in_words(statistics)} "
        f"({p_in_words(statistics['p_value'])}). Intervals of a model that fails cannot be "
        "trusted: bp.check(result) says where it fails."
    )


def chi2_in_words(group: xr.Dataset | Mapping[str, float]) -> str:
    """Say how large chi2 is, and how large that of a correct model."""
    names = ("chi2_per_datum", "expected", "spread")
    chi2, expected, spread = (float(group[name]) for name in names)
    return f"{three_digits(chi2)}; {expected:.2f} ± {spread:.2f} is expected of a correct model"


def p_in_words(value: float) -> str:
    """Write a p-value."""
    return f"p = {value:.2g}" if value > 1e-12 else "p < 1e-12"


def _upper_tail(value: float, mean: float, variance: float) -> float:
    """Upper tail of the scaled chi2 distribution of these moments; NaN for a mean below 1."""
    if mean < 1:
        return float("nan")
    scale = variance / (2 * mean)
    return float(chdtrc(mean / scale, value / scale))
