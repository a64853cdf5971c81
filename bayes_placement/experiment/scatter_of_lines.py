"""Variance of the noise of FRFs by the scatter of neighbouring lines, without a model."""

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex, Float
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import median_filter
from scipy.special import gammaincinv

if TYPE_CHECKING:
    from .measurement import Measurement

HALF, NUMERATOR = 4, 2
"""Lines to either side of the middle one of a fit, and order of its numerator."""

FREE = 2 * HALF + 1 - (NUMERATOR + 1) - 1
"""Complex degrees of freedom that a fit leaves to the noise."""

WINDOWS = 15
"""Fits over which the level is a median; a resonance covers fewer of a record that resolves it."""

FEWEST = WINDOWS + 2 * HALF
"""Fewest lines by which the level is known."""

ROUNDING = 1e-24
"""Share of the square of the greatest amplitude of a fit that is rounding."""

UNEVEN = 0.01
"""Greatest difference of the distances of lines over their mean: files round frequencies."""

POWERS = (0.0, 1.0, 2.0)
"""Powers of the amplitude with which a variance may go: noise of the response, and of the force."""

MOST_ALIKE, ALIKE = 8, 0.5
"""Distances up to which lines are compared, and the share of the scatter of independent lines."""

Lines = Float[np.ndarray, "frequency"]


def scatter_of(
    measurement: "Measurement",
) -> Float[np.ndarray, "sensor actuator frequency"] | None:
    """Variance of each FRF value; None where lines are too few, or unevenly spaced."""
    apart = np.diff(measurement.frequency)
    if apart.size + 1 < FEWEST or np.ptp(apart) > UNEVEN * apart.mean():
        return None
    variance = np.full(measurement.frf.shape, np.nan)
    for pair in np.argwhere(measurement.measured):
        variance[tuple(pair)] = scatter_variance(measurement.frf[tuple(pair)])
    return variance


def scatter_variance(frf: Complex[np.ndarray, "frequency"]) -> Lines:
    """Variance E|error|^2 of each line [unit of the FRF squared].

    Nine neighbouring lines are fitted by a quotient of polynomials, which leaves little of a
    resonance (the local rational method: McKelvey and Guerin, 2012,
    doi:10.3182/20120711-3-BE-2027.00356). The level is a median over neighbouring fits, after a
    power of the amplitude was taken out: that which makes it the smoothest. Where windows make
    neighbouring lines alike, lines farther apart are fitted. A resonance of few lines makes the
    variance too large, never too small. Lines are evenly spaced, at least `FEWEST`, and those of a
    record that is not thinned.
    """
    residual, step = _residual(frf, 1), 1
    while 2 * step <= MOST_ALIKE and len(frf) >= FEWEST * 2 * step:
        farther = _residual(frf, 2 * step)
        if np.median(residual) > ALIKE * np.median(farther):
            break
        residual, step = farther, 2 * step
    levels = [_smooth_level(residual, np.abs(frf) ** power) for power in POWERS]
    return min(levels, key=lambda level: _roughness(residual, level))


def _residual(frf: Complex[np.ndarray, "frequency"], step: int) -> Lines:
    """Variance by the fit about each line; at both ends that of the nearest whole fit."""
    windows = sliding_window_view(frf, 2 * HALF * step + 1)[:, ::step]
    size = np.max(np.abs(windows), axis=-1, keepdims=True)
    scaled = windows / np.where(size > 0, size, 1.0)
    place = np.linspace(-1.0, 1.0, 2 * HALF + 1)
    numerator = np.broadcast_to(
        place[:, None] ** np.arange(NUMERATOR + 1), (*scaled.shape, NUMERATOR + 1)
    )
    terms = np.concatenate([numerator, -(place * scaled)[..., None]], axis=-1)
    span = np.linalg.qr(terms).Q
    explained = span @ (span.conj().swapaxes(-1, -2) @ scaled[..., None])
    left = np.sum(np.abs(scaled - explained[..., 0]) ** 2, axis=-1) / FREE
    left = np.where(left > ROUNDING, left, 0.0)
    return np.pad(left * size[:, 0] ** 2, HALF * step, mode="edge")


def _smooth_level(residual: Lines, size: Lines) -> Lines:
    """Level whose share of a size is a median over neighbouring fits."""
    share = residual / np.maximum(size, np.finfo(float).tiny)
    median_of_one = gammaincinv(FREE, 0.5) / FREE
    # 1 / variance is too large on the average, but less where the own error of a line is large:
    # the two cancel within 4 %.
    level = median_filter(share, WINDOWS, mode="nearest") / median_of_one
    return np.asarray(level * size)


def _roughness(residual: Lines, level: Lines) -> float:
    """Mean distance of the logarithms of what fits leave and of a level."""
    known = (residual > 0) & (level > 0)
    return float(np.mean(np.abs(np.log(residual[known] / level[known])))) if known.any() else 0.0
