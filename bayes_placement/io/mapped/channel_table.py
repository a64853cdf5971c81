"""Channel tables: name, node, place, direction, tolerance and sensitivity of each channel."""

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from ..._shared.errors import InputError
from ..._shared.files import Json
from ..._shared.reprs import with_short_repr
from ...positions.channel import Channel
from .. import _contents
from .._frf_units import ANGLE, LENGTH, sensitivity_unit
from .._gate import check_plausible, existing, reading
from ..arrays import text, workbook

Point = tuple[float, float, float]


@with_short_repr
class ChannelRow(NamedTuple):
    """One channel of a channel table.

    Parameters
    ----------
    name
        Name of the transducer.
    role
        `sensor` or `actuator`.
    node
        Number of its node, or None.
    position, tolerance
        Coordinates and their tolerances [m], or None.
    direction
        +-1, +-2, +-3; 0 where not stated.
    angle_tolerance
        Tolerance of its orientation [rad], or None.
    sensitivity
        Signal over what is sensed [V per SI], or None.
    senses
        Quantity of its FRF, or `force`; empty without sensitivity.

    Examples
    --------
    >>> bp.io.mapped.ChannelRow("s1", "sensor", node=12, direction=-3).label
    's1-z'
    """

    name: str
    role: str
    node: int | None = None
    position: Point | None = None
    tolerance: Point | None = None
    direction: int = 0
    angle_tolerance: float | None = None
    sensitivity: float | None = None
    senses: str = ""

    @property
    def label(self) -> str:
        """Label of the channel, such as `s1+x`."""
        return Channel(self.name, self.direction).label


_FORM = "a channel table"
_REMEDY = (
    "Its first row names the columns: name, role, node, x [mm], y [mm], z [mm], direction, "
    "tolerance [mm], sensitivity, unit."
)
_LENGTHS = {
    "x": 0,
    "y": 1,
    "z": 2,
    "position": None,
    "tolerance": None,
    "tolerance x": 0,
    "tolerance y": 1,
    "tolerance z": 2,
}
_WORDS = ("name", "role", "node", "direction", "sensitivity", "unit", "note")
_ROLES = {"sensor": "sensor", "response": "sensor", "actuator": "actuator", "reference": "actuator"}
_ROLES |= {"force": "actuator", "excitation": "actuator"}
_HEADING = re.compile(r"(?P<name>[a-z ]*[a-z])\s*(?:[\[(](?P<unit>[^\])]+)[\])])?", re.IGNORECASE)
_DIRECTION = re.compile(r"(?P<sign>[+-]?)(?P<axis>[xyz123])", re.IGNORECASE)


def read(path: Path) -> list[ChannelRow]:
    """Read a channel table from a workbook (its first sheet with a column `name`) or from text."""
    with reading(existing(path, _FORM), _FORM, _REMEDY), _with_remedy(path):
        heading, cells = _rows(path)
        columns = _columns(heading)
        rows = [_row(number, columns, row) for number, row in enumerate(cells, start=2)]
        check_plausible(path, positions=[row.position for row in rows if row.position])
        return _checked(rows)


@contextmanager
def _with_remedy(path: Path) -> Iterator[None]:
    """Say what a channel table is where an error says only what is wrong."""
    try:
        yield
    except InputError as error:
        if str(error).endswith("."):
            raise
        raise type(error)(f"{path}: {error}. {_REMEDY}") from error


def of_mapping(place: str, channels: Json) -> list[ChannelRow]:
    """Read the table `channels` of a mapping, with lengths in m, by the names of transducers."""
    rows = []
    for name, fields in channels.items():
        if not isinstance(fields, dict):
            raise InputError(f"{place}: channels.{name} is {fields!r}; a table is needed there.")
        known = {key.replace("_", " "): value for key, value in fields.items()}
        columns = _columns(["name", *(_with_unit(key) for key in known)])
        rows.append(_row(name, columns, [name, *map(_as_cell, known.values())]))
    with reading(Path(place), "channels of a mapping", "Correct `channels` there."):
        return _checked(rows)


