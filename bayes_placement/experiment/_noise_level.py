"""Variance of the noise of measured FRFs: stated, by coherence, or by the scatter of lines."""

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Complex, Float
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import convolve1d, median_filter
from scipy.special import chdtri, gammaincinv, ndtri, polygamma

from .._shared.dimensions import Spectrum

if TYPE_CHECKING:
    from .measurement import Measurement


POOLED_DEGREES = 100
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


def neighbours(averages: float, correlated_lines: float, degrees: float = POOLED_DEGREES) -> int:
    """Number of lines, odd, over which a variance is pooled to have these degrees of freedom."""
    needed = int(np.ceil(degrees * correlated_lines / (averages - 1)))
    return needed + 1 - needed % 2


def pooled(
    scatter: Spectrum, force: Spectrum, amplitude: Spectrum, averages: float, count: int
) -> Spectrum:
    """Variance by which the scatter of neighbouring lines is most likely.

    Few repeats know the variance of a line badly: the mean of 1 / variance over n repeats is
    (n - 1) / (n - 2) times too large, and so would be chi2.

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


FEWEST_LINES = 8
"""Fewest lines by whose scatter noise is estimated."""

NEIGHBOURS = 31
"""Lines over which the share of the noise is a median; a resonance covers fewer."""

DISTANCES = (1, 2, 4, 8, 16)
"""Distances in lines at which variances are compared."""

DEGREES = 25.0
"""Complex degrees of freedom of a variance: levels of noise change, and near lines know best."""

ALIKE = 0.5
"""Share of the scatter of independent lines below which lines are alike."""

FEWEST_AVERAGES = 2
"""Averages below which the coherence is 1, whatever the noise."""

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
    if averages < FEWEST_AVERAGES or variance.shape[-1] < FEWEST_LINES:
        return variance
    correlated = correlated_lines(variance, averages)
    if correlated is None:
        return variance
    unbiased = variance * averages / (averages - 1)
    inverse = DEGREES / (DEGREES - 1)  # mean of 1 / variance of an estimate of so many degrees
    count = neighbours(averages, correlated, DEGREES)
    result = np.array(unbiased)
    for pair in np.ndindex(*variance.shape[:2]):
        useful = np.isfinite(unbiased[pair]) & (unbiased[pair] > 0)
        if useful.sum() >= FEWEST_LINES:
            lines, amplitude = unbiased[pair][useful], np.abs(measurement.frf[pair][useful])
            result[pair][useful] = inverse * pooled(
                lines, np.ones(lines.size), amplitude, averages, count
            )
    return result


def correlated_lines(variance: Pairs, averages: float) -> float | None:
    """Lines that count as one where variances are estimates of so many averages; else None.

    The logarithm of an estimate has the variance trigamma(n - 1), and so a known scatter of its
    second differences, from the distance on at which lines are independent: windows and padded
    records make neighbours alike. There, twice the distance changes the scatter by less than 2,
    while it multiplies that of a variance that is known, or was smoothed, by 4.
    """
    expected = ndtri(0.75) * np.sqrt(6 * polygamma(1, averages - 1))
    for distance in DISTANCES:
        near, far = (_scatter(variance, lines) / expected for lines in (distance, 2 * distance))
        if near >= ALIKE:
            return 2.0 * distance if far < 2 * near else None
    return None


def _scatter(variance: Pairs, distance: int) -> float:
    """Median size of the second differences of the logarithm; NaN where lines are too few."""
    with np.errstate(divide="ignore", invalid="ignore"):
        level = np.log(variance)
        middle = level[..., distance:-distance]
        apart = np.abs(level[..., : -2 * distance] - 2 * middle + level[..., 2 * distance :])
    apart = apart[np.isfinite(apart)]
    return float(np.median(apart)) if apart.size else float("nan")


HALF, NUMERATOR = 4, 2
"""Lines to either side of the middle one of a fit, and order of its numerator."""

FREE = 2 * HALF + 1 - (NUMERATOR + 1) - 1
"""Complex degrees of freedom that a fit leaves to the noise."""

WINDOWS = 15
"""Fits over which the level is a median; a resonance covers fewer of a record that resolves it."""

FEWEST_FITTED = WINDOWS + 2 * HALF
"""Fewest lines by which the level is known."""

ROUNDING = 1e-24
"""Share of the square of the greatest amplitude of a fit that is rounding."""

UNEVEN = 0.01
"""Greatest difference of the distances of lines over their mean: files round frequencies."""

POWERS = (0.0, 1.0, 2.0)
"""Powers of the amplitude with which a variance may go: noise of the response, and of the force."""

MOST_ALIKE, FITS_ALIKE = 8, 0.5
"""Distances up to which lines are compared, and the share of the scatter of independent lines."""

Lines = Float[np.ndarray, "frequency"]


def scatter_of(
    measurement: "Measurement",
) -> Float[np.ndarray, "sensor actuator frequency"] | None:
    """Variance of each FRF value; None where lines are too few, or unevenly spaced."""
    apart = np.diff(measurement.frequency)
    if apart.size + 1 < FEWEST_FITTED or np.ptp(apart) > UNEVEN * apart.mean():
        return None
    variance = np.full(measurement.frf.shape, np.nan)
    for pair in np.argwhere(measurement.measured):
        variance[tuple(pair)] = variance_by_fits(measurement.frf[tuple(pair)])
    return variance


def variance_by_fits(frf: Complex[np.ndarray, "frequency"]) -> Lines:
    """Variance E|error|^2 of each line [unit of the FRF squared].

    Nine neighbouring lines are fitted by a quotient of polynomials, which leaves little of a
    resonance (the local rational method: McKelvey and Guerin, 2012,
    doi:10.3182/20120711-3-BE-2027.00356). The level is a median over neighbouring fits, after a
    power of the amplitude was taken out: that which makes it the smoothest. Where windows make
    neighbouring lines alike, lines farther apart are fitted. A resonance of few lines makes the
    variance too large, never too small. Lines are evenly spaced, at least `FEWEST_FITTED`, and
    those of a record that is not thinned.
    """
    residual, step = _residual(frf, 1), 1
    while 2 * step <= MOST_ALIKE and len(frf) >= FEWEST_FITTED * 2 * step:
        farther = _residual(frf, 2 * step)
        if np.median(residual) > FITS_ALIKE * np.median(farther):
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
