"""Stated noise: neighbouring lines that scatter by far more than coherence and averages say."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Complex, Float

from .._noise_level import FEWEST_LINES
from ..measurement import Measurement
from .record import Fault, Record, Response, prior_responses

ALLOWED = np.sqrt(2)
"""Factor that a count of averages explains: overlapping blocks tell half as much as separate ones.

Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70.
"""

DEVIATIONS, WITH_95_PERCENT = 4.0, 1.96

_ORDER = np.array([1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0])
"""Sixth difference, which leaves little of a resonance that lines resolve, and all of the noise."""

_LINES_OF_ONE = 3.2
"""Differences that tell as much as one: 1 plus twice the squares of their correlations."""


def can_check(record: Record) -> bool:
    """Tell whether noise is stated, at lines enough."""
    measurement = record.measurement
    by_coherence = measurement.coherence is not None and measurement.averages is not None
    is_stated = measurement.variance is not None or by_coherence
    enough = record.frequency.size >= FEWEST_LINES + _ORDER.size
    return is_stated and enough and bool(np.any(record.noise_variance > 0))


def check(record: Record) -> Iterator[Fault]:
    """Find noise that is understated, by a factor whose interval of four deviations is above 1.4.

    The sixth difference of white noise has 924 times its variance, and the square of a circular
    error has log(2) of its mean for a median. What the model leaves at draws from its priors is
    curvature. Windows make neighbouring lines alike, so that nothing is said of overstated noise.
    """
    ratio = _ratio(record, record.frf[..., record.moving])
    _, draws = prior_responses(record, record.frequency[record.moving])
    curvature = max(_square(_ratio(record, draw)) for draw in draws)
    factor = np.sqrt(max(_square(ratio) - curvature, 0.0))
    # Of the median of so many exponential distributions, and half for a root.
    deviation = np.sqrt(_LINES_OF_ONE / np.isfinite(ratio).sum()) / (2 * np.log(2))
    if factor * np.exp(-DEVIATIONS * deviation) > ALLOWED:
        low, high = factor * np.exp(WITH_95_PERCENT * deviation * np.array([-1, 1]))
        yield record.fault(
            next(record.pairs),
            float(factor),
            float(ALLOWED * np.exp(DEVIATIONS * deviation)),
            f"The noise looks understated by a factor of {factor:.2g} ({low:.2g} to {high:.2g} "
            f"with 95 % probability): neighbouring lines scatter so much more than "
            f"{_remedy(record.measurement, factor)}, or take noise.Gaussian with an unknown level.",
        )


def _ratio(record: Record, frf: Response) -> Float[np.ndarray, "sensor actuator difference"]:
    """Square of the differences over that of the stated noise, which is a share of each FRF."""
    lines = record.moving
    size = np.abs(frf) / np.where(record.frf == 0, np.nan, np.abs(record.frf))[..., lines]
    expected = _filtered(record.noise_variance[..., lines] * size**2, _ORDER**2)
    return np.abs(_filtered(frf, _ORDER)) ** 2 / np.where(expected > 0, expected, np.nan)


def _filtered(
    values: Complex[np.ndarray, "*pair frequency"] | Float[np.ndarray, "*pair frequency"],
    weights: Float[np.ndarray, "weight"],
) -> np.ndarray:
    windows = np.lib.stride_tricks.sliding_window_view(values, weights.size, axis=-1)
    return np.asarray(windows @ weights)


def _square(ratio: Float[np.ndarray, "sensor actuator difference"]) -> float:
    """Mean square by the median, which lines near a resonance change little."""
    return float(np.nanmedian(ratio) / np.log(2))


def _remedy(measurement: Measurement, factor: float) -> str:
    if measurement.variance is not None:
        return f"its variance says; give {factor**2:.2g} times the variance"
    averages = float(measurement.averages or 1)
    return (
        f"coherence and {averages:g} averages say; look at the number of averages, of which "
        f"{max(averages / factor**2, 1):.2g} would fit"
    )
