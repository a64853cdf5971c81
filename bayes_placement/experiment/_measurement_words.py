"""Measurements as arrays, a dataset and in words; experiments and their priors in words."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from .._shared.reprs import PRIOR_HEADINGS, notebook_html, prior_rows
from .._shared.sites import Role, Unknown
from ..positions.channel import Channel
from .quantities import quantity_of

if TYPE_CHECKING:
    import xarray as xr

    from .experiment import Experiment
    from .measurement import Measurement


def lines_in_words(lines: np.ndarray) -> str:
    """Say how many lines there are, and where."""
    return f"{counted(lines.size, 'line')} {span_in_words(lines)}"


def span_in_words(lines: np.ndarray) -> str:
    """Say from where to where lines reach, in Hz."""
    low, high = lines.min(), lines.max()
    return f"at {low:g} Hz" if lines.size == 1 else f"from {low:g} to {high:g} Hz"


def sentence(measurement: "Measurement") -> str:
    """Say what was measured: quantity, channels, lines and what is known of the noise."""
    averages = "" if measurement.averages is None else f", {measurement.averages} averages"
    level = measurement.force_level
    force = "" if level is None else f", force {level:g} N"
    return (
        f"Measurement: {measurement.quantity} [{quantity_of(measurement.quantity).unit}] of "
        f"{counted(len(measurement.sensors), 'sensor channel')} for "
        f"{counted(len(measurement.actuators), 'actuator channel')}, "
        f"{counted(int(measurement.measured.sum()), 'pair')} measured, "
        f"{lines_in_words(measurement.frequency)}, "
        f"{_known(measurement)}{averages}{force}."
    )


def _known(measurement: "Measurement") -> str:
    coherence = "no coherence" if measurement.coherence is None else "with coherence"
    return coherence if measurement.variance is None else f"{coherence} and with variance"


def counted(number: int, noun: str) -> str:
    """Return a number and its noun, in the plural where it is not one."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def sentence_on(experiment: "Experiment") -> str:
    """Say how many channels and lines an experiment observes."""
    lines = np.asarray(experiment.frequency)
    sensors, actuators = len(experiment.sensor_channels), len(experiment.actuator_channels)
    if experiment.observe.is_modal:
        return (
            f"Experiment: {lines.size} modes from {lines.min():g} to {lines.max():g} Hz, shapes at "
            f"{sensors} sensor channels, z = {experiment.observe.label}"
        )
    return (
        f"Experiment: {sensors} sensor x {actuators} actuator channels, {lines_in_words(lines)}, "
        f"z = {experiment.observe.label}"
    )


def prior_table(unknowns: Sequence[Unknown]) -> list[str]:
    """Return the lines of the table: column headings, then one line for each unknown.

    The standard errors of a model error are one line, since there are many.
    """
    rows: list[tuple[str, ...]] = [PRIOR_HEADINGS, *prior_rows(unknowns)]
    return [*_table(rows), *_of_noise(unknowns)]


def _of_noise(unknowns: Sequence[Unknown]) -> list[str]:
    """Say that the level of the noise is not known, where it is not."""
    names = [unknown.name for unknown in unknowns if unknown.role is Role.OUTPUT_ERROR]
    words = "The level of the noise is not known: it is inferred with all else"
    return [f"{words} ({', '.join(names)})."] if names else []


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return ["  ".join(word.ljust(w) for word, w in zip(row, widths, strict=True)) for row in rows]


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
