"""Measured and predicted outputs with the noise and the size of the model error."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float

from ..._shared.compiled import compiled
from ..._shared.dimensions import Response
from ..._shared.sites import Role
from ...experiment.experiment import Experiment, Measurements
from ..fitted import OutputsAtValues, compared, outputs_at
from ..values import with_arrays
from ._unknowns import SIZE

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
