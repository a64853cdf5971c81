"""Arrays of a measurement, in rows of sensors and columns of actuators, and a labelled dataset."""

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from .._shared.reprs import notebook_html
from ..positions.channel import Channel
from .quantities import quantity_of

if TYPE_CHECKING:
    import xarray as xr

    from .measurement import Measurement

Variable: TypeAlias = tuple[tuple[str, ...], np.ndarray, dict[str, str]]
"""Dimensions, values and attributes."""


def frozen(values: object, dtype: type) -> np.ndarray:
    """Return a copy that cannot be written to."""
    array: np.ndarray = np.array(values, dtype=dtype)
    if dtype is complex:
        # NumPy gives a real NaN the imaginary part 0.
        array[np.isnan(array)] = complex(np.nan, np.nan)
    array.setflags(write=False)
    return array


def as_pairs(values: object, single: bool) -> np.ndarray:
    """Return an array (sensor, actuator, frequency), also of the lines of a single pair."""
    array = np.asarray(values)
    return array[None, None] if single and array.ndim == 1 else array


PAIRS = ("sensor", "actuator")


def dataset(measurement: "Measurement") -> "xr.Dataset":
    """Return FRFs, coherence, variance and recorded positions, labelled by channel.

    Complex numbers are an axis `part`, since files of datasets hold real numbers only.
    """
    import xarray as xr

    parts = np.stack([measurement.frf.real, measurement.frf.imag], axis=2)
    units = quantity_of(measurement.quantity).unit
    attributes = {"long_name": measurement.quantity, "units": units}
    variables: dict[str, Variable] = {
        "frf": ((*PAIRS, "part", "frequency"), parts, attributes),
        "sensor_position": _positions(measurement, "sensor", measurement.sensors),
        "actuator_position": _positions(measurement, "actuator", measurement.actuators),
    }
    if measurement.coherence is not None:
        variables["coherence"] = ((*PAIRS, "frequency"), measurement.coherence, {"units": "1"})
    if measurement.variance is not None:
        squared = {"long_name": "variance of the FRF", "units": f"({units})^2"}
        variables["variance"] = ((*PAIRS, "frequency"), measurement.variance, squared)
    coordinates = {
        "sensor": [channel.label for channel in measurement.sensors],
        "actuator": [channel.label for channel in measurement.actuators],
        "frequency": ("frequency", measurement.frequency, {"units": "Hz"}),
        "part": ["real", "imag"],
        "axis": ["x", "y", "z"],
    }
    return xr.Dataset(variables, coords=coordinates, attrs=_settings(measurement))


def html(measurement: "Measurement") -> str:
    """How a notebook shows a measurement: a row for each pair of channels."""
    import pandas as pd

    rows = [
        {
            "sensor": sensor.label,
            "actuator": actuator.label,
            "greatest": f"{np.abs(measurement.frf[row, column]).max():.3g}",
        }
        for row, sensor in enumerate(measurement.sensors)
        for column, actuator in enumerate(measurement.actuators)
    ]
    return notebook_html(repr(measurement), pd.DataFrame(rows))


def _positions(measurement: "Measurement", side: str, channels: tuple[Channel, ...]) -> Variable:
    """Recorded coordinates [m] of the transducer of each channel, NaN where not recorded."""
    missing = (np.nan,) * 3
    recorded = [measurement.positions.get(channel.name, missing) for channel in channels]
    return (side, "axis"), np.array(recorded), {"units": "m"}


def _settings(measurement: "Measurement") -> dict[str, object]:
    settings = {
        "quantity": measurement.quantity,
        "averages": measurement.averages,
        "force_level_newton": measurement.force_level,
    }
    return {name: value for name, value in settings.items() if value is not None}
