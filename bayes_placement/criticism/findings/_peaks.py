"""Natural frequencies and damping ratios that the peaks of measured and computed FRFs show."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.special import ndtri

FALSE_ALARM = 0.01
"""Probability that noise alone makes a peak anywhere."""

Curve = Float[np.ndarray, "line"]


class Peaks(NamedTuple):
    """Natural frequencies [Hz] and damping ratios [1] at peaks of the summed squares of FRFs.

    Damping is NaN where the lines around a peak do not show it.
    """

    frequency: Float[np.ndarray, "peak"]
    damping: Float[np.ndarray, "peak"]


def peaks_of_fits(fits: Mapping[str, xr.Dataset]) -> xr.Dataset | None:
    """Return the peaks of measured FRFs and those of each model that are nearest to them.

    Both are read in the same way, so that the errors of the reading cancel to a large part.

    Fits are those of `fit`, by the name of a model. The result has `natural_frequency` [Hz] and
    `damping_ratio` [1] of each measured `peak`, and by `model` the same with `_of_model`, NaN where
    it has none of its own there. None without complex FRFs or without a peak.
    """
    first = next(iter(fits.values()))
    if "measured_phase" not in first or first.sizes["frequency"] < 3:
        return None
    lines = first["frequency"].values
    measured = _peaks(lines, _sum(first, "measured"), _noise(first))
    if not measured.frequency.size:
        return None
    models = [
        _paired(measured, _peaks(lines, _sum(fit, "predicted"), _noise(first)))
        for fit in fits.values()
    ]
    variables = {
        "natural_frequency": ("peak", measured.frequency, {"units": "Hz"}),
        "damping_ratio": ("peak", measured.damping, {"units": "1"}),
        "natural_frequency_of_model": (("model", "peak"), [model.frequency for model in models]),
        "damping_ratio_of_model": (("model", "peak"), [model.damping for model in models]),
    }
    return xr.Dataset(variables, coords={"model": list(fits)})


def _sum(fit: xr.Dataset, word: str) -> Curve:
    """Sum of the squares of FRFs over all measured channel pairs."""
    squares = 10.0 ** (2 * fit[word].where(np.isfinite(fit["measured"])))
    return np.asarray(squares.sum([name for name in squares.dims if name != "frequency"]))


def _noise(fit: xr.Dataset) -> Curve:
    """Standard deviation of that sum, to first order: noise counts by its part along the FRF."""
    squares = 4 * 10.0 ** (2 * fit["measured"]) * fit["noise"] ** 2 / 2
    return np.sqrt(np.asarray(squares.sum([name for name in squares.dims if name != "frequency"])))


def _peaks(lines: Curve, squares: Curve, noise: Curve) -> Peaks:
    """Peaks that stand out of the noise; each is the least of a parabola through 1 / squares.

    Near a natural frequency w, 1 / |H|^2 is to first order a ((w' - w)^2 + (damping w)^2).
    """
    from scipy.signal import find_peaks  # it takes long to import

    least = -ndtri(FALSE_ALARM / lines.size) * noise
    numbers, _ = find_peaks(squares, prominence=least)
    found = [_parabola(lines[n - 1 : n + 2], 1 / squares[n - 1 : n + 2]) for n in numbers]
    frequency, damping = np.array(found).reshape(-1, 2).T
    return Peaks(frequency, damping)


def _parabola(lines: Curve, inverse: Curve) -> tuple[float, float]:
    """Natural frequency and damping ratio from three lines around a peak."""
    bend, slope, level = np.polyfit(lines - lines[1], inverse / inverse[1], 2)
    shift = -slope / (2 * bend)
    least = level - bend * shift**2
    frequency = float(lines[1] + shift)
    return frequency, float(np.sqrt(least / bend) / frequency) if least > 0 else np.nan


def _paired(measured: Peaks, model: Peaks) -> Peaks:
    """Peaks of a model in the order of the measured ones: those that are nearest to each other."""
    empty = np.full(measured.frequency.size, np.nan)
    if not model.frequency.size:
        return Peaks(empty, empty)
    distance = np.abs(measured.frequency[:, None] - model.frequency)
    nearest = distance.argmin(axis=1)
    is_pair = distance.argmin(axis=0)[nearest] == np.arange(nearest.size)
    frequency, damping = (np.where(is_pair, values[nearest], np.nan) for values in model)
    return Peaks(frequency, damping)
