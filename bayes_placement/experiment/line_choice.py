"""Which lines of measured FRFs to use: those around resonances, or those that carry most."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from .._shared.arguments import check_kind, shown
from .._shared.dimensions import Spectrum
from .._shared.errors import InputError
from ._noise_level import noise_variance, scatter_variance
from .quantities import converted

if TYPE_CHECKING:
    from .measurement import Measurement

HALF_POWER = 0.5
PROMINENCE = 2.0
"""Least ratio of a peak of the mode indicator to the nearest valleys (3 dB)."""

SLIGHT = 0.1
"""Prominence, of the log, that the peak of mobility has in the accelerance at least."""

DEVIATIONS = 6.0
"""Deviations of the indicator's noise by which a peak must also stand out."""

EVEN_SHARE = 0.3
"""Share of thinned lines that are spread evenly, so that no stretch is left without any."""


def mode_indicator(runs: Sequence["Measurement"], quantity: str = "mobility") -> Spectrum:
    """Sum of the squared FRFs of all pairs, each over its mean; 1 on the average.

    They are summed as `receptance`, `mobility` or `accelerance`.
    """
    squares = np.concatenate([_squares(run, quantity) for run in runs])
    return np.asarray(np.mean(squares / squares.mean(axis=-1, keepdims=True), axis=0))


def around_resonances(
    runs: Sequence["Measurement"], *, lines_per_bandwidth: float | int, bandwidths: float | int
) -> Int[np.ndarray, "chosen"]:
    """Numbers of the lines around the peaks of the mode indicator. See `Measurement`."""
    _check_positive("around_resonances", "lines_per_bandwidth", lines_per_bandwidth)
    _check_positive("around_resonances", "bandwidths", bandwidths)
    frequency = _common_lines(runs)
    indicator = mode_indicator(runs)
    peaks = resonances(runs)
    if not peaks.size:
        raise InputError(
            f"around_resonances() was asked of {frequency.size} lines from {frequency[0]:g} to "
            f"{frequency[-1]:g} Hz, where no peak of the FRFs stands out of their noise; at least "
            "one is needed, to take lines around it. Take lines by what they carry: "
            "measurement.thinned(200)."
        )
    chosen = [
        _band(frequency, indicator, int(peak), lines_per_bandwidth, bandwidths) for peak in peaks
    ]
    return np.unique(np.concatenate(chosen))


def resonances(runs: Sequence["Measurement"]) -> Int[np.ndarray, "peak"]:
    """Numbers of the lines at peaks of the mode indicator that stand out of the noise.

    A resonance is a peak of mobility and of accelerance; the drift of an amplifier towards 0 Hz is
    one of mobility only.
    """
    frequency, indicator = runs[0].frequency, mode_indicator(runs)
    prominence = np.maximum(np.log(PROMINENCE), DEVIATIONS * _indicator_deviation(runs))
    peaks = _peaks(indicator, prominence)
    accelerance_peaks = _peaks(
        mode_indicator(runs, "accelerance"), np.full_like(prominence, SLIGHT)
    )
    widths = np.array([half_power_bandwidth(frequency, indicator, int(peak)) for peak in peaks])
    apart = np.abs(frequency[peaks][:, None] - frequency[accelerance_peaks][None])
    return np.asarray(peaks[(apart <= np.reshape(widths, (-1, 1))).any(axis=1)])


def peaks_at_ends(run: "Measurement") -> Int[np.ndarray, "peak"]:
    """Numbers of the lines at peaks that would stand out if FRFs vanished beyond the lines."""
    prominence = np.maximum(np.log(PROMINENCE), DEVIATIONS * _indicator_deviation([run]))
    found = _peaks(np.pad(mode_indicator([run]), 1), np.pad(prominence, 1)) - 1
    inner = found[(found > 0) & (found < run.frequency.size - 1)]
    return np.setdiff1d(inner, resonances([run]))


def _peaks(indicator: Spectrum, prominence: Spectrum) -> Int[np.ndarray, "peak"]:
    """Peaks of an indicator whose log stands out by its prominence above the nearest valley."""
    from scipy.signal import find_peaks  # it takes long to import

    level = np.log(np.maximum(indicator, np.finfo(float).tiny))
    peaks, properties = find_peaks(level, prominence=0.0)
    return np.asarray(peaks[properties["prominences"] > prominence[peaks]])


def half_power_bandwidth(frequency: Spectrum, indicator: Spectrum, peak: int) -> float:
    """Width of a peak [Hz] where the indicator is half of it; the spacing of the lines at least."""
    low = _crossing(frequency, indicator, peak, -1)
    high = _crossing(frequency, indicator, peak, 1)
    sides = [abs(side - frequency[peak]) for side in (low, high) if side is not None]
    spacing = float(np.min(np.diff(frequency[max(0, peak - 1) : peak + 2])))
    return max(2 * min(sides, default=spacing), spacing)


def thinned(runs: Sequence["Measurement"], most: int) -> Int[np.ndarray, "chosen"]:
    """Numbers of at most `most` lines, dense where the FRFs change most. See `Measurement`."""
    _check_positive("thinned", "most", most)
    frequency = _common_lines(runs)
    if frequency.size <= most:
        return np.arange(frequency.size)
    share = _inclusion(_density(runs), int(most))
    return np.flatnonzero(np.diff(np.floor(np.cumsum(share) + 0.5), prepend=0.0) > 0)


