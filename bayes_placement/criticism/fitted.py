"""fitted: in, an experiment, values of its unknowns and data; out, what the model predicts.

Not known here: how the values were found, figures.
"""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
import xarray as xr

from .._compiled import compiled
from .._types import Response
from ..experiment.experiment import Experiment, Measurements
from ..experiment.noise import Data
from ..inference._results import outputs


def fitted(
    experiment: Experiment, measurement: Measurements, values: Mapping[str, float]
) -> xr.Dataset:
    """Lay a model with values beside what was measured.

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
    """
    data = experiment.data(measurement)
    concrete = experiment.fix(_whole(experiment, values))
    predicted, variance = compiled(_law)(concrete, data)
    parts = experiment.observe.parts > 1
    drawn = _drawn(np.asarray(data.z), np.asarray(predicted), np.asarray(variance), parts)
    present = np.all(np.asarray(data.measured), axis=-2) if parts else np.asarray(data.measured)
    unit = experiment.observe.label
    amplitude = f"log10 of {unit}" if parts else unit
    labels = outputs(experiment, {}, ()).drop_vars("part", errors="ignore").coords
    dimensions = ("sensor", "actuator", "frequency")
    return xr.Dataset(
        {
            name: (
                dimensions,
                np.where(present, one, np.nan),
                {"units": amplitude if name in ("measured", "predicted") else unit},
            )
            for name, one in drawn.items()
        },
        coords=labels,
    )


def _law(concrete: Experiment, data: Data) -> tuple[Response, Response]:
    assert concrete.noise is not None
    predicted = concrete.predict()
    law = concrete.noise.distribution(predicted, data)
    return predicted, jnp.broadcast_to(law.variance, predicted.shape)


def _drawn(
    measured: np.ndarray, predicted: np.ndarray, variance: np.ndarray, parts: bool
) -> dict[str, np.ndarray]:
    error = (measured - predicted) ** 2
    if not parts:
        return {
            "measured": measured,
            "predicted": predicted,
            "error": np.sqrt(error),
            "noise": np.sqrt(variance),
        }
    return {
        "measured": _amplitude(measured),
        "predicted": _amplitude(predicted),
        "error": np.sqrt(error.sum(axis=-2)),
        "noise": np.sqrt(variance.sum(axis=-2)),
    }


def _amplitude(values: np.ndarray) -> np.ndarray:
    with np.errstate(divide="ignore"):  # nothing was measured there
        return np.log10(np.sum(values**2, axis=-2)) / 2


def _whole(experiment: Experiment, values: Mapping[str, float]) -> dict[str, Any]:
    """Put the elements of arrays together again."""
    return {
        one.name: _value(one.name, one.distribution.shape(), values) for one in experiment.unknowns
    }


def _value(name: str, shape: tuple[int, ...], values: Mapping[str, float]) -> Any:
    if not shape:
        return values[name]
    count = int(np.prod(shape))
    return np.array([values[f"{name}[{i}]"] for i in range(count)]).reshape(shape)
