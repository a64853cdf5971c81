"""_measurement: in, the fields of a case and its UFF files; out, measurements that agree.

Not known here: structures, priors, experiments.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...experiment.measurement import LINE_TOLERANCE, Measurement
from ...positions.channel import Channel
from .. import uff
from ._json_fields import CaseError, Fields, Rule, is_number, numbers, one_of, whole

UNITS = {"accelerance": "(m/s^2)/N", "mobility": "(m/s)/N", "receptance": "m/N"}
_PLACE_DIGITS = 1e-5  # of the greatest coordinate; universal files may keep six digits
_Point = tuple[float, ...]


class Mounted(NamedTuple):
    """A sensor or actuator as the case records it: field, channels, node of the UFF file, place."""

    fields: Fields
    channels: tuple[Channel, ...]
    node: int
    position: _Point

    @property
    def name(self) -> str:
        """Name of the sensor or actuator."""
        return self.channels[0].name


class Setup(NamedTuple):
    """What the measurement of a case is said to be."""

    case: Path
    sensors: list[Mounted]
    actuators: list[Mounted]
    quantity: str
    averages: int
    force_levels: tuple[float, ...] | None
    band: tuple[float, float]
    lines: int


def setup(case: Fields, sensors: list[Mounted], actuators: list[Mounted]) -> Setup:
    """Read the fields `measurement` and `frequency`.

    Raises
    ------
    CaseError
        If a field is missing or wrong.
    """
    stated, axis = case.inside("measurement"), case.inside("frequency")
    quantity = stated.take("quantity", one_of(*UNITS))
    stated.take("units", one_of(UNITS[quantity]))
    stated.take("convention", one_of("exp(+i w t)"))
    stated.take("estimator", one_of("H1"))  # for which the noise follows from the coherence
    stated.take("out_channels", _channels("sensors", sensors))
    stated.take("in_channels", _channels("actuators", actuators))
    low, high = axis.take("band_hz", _BAND)
    return Setup(
        case=case.file,
        sensors=sensors,
        actuators=actuators,
        quantity=quantity,
        averages=stated.take("n_averages", whole(1, 16)),
        force_levels=_levels(stated.take("force_levels_N", _LEVELS)),
        band=(float(low), float(high)),
        lines=axis.take("n_lines", whole(1, 400)),
    )


def measurements(folder: Path, setup: Setup) -> tuple[Measurement, ...]:
    """Read one measurement for each force level, or the only one.

    Raises
    ------
    FileNotFoundError
        If a file is missing.
    CaseError
        If a file is no universal file, or contradicts the case.
    """
    levels = setup.force_levels or (None,)
    names = ["measured.uff", *(f"measured_level{n}.uff" for n in range(2, len(levels) + 1))]
    every = tuple(
        _measurement(folder / name, setup, level) for name, level in zip(names, levels, strict=True)
    )
    for name, one in zip(names, every, strict=True):
        if not np.allclose(one.frequency, every[0].frequency, rtol=LINE_TOLERANCE, atol=0.0):
            raise CaseError(
                f"{folder / name} and {folder / names[0]} have other lines in the same band; one "
                "frequency axis is needed for all force levels, since they are compared line by "
                "line. Export both on the same lines."
            )
    return every


def _measurement(file: Path, setup: Setup, level: float | None) -> Measurement:
    whole_file = _named(_read(file, setup), setup)
    _check_quantity(file, setup, whole_file)
    for side, mounted in (("sensors", setup.sensors), ("actuators", setup.actuators)):
        _check_channels(file, setup, side, mounted, whole_file)
    _check_positions(file, setup, whole_file)
    _check_notes(file, setup, whole_file, level)
    chosen = whole_file.channels(*(_every(side) for side in (setup.sensors, setup.actuators)))
    in_band = _in_band(file, setup, chosen)
    known = dataclasses.replace(in_band, averages=setup.averages, force_level=level)
    _check_noise(file, known)
    return known


def _read(file: Path, setup: Setup) -> Measurement:
    if not file.is_file():
        levels = len(setup.force_levels or ())
        wanted = f"one file for each of {levels} force levels" if levels > 1 else "one file"
        raise FileNotFoundError(
            f"There is no file {file}, and measurement.force_levels_N in {setup.case} asks for "
            f"{wanted}: measured.uff, then measured_level2.uff and so on. Put the file there, or "
            "correct that field."
        )
    # A sensor and an actuator may share a node, so nodes keep their numbers here.
    nodes = {one.node: str(one.node) for one in (*setup.sensors, *setup.actuators)}
    try:
        return uff.read(file, names=nodes, require_positions=False)
    except ValueError as error:
        raise CaseError(f"{file} cannot be used: {error}") from error


def _named(measurement: Measurement, setup: Setup) -> Measurement:
    """Name channels and places as the case does, by their node."""
    sensors = {str(one.node): one.name for one in setup.sensors}
    actuators = {str(one.node): one.name for one in setup.actuators}
    return dataclasses.replace(
        measurement,
        sensors=_renamed(measurement.sensors, sensors),
        actuators=_renamed(measurement.actuators, actuators),
        positions={
            names[node]: place
            for names in (sensors, actuators)
            for node, place in measurement.positions.items()
            if node in names
        },
    )


def _renamed(channels: tuple[Channel, ...], names: Mapping[str, str]) -> tuple[Channel, ...]:
    return tuple(one._replace(name=names.get(one.name, f"node {one.name}")) for one in channels)


def _check_quantity(file: Path, setup: Setup, measured: Measurement) -> None:
    if measured.quantity != setup.quantity:
        raise _contradiction(
            file, f"holds {measured.quantity}", setup, "measurement.quantity", setup.quantity
        )


def _check_channels(
    file: Path, setup: Setup, side: str, mounted: list[Mounted], measured: Measurement
) -> None:
    """Refuse a channel that is missing or recorded in the opposite direction."""
    there = measured.sensors if side == "sensors" else measured.actuators
    for one in mounted:
        for wanted in one.channels:
            if not {wanted, Channel(wanted.name)} & set(there):
                raise _contradiction(
                    file,
                    f"has the channels {', '.join(channel.label for channel in there)}",
                    setup,
                    one.fields.place("directions"),
                    f"{wanted.label} at node {one.node}",
                )


def _check_positions(file: Path, setup: Setup, measured: Measurement) -> None:
    every = [*setup.sensors, *setup.actuators]
    close = _PLACE_DIGITS * max(max(map(abs, one.position)) for one in every)
    for one in every:
        found = measured.positions.get(one.name)
        if found and not np.allclose(found, one.position, rtol=0.0, atol=close):
            raise _contradiction(
                file,
                f"places node {one.node} at {_point(found)} m",
                setup,
                one.fields.place("position_m"),
                f"{_point(one.position)} m",
            )


def _check_notes(file: Path, setup: Setup, measured: Measurement, level: float | None) -> None:
    """Compare averages and force level where the file records them."""
    if measured.averages not in (None, setup.averages):
        raise _contradiction(
            file,
            f"records {measured.averages} averages",
            setup,
            "measurement.n_averages",
            setup.averages,
        )
    if measured.force_level is not None and measured.force_level != level:
        raise _contradiction(
            file,
            f"records a force of {measured.force_level:g} N",
            setup,
            "measurement.force_levels_N",
            "none" if level is None else f"{level:g} N for this file",
        )


def _in_band(file: Path, setup: Setup, measured: Measurement) -> Measurement:
    low, high = setup.band
    lines = measured.frequency
    near = (low * (1 - LINE_TOLERANCE) <= lines) & (lines <= high * (1 + LINE_TOLERANCE))
    kept = lines[near]
    if kept.size != setup.lines or not np.allclose(kept[[0, -1]], setup.band, rtol=LINE_TOLERANCE):
        raise _contradiction(
            file,
            f"has {lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz, {kept.size} of them in "
            "the band",
            setup,
            "frequency",
            f"{setup.lines} lines from {low:g} to {high:g} Hz, first and last included",
        )
    return measured.band(kept[0], kept[-1])


def _check_noise(file: Path, measured: Measurement) -> None:
    """Refuse now what would have no known noise later."""
    try:
        measured.noise_variance()
    except ValueError as error:
        raise CaseError(
            f"{file} does not tell its noise: {error} A case needs the coherence of every FRF "
            "(dataset 58, function type 6), since its noise follows from it."
        ) from error


def _contradiction(file: Path, found: str, setup: Setup, field: str, stated: Any) -> CaseError:
    return CaseError(
        f"{file} {found}, but the field {field} in {setup.case} says {stated}; both must agree, "
        "since either could be meant. Correct the one that is wrong."
    )


def _channels(side: str, mounted: list[Mounted]) -> Rule:
    recorded = [[channel.name, channel.direction] for channel in _every(mounted)]
    return Rule(
        f"each channel of `{side}` once, [id, direction],",
        recorded,
        lambda value: isinstance(value, list) and sorted(map(repr, value)) == _sorted(recorded),
    )


def _every(mounted: list[Mounted]) -> list[Channel]:
    return [channel for one in mounted for channel in one.channels]


def _sorted(channels: list[list[Any]]) -> list[str]:
    return sorted(map(repr, channels))


def _levels(given: list[float] | None) -> tuple[float, ...] | None:
    return None if given is None else tuple(float(level) for level in given)


def _are_levels(value: Any) -> bool:
    if not isinstance(value, list) or not value or not all(map(is_number, value)):
        return value is None
    return min(value) > 0 and len(set(value)) == len(value)


def _point(position: _Point) -> str:
    return f"({', '.join(f'{value:g}' for value in position)})"


_LEVELS = Rule("null, or a list of positive amplitudes [N], each once,", [0.1, 1.0], _are_levels)
_BAND = numbers(
    "the first and the last line [Hz], positive and increasing,",
    [20.0, 1600.0],
    lambda value: 0 < value[0] < value[1],
)