def _density(runs: Sequence["Measurement"]) -> Spectrum:
    """Length of the curve of all FRFs at each line, in deviations of the noise, and an even share.

    A parameter that moves the response shows where the response changes; a stretch of the curve
    twice as long in units of the noise deserves twice the lines.
    """
    length = np.sqrt(sum(_squared_steps(run) for run in runs))
    even = np.full(length.size, 1 / length.size)
    total = float(length.sum())
    return even if total == 0 else EVEN_SHARE * even + (1 - EVEN_SHARE) * length / total


def _squared_steps(run: "Measurement") -> Spectrum:
    """Square of the change of all FRFs along a line, over the variance of their noise."""
    frf, variance = run.frf[run.measured], noise_variance(run)[run.measured]
    step = np.abs(np.diff(frf, axis=-1)) ** 2
    noise = (variance[:, 1:] + variance[:, :-1]) / 2
    floor = np.finfo(float).tiny + 1e-12 * np.mean(np.abs(frf) ** 2, axis=-1, keepdims=True)
    between = np.sum(step / np.maximum(noise, floor), axis=0)
    padded = np.concatenate([between[:1], between, between[-1:]])
    return np.asarray((padded[1:] + padded[:-1]) / 2)


def _inclusion(density: Spectrum, most: int) -> Spectrum:
    """Probabilities proportional to a density, at most 1, of the sum `most`."""
    share = np.zeros_like(density)
    full = np.zeros(density.size, bool)
    while True:
        share = np.where(full, 1.0, (most - full.sum()) * density / density[~full].sum())
        above = (share >= 1) & ~full
        if not above.any():
            return share
        full |= above


def _band(
    frequency: Spectrum,
    indicator: Spectrum,
    peak: int,
    per_bandwidth: float | int,
    bandwidths: float | int,
) -> Int[np.ndarray, "chosen"]:
    """Numbers of the lines around a peak, about `per_bandwidth` in each half-power bandwidth."""
    width = half_power_bandwidth(frequency, indicator, peak)
    steps = int(np.ceil(bandwidths * per_bandwidth))
    wanted = frequency[peak] + np.arange(-steps, steps + 1) / per_bandwidth * width
    wanted = wanted[(wanted >= frequency[0]) & (wanted <= frequency[-1])]
    nearest = np.rint(np.interp(wanted, frequency, np.arange(frequency.size))).astype(int)
    return np.unique(np.append(nearest, peak))


def _crossing(frequency: Spectrum, indicator: Spectrum, peak: int, step: int) -> float | None:
    """Frequency [Hz] at which the indicator falls to half of a peak; None if it does not."""
    half = HALF_POWER * indicator[peak]
    line = peak
    while 0 <= line + step < frequency.size:
        line += step
        if indicator[line] <= half:
            ends = [line, line - step]
            return float(np.interp(half, indicator[ends], frequency[ends]))
    return None


def _squares(run: "Measurement", quantity: str) -> Float[np.ndarray, "pair frequency"]:
    """Squared FRFs of the pairs that were measured; zero at 0 Hz."""
    moving = run.frequency > 0
    frf = converted(run.frf[run.measured][:, moving], run.frequency[moving], run.quantity, quantity)
    squares = np.zeros((len(frf), run.frequency.size))
    squares[:, moving] = np.abs(frf) ** 2
    return squares


def _indicator_deviation(runs: Sequence["Measurement"]) -> Spectrum:
    """Standard deviation of the log of the mode indicator by the noise of the FRFs."""
    squares = np.concatenate([_squares(run, "mobility") for run in runs])
    share = np.concatenate([_noise_share(run) for run in runs])
    weight = squares / squares.mean(axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        deviation = np.sqrt(np.sum(2 * share * weight**2, axis=0)) / np.sum(weight, axis=0)
    return np.nan_to_num(deviation)


def _noise_share(run: "Measurement") -> Float[np.ndarray, "pair frequency"]:
    """Variance of the noise over |H|^2 [1]: as stated, and not below the scatter of the lines."""
    frf = run.frf[run.measured]
    variance = np.maximum(noise_variance(run), scatter_variance(run.frf))[run.measured]
    return variance / np.maximum(np.abs(frf) ** 2, np.finfo(float).tiny)


def runs(run: "Measurement", together: "Sequence[Measurement] | None") -> tuple["Measurement", ...]:
    """Return a measurement and those at other force levels."""
    needed = "a list of measurements is needed, since there may be many"
    check_kind("together", together, (Sequence, type(None)), needed, "together=runs[1:]")
    return (run, *(together or ()))


def _common_lines(runs: Sequence["Measurement"]) -> Spectrum:
    for run in runs[1:]:
        if not isinstance(run, type(runs[0])):
            raise InputError(
                f"together holds {shown(run)}; measurements on the same lines are needed, since "
                "their resonances count as well: together=[run for other force levels]."
            )
    first = runs[0].frequency
    for run in runs[1:]:
        if not np.array_equal(run.frequency, first):
            raise InputError(
                f"Measurements of {first.size} and of {run.frequency.size} lines were given "
                "together; the same lines are needed, since all force levels are compared line by "
                "line. Take common ones first: run.lines(frequency)."
            )
    return first


def _check_positive(function: str, argument: str, value: float | int) -> None:
    if not (np.asarray(value).dtype.kind in "iuf" and np.isfinite(value) and value > 0):
        raise InputError(
            f"measurement.{function} was given {argument}={value!r}; a number above 0 is needed, "
            f"since it says how many lines are taken: {function}({argument}=4)."
        )
