"""Outputs with noise and model error, and natural frequencies that peaks of their FRFs show."""

from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float
from scipy.special import ndtri

from ..._shared.compiled import compiled
from ..._shared.dimensions import Response
from ..._shared.sites import Role
from ...experiment.experiment import Experiment, Measurements
from ..fitted import OutputsAtValues, compared, outputs_at, with_arrays
from ._set_up import SIZE

ERROR_DRAWS = 48
"""Draws of the model error of which the root mean square is taken."""


def fit(
    experiment: Experiment, measurement: Measurements, values: Mapping[str, float]
) -> xr.Dataset:
    """Return what `fitted` returns, with phases and the size of the model error.

    Complex outputs have `measured_phase` and `predicted_phase` [deg] and, by channel pair, `frac`,
    the frequency response assurance criterion. `model_error` is the root mean square over draws of
    what the response differs by with its errors, zero where the model is exact.
    """
    at_values = outputs_at(experiment, measurement, values)
    dataset = compared(experiment, at_values)
    part = -2 if experiment.observe.parts > 1 else None
    error = _model_error(experiment, values)
    size = dataset["error"]
    if error is None:
        dataset["model_error"] = xr.zeros_like(size)
    else:
        square = error**2 if part is None else (error**2).sum(axis=part)
        dataset["model_error"] = size.copy(data=np.sqrt(square))
    if part is not None:
        for name in ("measured", "predicted"):
            outputs = getattr(at_values, name)
            phase = np.where(np.isfinite(dataset["measured"]), _phase(outputs), np.nan)
            dataset[f"{name}_phase"] = (size.dims, phase, {"units": "deg"})
        dataset["frac"] = (size.dims[:-1], _frac(at_values))
    return dataset


def _frac(at_values: OutputsAtValues) -> np.ndarray:
    """Frequency response assurance criterion, over the lines; NaN where nothing was measured.

    Heylen & Lammens, FRAC: a consistent way of comparing frequency response functions (1996).
    """
    present = at_values.present.all(axis=-2)
    parts = (at_values.measured, at_values.predicted)
    measured, model = (np.where(present, of[..., 0, :] + 1j * of[..., 1, :], 0) for of in parts)
    product = np.abs((measured.conj() * model).sum(axis=-1)) ** 2
    squares = (np.abs(measured) ** 2).sum(axis=-1) * (np.abs(model) ** 2).sum(axis=-1)
    return np.divide(product, squares, out=np.full(squares.shape, np.nan), where=squares > 0)


def _phase(outputs: np.ndarray) -> np.ndarray:
    """Phase [deg] of outputs whose last axis but one is their real and imaginary part."""
    real, imaginary = np.moveaxis(outputs, -2, 0)
    return np.degrees(np.arctan2(imaginary, real))


def _model_error(experiment: Experiment, values: Mapping[str, float]) -> np.ndarray | None:
    """Root mean square of what errors of the model change in each output; None without any."""
    arrays = with_arrays(experiment, values)
    errors = {
        unknown.name: unknown.distribution
        for unknown in experiment.unknowns
        if unknown.role is Role.MODEL_ERROR and unknown.field != SIZE
    }
    if not errors:
        return None
    keys = jax.random.split(jax.random.key(1), len(errors))
    draws = {
        name: prior.sample(key, (ERROR_DRAWS,))
        for (name, prior), key in zip(errors.items(), keys, strict=True)
    }
    parameters = {name: value for name, value in arrays.items() if name not in errors}
    return np.asarray(compiled(_spread)(experiment.fix(parameters), draws))


def _spread(experiment: Experiment, draws: dict[str, Array]) -> Response:
    exact = {name: jnp.zeros(values.shape[1:]) for name, values in draws.items()}
    middle = experiment.fix(exact).predict()

    def square(drawn: dict[str, Array]) -> Float[Array, "..."]:
        return (experiment.fix(drawn).predict() - middle) ** 2

    return jnp.sqrt(jnp.mean(jax.lax.map(square, draws), axis=0))


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
