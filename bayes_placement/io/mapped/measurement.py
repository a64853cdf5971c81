"""A measurement of named arrays and a mapping, and a report of what was read and left out."""

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._shared.errors import InputError
from ..._shared.reprs import notebook_html
from ...experiment._measurement_words import counted
from ...experiment.measurement import Measurement
from ...experiment.quantities import quantity_of
from ...positions.channel import Channel, match, parsed
from .._frf_units import VOLTAGES, Scale
from .._gate import check_plausible, reading, usable_lines
from ..arrays import NamedArrays
from . import _lines_needed, _values
from .channel_table import ChannelRow
from .mapping import FrfRule, Mapping


class ImportReport(NamedTuple):
    """What an import did.

    Parameters
    ----------
    source
        The file, what it is, and its checksum.
    read
        What was read and how, a sentence each.
    left_out
        What was not read, by name, and why.
    result
        What came out, in a sentence.

    Examples
    --------
    >>> bp.io.uff.write("measured.uff", measured)
    >>> bp.io.read("measured.uff").report.left_out
    {}
    """

    source: str
    read: tuple[str, ...]
    left_out: dict[str, str]
    result: str

    def words(self) -> list[str]:
        """Sentences of the report, in their order."""
        left_out = [f"Left out: {name}, since {why}." for name, why in self.left_out.items()]
        return [self.source, *self.read, *left_out, self.result]

    def __repr__(self) -> str:
        """Say what came out."""
        return f"ImportReport: {self.result}"

    def _repr_html_(self) -> str:
        import pandas as pd

        return notebook_html(repr(self), pd.DataFrame(), self.words())

    def __str__(self) -> str:
        """One sentence a line."""
        return "\n".join(self.words())


