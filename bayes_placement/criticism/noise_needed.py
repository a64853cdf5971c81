"""How much noise a model needs to explain its data, where the noise is not known.

Unknown noise takes up any misfit, so that chi2 is 1 for every model. What it may not exceed is the
scatter of neighbouring lines, which no smooth misfit adds to.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import ndtr

from .._shared.reprs import with_short_repr
from ..inference.units import percent

FEWEST = 16.0
"""Fewest effective data for which the scatter of neighbouring lines is compared."""

SECOND_DIFFERENCE = np.array([-0.5, 1.0, -0.5])
"""A line less the mean of its neighbours."""

VARIANCE = 1.5
"""Variance of a second difference of independent errors of variance 1."""

VARIANCE_OF_RATIO = 2 * (4.375 / VARIANCE**2 - 1)
"""Variance of von Neumann's ratio times the number of independent errors.

4.375 is the sum of the squared autocovariances 1.5, -1 and .25 of a second difference.
"""

Rows = Float[np.ndarray, "row line"]


@with_short_repr
@dataclass(frozen=True)
class NoiseNeeded:
    """Noise that a model needs, and what it is compared with.

    `relative` is its median over the amplitude [1]; `over_scatter` the root mean square of the
    residuals over that of the scatter of neighbouring lines, NaN for too few lines, and `p_value`
    the probability that it is as large for a correct model. `over_coherence` is the fitted factor
    on what the coherence says [1], NaN where that is not read.
    """

    relative: float
    over_scatter: float
    p_value: float
    over_coherence: float = float("nan")

    def __str__(self) -> str:
        """Say how much it is."""
        amount = f"{percent(self.relative)} of the amplitude"
        times = [
            f"{value:.2g} times {what}"
            for value, what in (
                (self.over_coherence, "what the coherence says"),
                (self.over_scatter, "the scatter of neighbouring lines"),
            )
            if np.isfinite(value)
        ]
        return ", ".join([amount, " and ".join(times)]) if times else amount

    def to_json(self) -> Mapping[str, float | None]:
        """Return it as numbers for a file; None for what is not known."""
        fields = ("relative", "over_scatter", "p_value", "over_coherence")
        values = {name: getattr(self, name) for name in fields}
        return {name: float(x) if np.isfinite(x) else None for name, x in values.items()}


def over_scatter(residual: Rows, present: Bool[np.ndarray, "row line"]) -> tuple[float, float]:
    """Residuals over the scatter of neighbouring lines, and the p-value of a correct model.

    NaN for too few lines, see `neumann`.

    Residuals are over the deviation of the noise, real and imaginary parts as rows of their own.
    """
    ratio, certainty = neumann(residual, present)
    return float(ratio**-0.5), float(ndtr((ratio - 1) * certainty))


def neumann(residual: Rows, present: Bool[np.ndarray, "row line"]) -> tuple[float, float]:
    """Von Neumann's ratio and the inverse of its deviation, of a correct model; see `over_scatter`.

    The mean square of second differences over that of the residuals themselves is von Neumann's
    ratio (1941, doi:10.1214/aoms/1177731677): 1 for independent errors, and less the smoother a
    misfit is. Its variance is 1.889 over the number of data of equal size that would have the same
    fourth moment. NaN where that is less than 16.
    """
    if residual.shape[-1] < SECOND_DIFFERENCE.size:
        return float("nan"), float("nan")
    known = present[:, :-2] & present[:, 1:-1] & present[:, 2:]
    middle = np.where(known, residual[:, 1:-1], 0.0)
    around = (residual[:, :-2] + residual[:, 2:]) / 2
    apart = np.where(known, residual[:, 1:-1] - around, 0.0)
    squares, scatter = float(np.sum(middle**2)), float(np.sum(apart**2)) / VARIANCE
    if squares == 0 or scatter == 0:
        return float("nan"), float("nan")
    count = 3 * squares**2 / float(np.sum(middle**4))
    if count < FEWEST:
        return float("nan"), float("nan")
    return scatter / squares, float(np.sqrt(count / VARIANCE_OF_RATIO))


def relative_size(deviation: np.ndarray, measured: np.ndarray, part: int | None) -> float:
    """Median deviation of the noise over the amplitude [1].

    Where outputs are log10 of the amplitude, there is no axis of parts, and the deviation is 10 to
    its power less 1. Outputs are zero where nothing was measured.
    """
    if part is None:
        return float(10 ** np.median(deviation) - 1)
    size = np.sqrt(np.sum(np.square(measured), axis=part))
    error = np.sqrt(np.sum(np.broadcast_to(np.square(deviation), measured.shape), axis=part))
    return float(np.median(error[size > 0] / size[size > 0]))