def is_channel_table(path: Path) -> bool:
    """Whether a file is a table whose columns are those of channels."""
    try:
        return bool(read(path))
    except InputError:
        return False


def check_is_none(path: Path) -> None:
    """Refuse a channel table, complete or not, where measured FRFs are needed."""
    if _contents.content_of(path) not in (_contents.TEXT, _contents.WORKBOOK):
        return
    try:
        heading = {cell.strip().lower() for cell in _rows(path)[0]}
    except InputError:  # as of a table whose rows have different lengths
        return
    if "name" in heading and heading & {"role", "type"}:
        raise InputError(
            f"{path} is {_FORM}: it has the columns name and role, and no FRFs; the file of the "
            "measured FRFs is needed here. Give that file, and name the table in its mapping: "
            f'channels = "{path.name}"'
        )


def _with_unit(key: str) -> str:
    return f"{key} [m]" if key in _LENGTHS else f"{key} [rad]" if key == "angle tolerance" else key


def _as_cell(value: object) -> str:
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)


def _rows(path: Path) -> tuple[list[str], list[list[str]]]:
    """Heading and rows as texts."""
    if _contents.content_of(path) == _contents.WORKBOOK:
        for rows in workbook.read_sheets(path).values():
            if rows and "name" in [cell.lower() for cell in rows[0]]:
                return rows[0], rows[1:]
        raise InputError("no sheet of it has a column `name` in its first row")
    table = text.read_table(path)
    return table.names, table.cells


class _Column(NamedTuple):
    """A column: its word in lower case, and the factor of its unit to SI."""

    word: str
    factor: float


def _columns(heading: list[str]) -> list[_Column]:
    columns = [_column(cell) for cell in heading]
    words = [column.word for column in columns]
    twice = [word for word in words if word and words.count(word) > 1]
    if twice:
        raise InputError(f"two columns are named {twice[0]!r}, and either could be meant")
    return columns


def _column(cell: str) -> _Column:
    match = _HEADING.fullmatch(cell.strip().replace("_", " "))
    word = match["name"].strip().lower() if match else cell
    unit = match["unit"] if match else None
    word = {"type": "role", "position x": "x", "position y": "y", "position z": "z"}.get(word, word)
    if word in _LENGTHS:
        return _Column(word, _factor(cell, unit, LENGTH, "mm"))
    if word == "angle tolerance":
        return _Column(word, _factor(cell, unit, ANGLE, "deg"))
    if word not in _WORDS:
        known = ", ".join((*_WORDS, *_LENGTHS, "angle tolerance"))
        raise InputError(f"the column {cell!r} is not known; known are {known}")
    return _Column(word, 1.0)


def _factor(cell: str, unit: str | None, known: dict[str, float], example: str) -> float:
    if unit is None or unit.strip() not in known:
        raise InputError(
            f"the column {cell!r} has no unit of {', '.join(known)}; write it behind the name, "
            f"such as {cell.split('[')[0].strip()} [{example}]"
        )
    return known[unit.strip()]


def _row(number: int | str, columns: list[_Column], cells: list[str]) -> ChannelRow:
    filled = {
        column.word: (cell.strip(), column.factor)
        for column, cell in zip(columns, cells, strict=True)
        if cell.strip()
    }
    try:
        return _of_cells(filled)
    except InputError as error:
        raise InputError(f"row {number}: {error}") from error


def _of_cells(cells: dict[str, tuple[str, float]]) -> ChannelRow:
    name, role = (cells.get(word, ("", 1.0))[0] for word in ("name", "role"))
    if not name or role.lower() not in _ROLES:
        raise InputError(
            f"its name is {name!r} and its role {role!r}; a name and one of sensor, actuator are "
            "needed"
        )
    sensitivity = _sensitivity(cells)
    return ChannelRow(
        name,
        _ROLES[role.lower()],
        _read(cells, "node", _node, "a whole number of at least 1"),
        _point(cells, ("x", "y", "z"), "position"),
        _tolerance(cells),
        _read(cells, "direction", _direction, "a direction such as +x or -z") or 0,
        _read(cells, "angle tolerance", _not_negative, "a number that is not negative"),
        *sensitivity,
    )