def report(
    path: Path,
    form: str,
    sentences: Sequence[str],
    left_out: dict[str, str],
    measurement: Measurement,
) -> ImportReport:
    """Make the report of a file that was read."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    source = f"{path} is {form} of {path.stat().st_size} bytes, sha256 {digest[:16]}."
    return ImportReport(source, tuple(sentences), dict(left_out), repr(measurement))


_OF_BLOCK = ("coherence", "sensors", "actuators")
CONJUGATED = "conjugated, since the file is under exp(-i w t)"
_REMEDY = "Correct the mapping, or export the file again."


class Assembled(NamedTuple):
    """FRFs of labelled channels, not yet in SI."""

    frf: np.ndarray
    coherence: np.ndarray | None
    frequency: np.ndarray
    sensors: tuple[str, ...]
    actuators: tuple[str, ...]
    unit: Scale
    sentences: list[str]


def measurement_of(
    source: NamedArrays, mapping: Mapping, rows: list[ChannelRow]
) -> tuple[Measurement, ImportReport]:
    """Make a measurement of arrays by what a mapping and a channel table say of them."""
    labels = {
        f"{role}s": [row.label for row in rows if row.role == role]
        for role in ("sensor", "actuator")
    }
    _lines_needed.check_complete(mapping, source, labels)
    with (
        reading(source.path, source.format, _REMEDY),
        np.errstate(over="ignore", invalid="ignore"),  # what is not finite is refused below
    ):
        single = any(rule.sensor is not None for rule in mapping.frf)
        raw = _pairs(source, mapping) if single else _block(source, mapping)
        usable = usable_lines(source.path, raw.frequency, raw.frf, raw.coherence)
        in_si, sentence = _in_si(_at_lines(raw, usable), mapping, rows)
        measurement = _named(in_si, mapping, rows)
        check_axes(measurement, rows)
        check_plausible(source.path, frf=measurement.frf[measurement.measured])
    sentences = [*raw.sentences, sentence, *_of_settings(measurement)]
    unscaled = [] if raw.unit.quantity == VOLTAGES else rows
    several = f"{counted(int(np.sum(~usable)), 'line')}"
    unusable = {} if usable.all() else {several: "their coherence or their FRFs are no measurement"}
    left_out = {
        **source.left_out,
        **unusable,
        **_unused(source, mapping),
        **unused_rows(rows, measurement),
        **unused_sensitivities(unscaled),
    }
    return measurement, report(source.path, source.format, sentences, left_out, measurement)


def _at_lines(raw: Assembled, lines: np.ndarray) -> Assembled:
    coherence = None if raw.coherence is None else raw.coherence[..., lines]
    return raw._replace(
        frf=raw.frf[..., lines], coherence=coherence, frequency=raw.frequency[lines]
    )


def _block(source: NamedArrays, mapping: Mapping) -> Assembled:
    """FRFs that are in one array."""
    rule = mapping.frf[0]
    sensors = _labels(source, mapping.sensors)
    actuators = _labels(source, mapping.actuators)
    values = _values.frf_of(source, rule)
    pairs = len(sensors) * len(actuators)
    lines = _lines(source, mapping, values.size // pairs)
    sizes = {
        "sensor": len(sensors),
        "actuator": len(actuators),
        "frequency": lines.frequency.size,
    }
    what = " and ".join(map(str, rule.parts.values()))
    frf = _values.arranged(source, what, values, rule.axes, sizes)
    coherence = None
    if mapping.coherence is not None:
        axes = mapping.coherence_axes or rule.axes
        known = _values.array_of(source, mapping.coherence).astype(float)
        coherence = _values.arranged(source, str(mapping.coherence), known, axes, sizes)
    size = " x ".join(map(str, values.shape))
    order = ", ".join(rule.axes or ("frequency",))
    sentence = f"FRFs: {what}, {size} numbers as {order}."
    return Assembled(
        frf,
        coherence,
        lines.frequency,
        sensors,
        actuators,
        _values.unit_of(source, rule),
        [sentence, lines.sentence],
    )


def _pairs(source: NamedArrays, mapping: Mapping) -> Assembled:
    """FRFs of which each pair has arrays of its own."""
    rules = mapping.frf
    superfluous = [name for name in _OF_BLOCK if getattr(mapping, name)]
    if superfluous:
        raise InputError(
            f"{superfluous[0]} is stated for all FRFs, each of which stands in an array of its own "
            "and names that itself; both could contradict each other. Leave it out"
        )
    sensors = tuple(dict.fromkeys(str(rule.sensor) for rule in rules))
    actuators = tuple(dict.fromkeys(str(rule.actuator) for rule in rules))
    units = {_values.unit_of(source, rule) for rule in rules}
    if len(units) > 1:
        raise InputError("its FRFs have several units; one is needed, since a measurement has one")
    lines = _lines(source, mapping, _values.frf_of(source, rules[0]).size)
    shape = len(sensors), len(actuators), lines.frequency.size
    frf = np.full(shape, np.nan, complex)
    coherence = np.full(shape, np.nan)
    for rule in rules:
        pair = sensors.index(str(rule.sensor)), actuators.index(str(rule.actuator))
        if not np.isnan(frf[pair]).all():
            raise InputError(f"the pair {rule.sensor} / {rule.actuator} occurs twice")
        frf[pair] = _of_pair(source, rule, _values.frf_of(source, rule), shape[2])
        if rule.coherence is not None:
            known = _values.array_of(source, rule.coherence).astype(float)
            coherence[pair] = _of_pair(source, rule, known, shape[2])
    known_coherence = None if np.isnan(coherence).all() else coherence
    sentence = f"FRFs: {counted(len(rules), 'pair')} of columns or arrays, by name."
    unit = units.pop()
    return Assembled(
        frf, known_coherence, lines.frequency, sensors, actuators, unit, [sentence, lines.sentence]
    )


def _of_pair(source: NamedArrays, rule: FrfRule, values: np.ndarray, lines: int) -> np.ndarray:
    sizes = {"sensor": 1, "actuator": 1, "frequency": lines}
    what = f"{rule.sensor} / {rule.actuator}"
    return _values.arranged(source, what, values, rule.axes, sizes)[0, 0]


def _lines(source: NamedArrays, mapping: Mapping, count: int) -> _values.FrequencyAxis:
    if mapping.frequency is None:
        raise InputError("nothing says at which frequencies its FRFs are")
    return _values.lines_of(source, mapping.frequency, count)


def _labels(source: NamedArrays, labels: tuple[str, ...] | str | None) -> tuple[str, ...]:
    if isinstance(labels, str):
        texts = np.atleast_1d(_values.array_of(source, labels, "U")).ravel()
        return tuple(str(text).strip() for text in texts)
    return labels or ()


def _in_si(raw: Assembled, mapping: Mapping, rows: list[ChannelRow]) -> tuple[Assembled, str]:
    """Values in SI under exp(+i w t), and a sentence on their unit."""
    frf = np.conj(raw.frf) if mapping.conjugate else raw.frf
    sign = f", {CONJUGATED}" if mapping.conjugate else ""
    quantity, factor = raw.unit
    if quantity != VOLTAGES:
        words = f"Unit: {quantity}, times {factor:g} to {quantity_of(quantity).unit}"
        scaled = raw._replace(frf=frf * factor)
    else:
        factors, quantity = _by_sensitivity(raw, rows)
        words = f"Unit: voltages, divided by the sensitivities of the channel table to {quantity}"
        scaled = raw._replace(frf=frf * factor * factors, unit=Scale(quantity, 1.0))
    return scaled, f"{words}{sign}."


def _by_sensitivity(raw: Assembled, rows: list[ChannelRow]) -> tuple[np.ndarray, str]:
    """Factors of each pair that turn voltages into the quantity that the sensors sense."""
    sensors = [_row(label, rows, "sensor") for label in raw.sensors]
    actuators = [_row(label, rows, "actuator") for label in raw.actuators]
    for row in (*sensors, *actuators):
        senses_force = row.senses == "force"
        if row.sensitivity is None or senses_force == (row.role == "sensor"):
            needed = "mV/N" if row.role == "actuator" else "mV/(m/s^2)"
            raise InputError(
                "its FRFs are in voltage over voltage, and the channel table has no sensitivity of "
                f"the {row.role} {row.label} in a unit such as {needed}; those of all are "
                "needed, since the FRFs are divided by them. Add the columns sensitivity and unit"
            )
    quantities = {row.senses for row in sensors}
    if len(quantities) > 1:
        raise InputError(f"its sensors sense {' and '.join(sorted(quantities))}; one is needed")
    by_sensor = np.array([row.sensitivity for row in sensors])
    by_actuator = np.array([row.sensitivity for row in actuators])
    return (by_actuator[None, :] / by_sensor[:, None])[:, :, None], quantities.pop()


def _row(label: str, rows: list[ChannelRow], role: str) -> ChannelRow:
    """Row of a channel in the table, found as channels are."""
    of_role = [row for row in rows if row.role == role]
    if not of_role:
        raise InputError(
            f"there is no {role} in a channel table; its sensitivity is needed. Name one in the "
            'mapping: channels = "channels.xlsx"'
        )
    recorded = tuple(Channel(row.name, row.direction) for row in of_role)
    return of_role[match(Channel.parse(label), recorded, role).number]


def _named(raw: Assembled, mapping: Mapping, rows: list[ChannelRow]) -> Measurement:
    """The measurement, with directions and positions of the channel table."""
    sensors, actuators = parsed(raw.sensors), parsed(raw.actuators)
    if rows:
        sensors = tuple(_with_direction(channel, rows, "sensor") for channel in sensors)
        actuators = tuple(_with_direction(channel, rows, "actuator") for channel in actuators)
    return Measurement.from_arrays(
        raw.frf,
        raw.frequency,
        sensors=sensors,
        actuators=actuators,
        quantity=raw.unit.quantity,
        coherence=raw.coherence,
        averages=mapping.averages,
        positions=positions_of(rows),
        force_level=mapping.force_level,
    )


def _with_direction(channel: Channel, rows: list[ChannelRow], role: str) -> Channel:
    if channel.direction:
        return channel
    row = _row(channel.label, rows, role)
    return Channel(channel.name, row.direction)


def check_axes(measurement: Measurement, rows: list[ChannelRow]) -> None:
    """Refuse a channel that was measured along another axis than the channel table says."""
    for channel in (*measurement.sensors, *measurement.actuators):
        known = [row for row in rows if row.name == channel.name]
        if known and not any(_is_of(channel, row) for row in known):
            raise InputError(
                f"it holds FRFs of {channel.label} and the channel table has "
                f"{', '.join(row.label for row in known)}; the axes must agree, since "
                "either could be meant. Correct the one that is wrong"
            )


def unused_rows(rows: list[ChannelRow], measurement: Measurement) -> dict[str, str]:
    """Channels of a table that were not measured, and why they are left out."""
    channels = (*measurement.sensors, *measurement.actuators)
    return {
        f"channel {row.label} of the table": "no FRF is of it"
        for row in rows
        if not any(_is_of(channel, row) for channel in channels)
    }


def _is_of(channel: Channel, row: ChannelRow) -> bool:
    """Whether a channel is that of a row; an axis that either does not state may be any."""
    axes = abs(channel.direction), abs(row.direction)
    return channel.name == row.name and (0 in axes or axes[0] == axes[1])


def unused_sensitivities(rows: list[ChannelRow]) -> dict[str, str]:
    """Sensitivities of a table that scale nothing, and why."""
    stated = [row.label for row in rows if row.sensitivity is not None]
    why = "the FRFs are in units of motion and force already"
    return {f"sensitivity of {', '.join(stated)}": why} if stated else {}


def positions_of(rows: list[ChannelRow]) -> dict[str, tuple[float, float, float]]:
    """Recorded coordinates [m] by the name of the transducer."""
    return {row.name: row.position for row in rows if row.position is not None}


def _of_settings(measurement: Measurement) -> list[str]:
    """Sentences on coherence and averages."""
    sentences = []
    if measurement.coherence is None:
        sentences.append("Coherence: none, so that the noise is not known from the file.")
    else:
        averages = measurement.averages or "an unknown number of"
        sentences.append(f"Coherence: read, of {averages} averages.")
    if measurement.positions:
        sentences.append(f"Positions: of {', '.join(measurement.positions)}, in m.")
    return sentences


def _unused(source: NamedArrays, mapping: Mapping) -> dict[str, str]:
    """Arrays that neither the mapping nor the file's own names call."""
    rule = mapping.frequency
    columns = [
        *(column for frf in mapping.frf for column in (*frf.parts.values(), frf.coherence)),
        mapping.coherence,
        mapping.sensors,
        mapping.actuators,
        *((rule.array, rule.first, rule.step) if rule else ()),
    ]
    names = list(source.arrays)
    called = {
        names[column - 1] if isinstance(column, int) and column <= len(names) else column
        for column in columns
        if isinstance(column, int | str)
    }
    of_file = {"quantity", "averages"} if "frf" in called else set()
    return {name: "the mapping does not name it" for name in names if name not in called | of_file}
