"""How much noise a model needs to explain its data, where the noise is not known.

Unknown noise takes up any misfit, so that chi2 is 1 for every model. What it may not exceed is the
scatter of neighbouring lines, which no smooth misfit adds to.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import chdtri, ndtr

from .._shared.reprs import with_short_repr
from ..experiment._noise_level import FEWEST_FITTED, FREE
from ..inference.chi2 import LEVEL
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
Present = Bool[np.ndarray, "row line"]


@with_short_repr
@dataclass(frozen=True)
class NoiseNeeded:
    """Noise that a model needs, and what it is compared with.

    `relative` is its median over the amplitude [1]; `over_scatter` the root mean square of the
    residuals over that of the scatter of neighbouring lines, NaN for too few lines, and `p_value`
    the probability that it is as large for a correct model. `over_coherence` is the fitted factor
    on what the coherence says [1], NaN where that is not read. `is_misfit_alike` says that lines
    are too far from each other to tell noise from a misfit.
    """

    relative: float
    over_scatter: float
    p_value: float
    over_coherence: float = float("nan")
    is_misfit_alike: bool = False

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


def over_scatter(
    residual: Rows, present: Present, scatter: Rows | None = None
) -> tuple[float, float]:
    """Residuals over the scatter of neighbouring lines, and the p-value of a correct model.

    NaN for too few lines, see `share_of_noise`, whose arguments these are.
    """
    ratio, certainty = share_of_noise(residual, present, scatter)
    return float(ratio**-0.5), float(ndtr((ratio - 1) * certainty))


def share_of_noise(
    residual: Rows, present: Present, scatter: Rows | None = None
) -> tuple[float, float]:
    """Share of noise in the squares of residuals, and the inverse of its deviation.

    Residuals, and the scatter of lines of the whole record where it is known, are over the
    deviation of the noise, real and imaginary parts as rows of their own. What scatters is noise,
    by von Neumann's ratio. At lines chosen far from each other any misfit scatters: where the lines
    of the record scatter significantly less than those that were chosen, they tell the noise. Each
    can only be too large, since the response itself changes from line to line.
    """
    ratio, certainty = neumann(residual, present)
    if scatter is None:
        return ratio, certainty
    share, certainty_of_share = _share_by_record(residual, present, scatter)
    apart = ndtr((share / ratio - 1) * certainty_of_share) < LEVEL
    return (share, certainty_of_share) if apart or np.isnan(ratio) else (ratio, certainty)


def _share_by_record(residual: Rows, present: Present, scatter: Rows) -> tuple[float, float]:
    """Share of noise by the scatter of lines of the whole record.

    Its variance is that of the sum of the squares of the residuals, and that of levels, each known
    as well as by one fit at least and common to the lines of one row within `FEWEST_FITTED`.
    """
    left = np.where(present, residual, 0.0) ** 2
    squares, count = float(np.sum(left)), _data_of_equal_size(left)
    if squares == 0 or count < FEWEST:
        return float("nan"), float("nan")
    levels = max(present.any(axis=1).sum(), present.sum() / FEWEST_FITTED)
    share = float(np.sum(np.where(present, scatter, 0.0) ** 2)) / squares
    return share, float((2 / count + 2 / (FREE * levels)) ** -0.5)


def _data_of_equal_size(squares: Rows) -> float:
    """Number of normal data of equal variance that would have the same fourth moment."""
    fourth = float(np.sum(squares**2))
    return 3 * float(np.sum(squares)) ** 2 / fourth if fourth > 0 else 0.0


def neumann(residual: Rows, present: Present) -> tuple[float, float]:
    """Von Neumann's ratio and the inverse of its deviation, of a correct model.

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
    count = _data_of_equal_size(middle**2)
    if count < FEWEST:
        return float("nan"), float("nan")
    return scatter / squares, float(np.sqrt(count / VARIANCE_OF_RATIO))


def over_noise(residual: Float[np.ndarray, "*datum"], present: Bool[np.ndarray, "*datum"]) -> float:
    """Root mean square of residuals over the deviation of the noise.

    The noise that is needed is so many times that of the fit, whose prior may end below it.
    """
    return float(np.sqrt(np.mean(residual[present] ** 2))) or 1.0  # data without noise


TOO_FEW = (
    "The response itself changes by more than that from one line to the next, so that so few lines "
    "cannot tell noise from a misfit: take more lines (without --lines), or state the noise."
)
"""What is said where a misfit would scatter as noise does."""


def is_misfit_alike(measured: Rows, present: Present, scatter: Rows | None) -> bool:
    """Whether a misfit would scatter as noise does, since lines are too far from each other.

    So it is where neither what was measured nor the record scatters as little as the noise that is
    needed: both are too large where the response changes from line to line. Levels are medians,
    which resonances on fewer than half of the lines leave alone; each row is known as well as by
    one fit at least.
    """
    known = present[:, :-2] & present[:, 1:-1] & present[:, 2:]
    if not known.any():
        return False
    apart = measured[:, 1:-1] - (measured[:, :-2] + measured[:, 2:]) / 2
    level = np.median(apart[known] ** 2) / VARIANCE / chdtri(1, 0.5)
    if scatter is not None:
        level = min(level, np.median(scatter[present] ** 2))
    rows = present.any(axis=1).sum()
    return bool(ndtr((1 - level) * np.sqrt(FREE * rows / 2)) < LEVEL)


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
