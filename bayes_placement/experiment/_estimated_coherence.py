"""Variance of FRFs by a coherence that is an estimate itself, as in every laboratory."""

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from scipy.special import polygamma
from scipy.stats import binom, norm

from ._noise_level import FEWEST_LINES, by_coherence
from .pooled_variance import LEAST_PROBABILITY, neighbours, pooled

if TYPE_CHECKING:
    from .measurement import Measurement

CORRELATED_LINES = 1.5
"""Lines that are worth one, as a Hann window makes them."""

FEWEST_AVERAGES = 2
"""Averages below which the coherence is 1, whatever the noise."""

Pairs = Float[np.ndarray, "sensor actuator frequency"]


def pooled_by_coherence(measurement: "Measurement") -> Pairs:
    """Variance of an H1 estimate by coherence and averages, pooled where the coherence scatters.

    With n averages the residual power of a line has n - 1 degrees of freedom, so that
    |H|^2 (1 - g2) / ((n - 1) g2) has the right mean, but 1 / variance has not: chi2 of a right
    model would be (n - 1) / (n - 2) (Pintelon and Schoukens, System Identification, 2012, sample
    maximum likelihood). Neighbouring lines tell the variance well. Lines of coherence 0 or 1 tell
    none and stay as they are.
    """
    assert measurement.averages is not None
    variance, averages = by_coherence(measurement), float(measurement.averages)
    tells = averages >= FEWEST_AVERAGES and variance.shape[-1] >= FEWEST_LINES
    if not (tells and is_estimated(variance, averages)):
        return variance
    unbiased = variance * averages / (averages - 1)
    count = neighbours(averages, CORRELATED_LINES)
    result = np.array(unbiased)
    for pair in np.ndindex(*variance.shape[:2]):
        useful = _is_useful(unbiased[pair])
        if useful.sum() >= FEWEST_LINES:
            lines, amplitude = unbiased[pair][useful], np.abs(measurement.frf[pair][useful])
            result[pair][useful] = pooled(lines, np.ones(lines.size), amplitude, averages, count)
    return result


def is_estimated(variance: Pairs, averages: float) -> bool:
    """Whether variances scatter from line to line as estimates by so many averages do.

    The logarithm of an estimate has the variance trigamma(n - 1). Half of the second differences
    of independent lines exceed their median size, more of them half of it: also where windows make
    neighbours alike. A coherence that is known, or was smoothed, changes less from line to line.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        apart = np.abs(np.diff(np.log(variance), n=2))[..., ::3]  # which share no line
    apart = apart[np.isfinite(apart)]
    deviation = np.sqrt(6 * polygamma(1, averages - 1))
    many = np.sum(apart > 0.5 * norm.ppf(0.75) * deviation)
    return bool(apart.size > 0 and binom.cdf(many, apart.size, 0.5) >= LEAST_PROBABILITY)


def _is_useful(variance: Float[np.ndarray, "frequency"]) -> np.ndarray:
    return np.isfinite(variance) & (variance > 0)
