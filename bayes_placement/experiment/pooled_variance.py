"""Variance of the lines of an FRF, pooled over neighbouring lines.

Few repeats know the variance of a line badly: the mean of 1 / variance over n repeats is
(n - 1) / (n - 2) times too large, and so would be chi2.
"""

import numpy as np
from scipy.ndimage import convolve1d
from scipy.special import chdtri

from .._shared.dimensions import Spectrum

DEGREES = 100
"""Complex degrees of freedom by which a variance is known to 10 %, and chi2 is 1 % too large."""

LEAST_PROBABILITY = 1e-3
"""Probability below which the scatter of a line is its own, such as that of mains hum."""

LEAST_SHARE = 1e-3
"""Share of the level around it that the level of a line has at least."""

SINGULAR = 1e-6
"""Share below which a determinant is rounding."""

ITERATIONS = 30

CONVERGED = 1e-3
"""Change of the level, of itself, at which the iteration ends."""


def neighbours(averages: float, correlated_lines: float, degrees: float = DEGREES) -> int:
    """Number of lines, odd, over which a variance is pooled to have these degrees of freedom."""
    needed = int(np.ceil(degrees * correlated_lines / (averages - 1)))
    return needed + 1 - needed % 2


def pooled(
    scatter: Spectrum, force: Spectrum, amplitude: Spectrum, averages: float, count: int
) -> Spectrum:
    """Variance by which the scatter of neighbouring lines is most likely.

    Noise of the response adds Snn / Gxx to the variance, noise of the force |H|^2 Smm / Gxx, in
    which the noise spectra Snn and Smm change little from line to line. They are estimated at each
    line from its neighbours by the likelihood of variances (gamma distributions), in iterated
    weighted least squares. A line that scatters more than that keeps its own variance. The force is
    Gxx, in any unit, the amplitude |H|; averages are independent repeats. Of one neighbouring line
    it is the scatter itself.
    """
    if count <= 1:
        return scatter
    residual = scatter * force
    unit = float(np.mean(residual))
    if unit == 0:
        return scatter
    shape = amplitude**2 / np.mean(amplitude**2)
    level = _levels(residual / unit, shape, _most(averages), min(count, scatter.size))
    outlying = residual / unit > level * _most(averages)
    return np.where(outlying, scatter, level * unit / force)


def _most(averages: float) -> float:
    """Ratio to its mean that a variance exceeds with the least probability."""
    degrees = 2 * (averages - 1)
    return float(chdtri(degrees, LEAST_PROBABILITY) / degrees)


def _levels(values: Spectrum, shape: Spectrum, most: float, count: int) -> Spectrum:
    """Level a + b shape of each line, a and b not negative and common to its neighbours."""

    def near(terms: Spectrum) -> Spectrum:
        # Direct sums: a running one loses small weights next to large ones.
        return np.asarray(convolve1d(terms, np.full(count, 1 / count), mode="nearest"))

    level = near(values)
    for _ in range(ITERATIONS):
        # Between resonances the noise of the force alone would give next to nothing.
        around, previous = near(level), level
        level = np.maximum(level, LEAST_SHARE * around)
        weight = np.where(values > most * np.maximum(level, around), 0.0, 1 / level**2)
        plain, crossed, square = (near(weight * shape**power) for power in range(3))
        constant, linear = near(weight * values), near(weight * values * shape)
        determinant = plain * square - crossed**2
        apart = determinant > SINGULAR * plain * square  # else all lines are of one amplitude
        flat = _ratio(square * constant - crossed * linear, determinant)
        slope = _ratio(plain * linear - crossed * constant, determinant)
        level = np.where(apart & (slope > 0), flat + slope * shape, _ratio(constant, plain))
        level = np.where(apart & (flat < 0), _ratio(linear, square) * shape, level)
        level = np.where(plain > 0, level, near(values))  # every line around differs from others
        if np.allclose(level, previous, rtol=CONVERGED, atol=0.0):
            break
    return np.maximum(level, LEAST_SHARE * near(level))


def _ratio(numerator: Spectrum, denominator: Spectrum) -> Spectrum:
    """Quotient; 0 where no line of a neighbourhood has a weight."""
    return np.divide(numerator, denominator, out=np.zeros_like(numerator), where=denominator > 0)