def _read(
    cells: dict[str, tuple[str, float]],
    word: str,
    convert: Callable[[str, float], Any],
    needed: str,
) -> Any:
    """Value of a cell, None where it is empty."""
    if word not in cells:
        return None
    value = convert(*cells[word])
    if value is None:
        raise InputError(f"its {word} is {cells[word][0]!r}; {needed} is needed there")
    return value


def _node(cell: str, factor: float) -> int | None:
    number = _number(cell, factor)
    return int(number) if number is not None and number >= 1 and number == int(number) else None


def _number(cell: str, factor: float) -> float | None:
    if not text.is_number(cell) or not math.isfinite(float(cell)):
        return None
    return float(cell) * factor


def _not_negative(cell: str, factor: float) -> float | None:
    number = _number(cell, factor)
    return number if number is not None and number >= 0 else None


def _direction(cell: str, factor: float) -> int | None:
    match = _DIRECTION.fullmatch(cell.strip())
    if match is None:
        return None
    axis = "xyz123".index(match["axis"].lower()) % 3 + 1
    return -axis if match["sign"] == "-" else axis


def _numbers(cell: str, factor: float) -> tuple[float, ...] | None:
    """One to three numbers, with blanks or semicolons between them."""
    numbers = [_number(part, factor) for part in re.split(r"[;\s]+", cell.strip(" []"))]
    known = [number for number in numbers if number is not None]
    return tuple(known) if len(known) == len(numbers) and len(known) in (1, 3) else None


def _point(
    cells: dict[str, tuple[str, float]], words: tuple[str, ...], together: str
) -> Point | None:
    """Three coordinates, from three columns or from one."""
    apart = [_read(cells, word, _number, "a number") for word in words]
    if together in cells:
        values = _read(cells, together, _numbers, "three numbers")
        if len(values) != 3 or any(value is not None for value in apart):
            raise InputError(f"its {together} is {cells[together][0]!r}; three numbers are needed")
        return values
    if all(value is None for value in apart):
        return None
    if any(value is None for value in apart):
        raise InputError(f"it has some of {', '.join(words)} and not all; all three are needed")
    return (apart[0], apart[1], apart[2])


def _tolerance(cells: dict[str, tuple[str, float]]) -> Point | None:
    """Tolerances along x, y and z; one number holds for all three."""
    if "tolerance" in cells:
        values = _read(cells, "tolerance", _numbers, "one number, or three,")
        values = values * 3 if len(values) == 1 else values
    else:
        values = _point(cells, ("tolerance x", "tolerance y", "tolerance z"), "tolerance")
    if values is not None and min(values) < 0:
        raise InputError(f"its tolerance is {values} m; none may be negative")
    return values


def _sensitivity(cells: dict[str, tuple[str, float]]) -> tuple[float | None, str]:
    number = _read(cells, "sensitivity", _number, "a number")
    if number is None:
        return None, ""
    label = cells.get("unit", ("", 1.0))[0]
    unit = sensitivity_unit(label)
    if unit is None or number == 0:
        raise InputError(
            f"its sensitivity is {number:g} in the unit {label!r}; one that is not 0, in a unit "
            "such as mV/(m/s^2), mV/g or mV/N, is needed"
        )
    return number * unit.factor, unit.quantity


def _checked(rows: list[ChannelRow]) -> list[ChannelRow]:
    """Refuse channels that occur twice, and rows of one transducer that contradict each other."""
    first: dict[str, ChannelRow] = {}
    labels: set[str] = set()
    for row in rows:
        if row.label in labels:
            raise InputError(f"the channel {row.label} occurs twice, and either could be meant")
        labels.add(row.label)
        known = first.setdefault(row.name, row)
        shared = ("role", "node", "position", "tolerance", "angle_tolerance")
        for field in shared:
            if getattr(known, field) != getattr(row, field):
                raise InputError(
                    f"two rows of {row.name} have the {field} {getattr(known, field)} and "
                    f"{getattr(row, field)}; a transducer has one"
                )
    return rows
