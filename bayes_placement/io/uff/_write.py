"""Write a measurement as a universal file (datasets 164, 2411, and 58 or 58b), with notes."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._shared.arguments import arguments_checked
from ..._shared.errors import InputError
from ..._shared.files import Json, write_atomically
from ...experiment.measurement import Measurement
from ...positions.channel import Channel, check_distinct
from .._gate import Accepts, is_number
from ._datasets import VARIANCE_NOTE, Dataset, MeasurementFileError
from ._units import FORCE_TYPE, FREQUENCY_TYPE, stated_for

_ID_WIDTH = 80
_FIRST_ACTUATOR_NODE = 101
_HEADER_DIGITS = 1e-9  # relative error of a line that a reader would not notice
_IN_LITTLE_ENDIAN_IEEE = (1, 2)
_NODE_DIGITS = 9


class _FunctionType(NamedTuple):
    """A type of function: its name, its number, and its records 9 and 10."""

    name: str
    number: int
    ordinate: str
    denominator: str


@arguments_checked
def write(path: str | Path, measurement: Measurement, *, binary: bool = False) -> None:
    """Write a measurement as a universal file in SI, from which `read` gives it back.

    ASCII files keep 13 digits of FRFs, coherences and variances and 7 of a frequency axis; binary
    files keep everything. The file is complete before it replaces an earlier one.

    Transducers whose names are all whole numbers keep them as node numbers. Otherwise sensors are
    numbered from 1 and actuators from 101 (or above the last sensor), and ID line 5 of each
    function records the names of its pair as JSON; ID line 4 records averages and force level.

    Parameters
    ----------
    path
        The file; an existing one is replaced.
    measurement
        What to write. Transducers without recorded position get no coordinates, and pairs that
        were not measured no function, so that channels come back in the order of those that were.
    binary
        Whether to write dataset 58b.

    Raises
    ------
    ValueError
        If a frequency axis has too many digits for ASCII, a name is too long for an ID line, or a
        channel appears twice.

    Examples
    --------
    >>> bp.io.uff.write("measured.uff", measured, binary=True)
    """
    check_distinct("sensor", measurement.sensors)
    check_distinct("actuator", measurement.actuators)
    datasets = [_units(), _nodes(measurement), *_functions(measurement, binary)]
    content = b"".join(datasets)
    write_atomically(path, lambda temporary: temporary.write_bytes(content))


def _text(*lines: str) -> bytes:
    return "".join(f"{line}\n" for line in lines).encode("ascii", "replace")


def _dataset(number: str, *lines: str) -> bytes:
    return _text("    -1", f"{number:<80}", *lines, "    -1")


def _units() -> bytes:
    unity, zero = (f"{value:25.16e}".replace("e", "D") for value in (1.0, 0.0))
    return _dataset("   164", f"{1:10d}{'SI':>20}{1:10d}", unity * 3, zero)


def _nodes(measurement: Measurement) -> bytes:
    lines = []
    for name, node in node_numbers(measurement).items():
        if name in measurement.positions:
            coordinates = (f"{value:25.16e}" for value in measurement.positions[name])
            lines += [f"{node:10d}{0:10d}{0:10d}{0:10d}", "".join(coordinates)]
    return _dataset("  2411", *lines) if lines else b""


@arguments_checked
def node_numbers(measurement: Measurement) -> dict[str, int]:
    """Node that `write` gives to each transducer; a shared name is a single node.

    Examples
    --------
    >>> bp.io.uff.node_numbers(measured)
    {'a1': 101, 's1': 1}
    """
    sensors = list(dict.fromkeys(channel.name for channel in measurement.sensors))
    actuators = list(dict.fromkeys(channel.name for channel in measurement.actuators))
    if _named_by_node(measurement):
        return {name: int(name) for name in sensors + actuators}
    first = max(_FIRST_ACTUATOR_NODE, len(sensors) + 1)
    numbered = {name: first + index for index, name in enumerate(actuators)}
    return numbered | {name: 1 + index for index, name in enumerate(sensors)}


def _named_by_node(measurement: Measurement) -> bool:
    channels = measurement.sensors + measurement.actuators
    numbers = re.compile(rf"[1-9]\d{{0,{_NODE_DIGITS - 1}}}", re.ASCII)
    return all(numbers.fullmatch(channel.name) for channel in channels)


def _functions(measurement: Measurement, binary: bool) -> Iterator[bytes]:
    """Every FRF, then every coherence, then every variance."""
    motion, label = stated_for(measurement.quantity)
    frf = _FunctionType(
        "FRF", 4, _record(motion, "Response", label), _record(FORCE_TYPE, "Force", "N")
    )
    coherence = _FunctionType("Coherence", 6, _record(0, "Coherence", "NONE"), _record(0))
    variance = _FunctionType("Variance", 0, _record(0, "Variance", "SI"), _record(0))
    functions = (
        (frf, measurement.frf),
        (coherence, measurement.coherence),
        (variance, measurement.variance),
    )
    nodes = node_numbers(measurement)
    number = 0
    for function_type, values in functions:
        if values is None:
            continue
        for row, column in np.argwhere(~np.isnan(values).any(axis=-1)):
            number += 1
            pair = measurement.sensors[row], measurement.actuators[column]
            header = [
                *_identity(measurement, function_type.name, pair),
                _pair(function_type, pair, nodes, number),
            ]
            yield _function(
                header, function_type, measurement.frequency, values[row, column], binary
            )


def _record(data_type: int, axis: str = "NONE", unit: str = "NONE") -> str:
    return f"{data_type:10d}{0:5d}{0:5d}{0:5d} {axis:<20} {unit:<20}"


def _identity(measurement: Measurement, title: str, pair: tuple[Channel, Channel]) -> list[str]:
    """Five ID lines; the last two hold what the format has no field for."""
    sensor, actuator = pair
    settings = {"averages": measurement.averages, "force_level": measurement.force_level}
    known = {key: value for key, value in settings.items() if value is not None}
    note = VARIANCE_NOTE if title == "Variance" else _note(known)
    heading = f"{title} {sensor.label} / {actuator.label}"[:_ID_WIDTH]
    names = {} if _named_by_node(measurement) else {"names": [sensor.name, actuator.name]}
    return [f"{line:<80}" for line in (heading, "NONE", "NONE", note, _note(names))]


def _note(content: Json) -> str:
    text = json.dumps(content) if content else "NONE"
    if len(text) > _ID_WIDTH:
        raise InputError(
            f"{text} cannot be written, since an ID line of a universal file holds {_ID_WIDTH} "
            "characters; shorter names are needed, which can be read back. Rename "
            "the transducers: Measurement.from_arrays(..., sensors=['s1'])."
        )
    return text


def _pair(
    function_type: _FunctionType, pair: tuple[Channel, Channel], nodes: dict[str, int], number: int
) -> str:
    ends = (f"{'NONE':>10}{nodes[channel.name]:10d}{channel.direction:4d}" for channel in pair)
    return f"{function_type.number:5d}{number:10d}{0:5d}{0:10d} {' '.join(ends)}"


def _function(
    header: list[str],
    function_type: _FunctionType,
    frequency: np.ndarray,
    values: np.ndarray,
    binary: bool,
) -> bytes:
    even = _is_even(frequency, exact=binary)
    parts = [values.real, values.imag] if np.iscomplexobj(values) else [values]
    table = np.column_stack(parts if even else [frequency, *parts])
    spacing = (frequency[0], _spacing(frequency)) if even else (0.0, 0.0)
    data_type = 2 + 2 * len(parts)  # 4: real, 6: complex, both in double precision
    lines = [
        *header,
        f"{data_type:10d}{frequency.size:10d}{int(even):10d}"
        + "".join(f"{value:13.6e}" for value in (*spacing, 0.0)),
        _record(FREQUENCY_TYPE, "Frequency", "Hz"),
        function_type.ordinate,
        function_type.denominator,
        _record(0),
    ]
    return _binary(lines, table) if binary else _ascii(lines, table, frequency, even)


def _binary(lines: list[str], table: np.ndarray) -> bytes:
    values = np.ascontiguousarray(table, dtype="<f8").tobytes()
    order, floats = _IN_LITTLE_ENDIAN_IEEE
    identity = f"    58b{order:6d}{floats:6d}{len(lines):12d}{len(values):12d}{0:6d}{0:6d}"
    return _text("    -1", f"{identity}{0:12d}{0:12d}", *lines) + values + _text("    -1")


def _ascii(lines: list[str], table: np.ndarray, frequency: np.ndarray, even: bool) -> bytes:
    if not even:
        _check_digits(frequency)
    formats = [f"{{:{width}}}" for width in ("20.12e",) * table.shape[1]]
    if not even:
        formats[0] = "{:13.6e}"
    row = "".join(formats)
    cells = [row.format(*values) for values in table]
    per_line = 1 if len(formats) == 3 else 4 // len(formats)
    filled = ["".join(cells[start : start + per_line]) for start in range(0, len(cells), per_line)]
    return _dataset("    58", *lines, *filled)


def _spacing(frequency: np.ndarray) -> float:
    """Mean spacing [Hz], as many digits as the header of dataset 58 takes."""
    steps = max(frequency.size - 1, 1)
    return float(f"{(frequency[-1] - frequency[0]) / steps:.6e}")


def _is_even(frequency: np.ndarray, exact: bool) -> bool:
    """Tell whether the first line and the spacing, as the header holds them, give every line."""
    first = float(f"{frequency[0]:.6e}")
    rebuilt = first + np.arange(frequency.size) * _spacing(frequency)
    if exact:
        return bool(np.array_equal(rebuilt, frequency))
    return bool(np.allclose(rebuilt, frequency, rtol=_HEADER_DIGITS, atol=0.0))


def _check_digits(frequency: np.ndarray) -> None:
    written = np.array([float(f"{line:.6e}") for line in frequency])
    lost = ~np.isclose(written, frequency, rtol=_HEADER_DIGITS, atol=0.0)
    if lost.any():
        raise InputError(
            f"The frequency {float(frequency[lost][0])!r} Hz cannot be written, since an ASCII "
            "universal file holds 7 digits of it; all are needed to find the line again. Write "
            "binary: uff.write(path, measurement, binary=True)."
        )


def note_of(dataset: Dataset, line: str) -> Json:
    """Return the note that `write` recorded in an ID line as JSON; empty for any other text."""
    text = dataset.fields[line].strip()
    try:
        note = json.loads(text) if text.startswith("{") else {}
    except (json.JSONDecodeError, RecursionError):
        return {}  # other programs write any text there
    _check_note(dataset, line, note)
    return note


def _check_note(dataset: Dataset, line: str, note: Json) -> None:
    """Refuse a note that `write` does not make: a changed one names the wrong channels."""
    for name, value in note.items():
        if name in _NOTES and not _NOTES[name](value):
            raise MeasurementFileError(
                f"{dataset.place} records {name}={value!r} in {line.upper()}; the note that "
                "io.uff.write makes has two names, a whole number of averages and a force above 0, "
                "since it says what the format has no field for. Correct it or clear that line."
            )


def _are_names(value: object) -> bool:
    names = value if isinstance(value, list) else []
    return len(names) == 2 and all(isinstance(name, str) and name.strip() for name in names)


_NOTES: dict[str, Accepts] = {
    "names": _are_names,
    "averages": lambda value: value is None or (type(value) is int and value >= 1),
    "force_level": lambda value: value is None or (is_number(value) and value > 0),
}
