"""Variance of the noise of measured FRFs: stated, by coherence, or by the scatter of lines."""

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex, Float
from scipy.ndimage import median_filter

if TYPE_CHECKING:
    from .measurement import Measurement

FEWEST_LINES = 8
"""Fewest lines by whose scatter noise is estimated."""

NEIGHBOURS = 31
"""Lines over which the share of the noise is a median; a resonance covers fewer."""

Pairs = Float[np.ndarray, "sensor actuator frequency"]


def noise_variance(measurement: "Measurement") -> Pairs:
    """Variance E|error|^2 of each FRF value [unit of the FRF squared]; NaN where not measured.

    As stated, else by coherence and averages where they are known, else by the scatter of
    neighbouring lines.
    """
    variance = scatter_variance(measurement.frf)
    known = [] if measurement.variance is None else [measurement.variance]
    if measurement.coherence is not None and measurement.averages is not None:
        known.append(by_coherence(measurement))
    for better in reversed(known):
        variance = np.where(np.isfinite(better), better, variance)
    return variance


def by_coherence(measurement: "Measurement") -> Pairs:
    """Variance of an H1 estimate by its coherence and averages, which must be known."""
    coherence, averages = measurement.coherence, measurement.averages
    assert coherence is not None and averages is not None
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.abs(measurement.frf) ** 2 * (1 - coherence) / (averages * coherence))


def scatter_variance(frf: Complex[np.ndarray, "sensor actuator frequency"]) -> Pairs:
    """Variance of an error that is a share of |H|, by the scatter of lines about their neighbours.

    The share is a median over the lines nearby. The middle line less the mean of its neighbours
    has 1.5 times the variance of a line, and the median of an exponential distribution is log(2)
    times its mean. The curvature of the response adds to it, so that the error is never thought
    too small.
    """
    size = np.abs(frf) ** 2
    if frf.shape[-1] < FEWEST_LINES:
        return np.where(np.isnan(size), np.nan, 0.0)
    apart = np.abs(frf[..., 1:-1] - (frf[..., :-2] + frf[..., 2:]) / 2) ** 2
    share = apart / np.maximum(size[..., 1:-1], np.finfo(float).tiny)
    padded = np.concatenate([share[..., :1], share, share[..., -1:]], axis=-1)
    neighbours = (1, 1, min(NEIGHBOURS, padded.shape[-1]))
    ratio = median_filter(padded, neighbours, mode="nearest") / (1.5 * np.log(2))
    return np.asarray(size * ratio)
