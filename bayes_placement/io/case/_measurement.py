"""Measured FRFs of a case: what `case.json` states, and the universal files, which must agree."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpyro.distributions import LogUniform

from ..._shared.dimensions import Parameter
from ..._shared.errors import InputError
from ...experiment._measurement_checks import LINE_TOLERANCE
from ...experiment.measurement import Measurement
from ...experiment.noise import FromCoherence, FromScatter, FromVariance, Noise, Relative
from ...experiment.quantities import QUANTITIES
from ...positions.channel import LONGEST, Channel, is_printable
from .. import uff
from .._gate import is_number
from ._json_fields import CaseError, FieldRule, JsonObject, check_distinct, choice, integer, numbers

UNITS = {quantity.frf: quantity.ascii_unit for quantity in reversed(QUANTITIES)}
_COORDINATE_PRECISION = 1e-5  # of the greatest coordinate; universal files may keep six digits
_Coordinates = tuple[float, ...]


class RecordedTransducer(NamedTuple):
    """A sensor or actuator as the case records it: its object, channels, node and place [m]."""

    fields: JsonObject
    channels: tuple[Channel, ...]
    node: int
    position: _Coordinates

    @property
    def name(self) -> str:
        """Name of the sensor or actuator."""
        return self.channels[0].name


class MeasurementSettings(NamedTuple):
    """What a case states about its measurement.

    Amplitudes of the force are in N, the first and last line of the band in Hz, with their number.
    `baseline` has a universal file of an earlier state for each force level, `states` those of each
    of several states by its label, the baseline first; both may be empty.
    """

    file: Path
    sensors: list[RecordedTransducer]
    actuators: list[RecordedTransducer]
    quantity: str
    averages: int
    force_levels: tuple[float, ...] | None
    band: tuple[float, float]
    lines: int
    noise: Noise | None
    baseline: tuple[str, ...]
    states: dict[str, tuple[str, ...]]


def settings(
    case: JsonObject, sensors: list[RecordedTransducer], actuators: list[RecordedTransducer]
) -> MeasurementSettings:
    """Read the fields `measurement` and `frequency`."""
    stated, axis = case.object("measurement"), case.object("frequency")
    quantity = stated.value("quantity", choice(*UNITS))
    stated.value("units", choice(UNITS[quantity]))
    stated.value("convention", choice("exp(+i w t)"))
    stated.value("estimator", choice("H1"))  # for which the noise follows from the coherence
    stated.value("out_channels", _channels_rule("sensors", sensors))
    stated.value("in_channels", _channels_rule("actuators", actuators))
    low, high = axis.value("band_hz", _BAND)
    levels = stated.value("force_levels_N", _LEVELS)
    return MeasurementSettings(
        file=case.file,
        sensors=sensors,
        actuators=actuators,
        quantity=quantity,
        averages=stated.value("n_averages", integer(1, 16)),
        force_levels=None if levels is None else tuple(map(float, levels)),
        band=(float(low), float(high)),
        lines=axis.value("n_lines", integer(1, 400)),
        noise=stated_noise(stated),
        baseline=_files(stated, "baseline_files") if stated.has("baseline_files") else (),
        states=state_files(stated),
    )


def read_run(file: Path, settings: MeasurementSettings, level: float | None) -> Measurement:
    """Read the universal file of one state at one force level."""
    recorded = _named(_read(file, settings), settings)
    if recorded.quantity != settings.quantity:
        holds, field = f"holds {recorded.quantity}", "measurement.quantity"
        raise _contradiction(file, holds, settings, field, settings.quantity)
    _check_channels(file, settings, settings.sensors, recorded.sensors)
    _check_channels(file, settings, settings.actuators, recorded.actuators)
    _check_positions(file, settings, recorded)
    _check_notes(file, settings, recorded, level)
    chosen = recorded.channels(_channels(settings.sensors), _channels(settings.actuators))
    in_band = _in_band(file, settings, chosen)
    return dataclasses.replace(in_band, averages=settings.averages, force_level=level)


def _read(file: Path, settings: MeasurementSettings) -> Measurement:
    transducers = [*settings.sensors, *settings.actuators]
    # A sensor and an actuator may share a node, so nodes keep their numbers here.
    nodes = {transducer.node: str(transducer.node) for transducer in transducers}
    try:
        return uff.read(file, names=nodes, require_positions=False)
    except ValueError as error:
        raise CaseError(f"{file} cannot be used: {error}") from error


def _named(measurement: Measurement, settings: MeasurementSettings) -> Measurement:
    """Name channels and positions as the case does, by their node."""
    sensors = {str(sensor.node): sensor.name for sensor in settings.sensors}
    actuators = {str(actuator.node): actuator.name for actuator in settings.actuators}
    return dataclasses.replace(
        measurement,
        sensors=_renamed(measurement.sensors, sensors),
        actuators=_renamed(measurement.actuators, actuators),
        positions={
            names[node]: position
            for names in (sensors, actuators)
            for node, position in measurement.positions.items()
            if node in names
        },
    )


def _renamed(channels: tuple[Channel, ...], names: Mapping[str, str]) -> tuple[Channel, ...]:
    return tuple(
        channel._replace(name=names.get(channel.name, f"node {channel.name}"))
        for channel in channels
    )


def _check_channels(
    file: Path,
    settings: MeasurementSettings,
    transducers: list[RecordedTransducer],
    recorded: tuple[Channel, ...],
) -> None:
    """Refuse a channel that is missing or recorded in the opposite direction."""
    for transducer in transducers:
        for wanted in transducer.channels:
            if not {wanted, Channel(wanted.name)} & set(recorded):
                raise _contradiction(
                    file,
                    f"has the channels {', '.join(channel.label for channel in recorded)}",
                    settings,
                    transducer.fields.dotted_path("directions"),
                    f"{wanted.label} at node {transducer.node}",
                )


def _check_positions(file: Path, settings: MeasurementSettings, measured: Measurement) -> None:
    transducers = [*settings.sensors, *settings.actuators]
    largest = max(max(map(abs, transducer.position)) for transducer in transducers)
    for transducer in transducers:
        position = measured.positions.get(transducer.name)
        if position and not np.allclose(
            position, transducer.position, rtol=0.0, atol=_COORDINATE_PRECISION * largest
        ):
            raise _contradiction(
                file,
                f"places node {transducer.node} at {_shown(position)} m",
                settings,
                transducer.fields.dotted_path("position_m"),
                f"{_shown(transducer.position)} m",
            )


def _check_notes(
    file: Path, settings: MeasurementSettings, measured: Measurement, level: float | None
) -> None:
    """Compare averages and force level where the file records them."""
    if measured.averages not in (None, settings.averages):
        raise _contradiction(
            file,
            f"records {measured.averages} averages",
            settings,
            "measurement.n_averages",
            settings.averages,
        )
    if measured.force_level is not None and measured.force_level != level:
        raise _contradiction(
            file,
            f"records a force of {measured.force_level:g} N",
            settings,
            "measurement.force_levels_N",
            "none" if level is None else f"{level:g} N for this file",
        )


def _in_band(file: Path, settings: MeasurementSettings, measured: Measurement) -> Measurement:
    low, high = settings.band
    lines = measured.frequency
    near = (low * (1 - LINE_TOLERANCE) <= lines) & (lines <= high * (1 + LINE_TOLERANCE))
    in_band = lines[near]
    covers_band = in_band.size == settings.lines and np.allclose(
        in_band[[0, -1]], settings.band, rtol=LINE_TOLERANCE
    )
    if not covers_band:
        raise _contradiction(
            file,
            f"has {lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz, {in_band.size} of them "
            "in the band",
            settings,
            "frequency",
            f"{settings.lines} lines from {low:g} to {high:g} Hz, first and last included",
        )
    return measured.band(in_band[0], in_band[-1])


def _contradiction(
    file: Path, content: str, settings: MeasurementSettings, field: str, stated: object
) -> CaseError:
    return CaseError(
        f"{file} {content}, but the field {field} in {settings.file} says {stated}; both must "
        "agree, since either could be meant. Correct the one that is wrong."
    )


def _channels_rule(side: str, transducers: list[RecordedTransducer]) -> FieldRule:
    recorded = [[channel.name, channel.direction] for channel in _channels(transducers)]
    needed = sorted(map(repr, recorded))
    return FieldRule(
        f"each channel of `{side}` once, [id, direction],",
        recorded,
        lambda value: isinstance(value, list) and sorted(map(repr, value)) == needed,
    )


def _channels(transducers: list[RecordedTransducer]) -> list[Channel]:
    return [channel for transducer in transducers for channel in transducer.channels]


def _are_levels(value: object) -> bool:
    if not isinstance(value, list) or not value or not all(map(is_number, value)):
        return value is None
    return min(value) > 0 and len(set(value)) == len(value)


def _shown(position: _Coordinates) -> str:
    return f"({', '.join(f'{value:g}' for value in position)})"


_LEVELS = FieldRule(
    "null, or a list of positive amplitudes [N], each once,", [0.1, 1.0], _are_levels
)


_BAND = numbers(
    "the first and the last line [Hz], positive and increasing,",
    [20.0, 1600.0],
    lambda value: 0 < value[0] < value[1],
)


def state_files(stated: JsonObject) -> dict[str, tuple[str, ...]]:
    """Return the universal files of each state by its label, in their order, the baseline first."""
    if not stated.has("states"):
        return {}
    states = stated.objects("states", least=2)
    labels = [state.value("label", _LABEL) for state in states]
    check_distinct("label", states)
    if stated.has("baseline_files"):
        raise CaseError(
            f"{stated.file} has {stated.dotted_path('baseline_files')} and "
            f"{stated.dotted_path('states')}; one of them is needed, since the first of several "
            "states is the baseline. Leave measurement.baseline_files out."
        )
    return {label: _files(state, "files") for label, state in zip(labels, states, strict=True)}


def _files(stated: JsonObject, field: str) -> tuple[str, ...]:
    """Universal files among those that a field names; others hold the same."""
    return tuple(name for name in stated.value(field, _FILES) if name.endswith(".uff"))


def _are_file_names(value: object) -> bool:
    """Names of files in the folder of the case, none of which leads out of it."""
    return isinstance(value, list) and all(
        isinstance(name, str) and name == Path(name).name and name not in ("", ".", "..")
        for name in value
    )


_FILES = FieldRule(
    "a list of names of files in the folder of the case", ["baseline.uff"], _are_file_names
)


_LABEL = FieldRule(
    f"a text of at most {LONGEST} letters that can be printed",
    "5 mm cut",
    lambda value: isinstance(value, str) and is_printable(value),
)


RATIO, FLOOR = (1e-3, 0.3), (1e-4, 0.3)
"""Noise over |H|, and over the median of |H|, where neither the case nor a coherence states it."""


def stated_noise(measurement: JsonObject) -> Noise | None:
    """Read the field `noise_level` of a measurement; None without the field."""
    if not measurement.has("noise_level"):
        return None
    stated = measurement.object("noise_level")
    factor = _level(stated, "coherence_factor", 1.0) if stated.has("coherence_factor") else None
    if stated.has("ratio"):
        floor = _level(stated, "floor", 1e-3) if stated.has("floor") else 0.0
        return Relative(_level(stated, "ratio", 0.03), floor, coherence=factor)
    if factor is None:
        raise CaseError(
            f"{stated.file} has neither {stated.dotted_path('ratio')} nor "
            f"{stated.dotted_path('coherence_factor')}; one of them is needed, since a likelihood "
            'needs the size of the error. Write "noise_level": {"ratio": [0.001, 0.1]}.'
        )
    return FromCoherence(factor)


def noise_by_data(runs: Sequence[Measurement]) -> Noise:
    """What variance or coherence state, else the scatter of lines.

    Where lines are too few for that, unknown shares of |H| and of its median.
    """
    if all(run.variance is not None for run in runs):
        return FromVariance()
    if any(run.coherence is not None for run in runs):
        return FromCoherence()
    if all(map(_tells_scatter, runs)):
        return FromScatter()
    median = float(
        np.median(np.concatenate([np.abs(run.frf[run.measured]).ravel() for run in runs]))
    )
    return Relative(LogUniform(*RATIO), LogUniform(*(share * median for share in FLOOR)))


def _tells_scatter(run: Measurement) -> bool:
    try:
        run.scatter_variance()
    except InputError:
        return False
    return True


def _level(stated: JsonObject, name: str, example: float) -> Parameter:
    """Return a level, or the log-uniform distribution between two."""
    rule = FieldRule(
        "a positive number, or two increasing ones between which it is log-uniform,",
        [example / 10, example * 10],
        _is_level,
    )
    value = stated.value(name, rule)
    return LogUniform(*map(float, value)) if isinstance(value, list) else float(value)


def _is_level(value: object) -> bool:
    if isinstance(value, list):
        return len(value) == 2 and all(map(is_number, value)) and 0 < value[0] < value[1]
    return is_number(value) and value > 0
