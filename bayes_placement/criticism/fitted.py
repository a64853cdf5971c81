"""Prediction of a model with values of its unknowns, with the measurement."""

from collections.abc import Mapping
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Float

from .._shared.compiled import compiled
from .._shared.dimensions import Response
from .._shared.labels import FORCE_LEVEL
from ..experiment.experiment import Experiment, Measurements
from ..experiment.noise import Data
from ..inference.bands import amplitude
from ..inference.engines.levenberg_marquardt import LARGEST
from ..inference.estimates import Number, from_scalars, scalars
from ..inference.residuals import Problem
from ..inference.results import outputs


def with_arrays(experiment: Experiment, values: Mapping[str, float]) -> dict[str, Number]:
    """Values of the unknowns by name, the elements of an array put together.

    Elements of an array are given one by one (`structure.damping.ratio[0]`).
    """
    shapes = {unknown.name: unknown.distribution.shape() for unknown in experiment.unknowns}
    return from_scalars(shapes, values)


def in_scalars(values: Mapping[str, object]) -> dict[str, float]:
    """Values by name, the elements of an array one by one; what `with_arrays` puts together."""
    return {
        word: float(value[0, 0])
        for name, known in values.items()
        for word, value in scalars(name, np.asarray(known)[None, None])
    }


def point_of(problem: Problem, values: Mapping[str, float]) -> Float[np.ndarray, "unknown"]:
    """Coordinates of values of the unknowns; at an edge of a prior a little inside.

    Sizes of model errors are known; elements of arrays are given one by one.
    """
    named = with_arrays(problem.at_fixed_sizes, values)
    vector = np.asarray(problem.coordinates.vector(named), dtype=float)
    return np.clip(np.nan_to_num(vector), -LARGEST, LARGEST)


def prediction(concrete: Experiment, data: Data) -> tuple[Response, Response]:
    """Predicted outputs and the variance of the noise of each, of a model without unknowns."""
    assert concrete.noise is not None
    predicted = concrete.predict()
    error = concrete.noise.distribution(predicted, data)
    return predicted, jnp.broadcast_to(error.variance, predicted.shape)


def fitted(
    experiment: Experiment, measurement: Measurements, values: Mapping[str, float]
) -> xr.Dataset:
    """Return measured and predicted outputs, the error between them, and the expected noise.

    Parameters
    ----------
    experiment
        The experiment, with a noise.
    measurement
        What was measured.
    values
        Value of every unknown, elements of arrays one by one (`structure.damping.ratio[0]`).

    Returns
    -------
    xarray.Dataset
        By channel pair and line `measured` and `predicted`, of complex outputs as log10 of the
        amplitude, and in the unit of the outputs the size of the `error` between the two and that
        expected of the `noise`.

    Examples
    --------
    >>> from bayes_placement.criticism.fitted import fitted
    >>> values = {"structure.damping.ratio": 0.04, "sensor.s1.position": 0.2}
    >>> fit = fitted(experiment, measured, values)
    >>> sorted(fit.data_vars)
    ['error', 'measured', 'noise', 'predicted']
    """
    return compared(experiment, outputs_at(experiment, measurement, values))


class OutputsAtValues(NamedTuple):
    """Outputs of a model with values of its unknowns, beside what was measured.

    Outputs are [sensor, actuator, (force_level,) (part,) frequency], each with the variance of its
    noise and whether it was measured.
    """

    measured: np.ndarray
    predicted: np.ndarray
    variance: np.ndarray
    present: np.ndarray


def outputs_at(
    experiment: Experiment, measurement: Measurements, values: Mapping[str, float]
) -> OutputsAtValues:
    """Return what was measured and what is predicted; arguments as of `fitted`."""
    data = experiment.data(measurement)
    concrete = experiment.fix(with_arrays(experiment, values))
    # Run once: to compile it well takes longer.
    predicted, variance = compiled(prediction).bound(concrete, data, effort=0)()
    return OutputsAtValues(*map(np.asarray, (data.z, predicted, variance, data.measured)))


def compared(experiment: Experiment, at_values: OutputsAtValues) -> xr.Dataset:
    """Return the sizes of outputs and of their error by channel pair and line, see `fitted`."""
    measured, predicted, variance, present = at_values
    part = -2 if experiment.observe.parts > 1 else None
    error = np.sqrt(_over_parts((measured - predicted) ** 2, part))
    noise = np.sqrt(_over_parts(variance, part))
    unit = experiment.observe.label
    logarithm = unit if part is None else f"log10 of {unit}"
    arrays = {
        "measured": (amplitude(measured, part), logarithm),
        "predicted": (amplitude(predicted, part), logarithm),
        "error": (error, unit),
        "noise": (noise, unit),
    }
    complete = present if part is None else np.all(present, axis=part)
    levels = () if experiment.force_levels is None else (FORCE_LEVEL,)
    dimensions = ("sensor", "actuator", *levels, "frequency")
    variables = {
        name: (dimensions, np.where(complete, array, np.nan), {"units": units})
        for name, (array, units) in arrays.items()
    }
    labels = outputs(experiment, {}, ()).drop_vars("part", errors="ignore").coords
    return xr.Dataset(variables, coords=labels)


def _over_parts(squares: np.ndarray, part: int | None) -> np.ndarray:
    """Sum over the real and the imaginary part of complex outputs."""
    return squares if part is None else squares.sum(axis=part)
