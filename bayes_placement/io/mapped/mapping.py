"""What a file does not say itself, in a mapping (TOML): axes, names, units, and the case."""

import json
from collections.abc import Mapping as Dictionary
from pathlib import Path
from typing import NamedTuple

from ..._shared.arguments import check_kind
from ..._shared.errors import InputError
from ..._shared.files import Json
from ..._shared.reprs import with_short_repr
from .._gate import is_number
from ._toml_fields import TomlTable, are_texts, is_column, is_text, load

AXES = ("frequency", "sensor", "actuator")
CONVENTIONS = {"exp(+i w t)": False, "exp(-i w t)": True}
PARTS = (
    ("array",),
    ("real", "imaginary"),
    ("magnitude", "degrees"),
    ("magnitude", "radians"),
    ("decibel", "degrees"),
    ("decibel", "radians"),
)
_PART_NAMES = ("array", "real", "imaginary", "magnitude", "decibel", "degrees", "radians")
PARTS_NEEDED = (
    "real and imaginary, or magnitude or decibel with degrees or radians, or array (complex)"
)
_FRF_FIELDS = (*_PART_NAMES, "axes", "unit", "sensor", "actuator", "coherence")
_FREQUENCY_FIELDS = ("array", "first", "step", "unit")
KNOWN = (
    "file",
    "channels",
    "frf",
    "coherence",
    "frequency",
    "sensors",
    "actuators",
    "unit",
    "averages",
    "force_level",
    "length_unit",
    "convention",
    "case",
    "note",
)

Column = str | int


class FrequencyRule(NamedTuple):
    """Where the lines are: in an array, or evenly from a first one; numbers may be array names."""

    array: Column | None
    first: float | str | None
    step: float | str | None
    unit: str | None


class FrfRule(NamedTuple):
    """Where FRFs are.

    `parts` are arrays by what they hold: `array`, or `real` and `imaginary`, or `magnitude` or
    `decibel` with `degrees` or `radians`. Their axes are None where there is one sensor and one
    actuator, the unit where the file states it, the channels where the arrays hold all pairs.
    """

    parts: dict[str, Column]
    axes: tuple[str, ...] | None
    unit: str | None
    sensor: str | None = None
    actuator: str | None = None
    coherence: Column | None = None


@with_short_repr
class Mapping(NamedTuple):
    """What a mapping says; None or empty where it says nothing.

    Parameters
    ----------
    place
        Where it comes from, for messages; empty where there is no mapping.
    folder
        Folder in which the files that it names are; None where there is no mapping.
    file, channels
        Names of the files of the data and of the channel table.
    frf
        Rules of the FRFs.
    unit
        Unit of the FRFs whose rule has none.
    coherence
        Array of the coherence.
    coherence_axes
        Its axes; None for those of the FRFs.
    frequency
        Rule of the lines.
    sensors, actuators
        Labels, or the name of an array of texts.
    averages, force_level
        As in `Measurement`.
    length_unit
        What one unit of the coordinates of a universal file is [m], where it does not say it.
    conjugate
        Whether the file was made under exp(-i w t).
    case
        Fields for a case folder.

    Examples
    --------
    >>> bp.io.mapped.Mapping(sensors=("s1",), averages=8).averages
    8
    """

    place: str = ""
    folder: Path | None = None
    file: str | None = None
    channels: str | Json | None = None
    frf: tuple[FrfRule, ...] = ()
    unit: str | None = None
    coherence: Column | None = None
    coherence_axes: tuple[str, ...] | None = None
    frequency: FrequencyRule | None = None
    sensors: tuple[str, ...] | str | None = None
    actuators: tuple[str, ...] | str | None = None
    averages: int | None = None
    force_level: float | None = None
    length_unit: float | None = None
    conjugate: bool = False
    case: Json | None = None


def read(source: object) -> Mapping:
    """Read a mapping from a TOML file, or from a dictionary of the same fields."""
    if source is None:
        return Mapping()
    needed = "the path of a TOML file or a dictionary is needed, which says what the file does not"
    check_kind("mapping", source, (str, Path, Dictionary), needed, 'mapping="measured.toml"')
    if isinstance(source, Dictionary):
        return of_table(TomlTable(dict(source), "mapping"), Path())
    path = Path(str(source))
    return of_table(load(path), path.parent)


def of_table(table: TomlTable, folder: Path) -> Mapping:
    """Check the fields of a mapping."""
    table.check_known(KNOWN)
    unit = table.text("unit", "(m/s^2)/N")
    convention = table.value(
        "convention",
        lambda value: isinstance(value, str) and value in CONVENTIONS,
        f"one of {', '.join(CONVENTIONS)}",
        'convention = "exp(+i w t)"',
    )
    return Mapping(
        table.place,
        folder,
        file=_file_name(table, "file", "measured.mat"),
        channels=_channels(table),
        frf=_frf_rules(table, unit),
        unit=unit,
        **_coherence(table),
        frequency=_frequency(table),
        sensors=_labels(table, "sensors", '["s1+x", "s2+x"]'),
        actuators=_labels(table, "actuators", '["a1+x"]'),
        averages=table.value(
            "averages",
            lambda value: type(value) is int and value >= 1,
            "a whole number of at least 1",
            "averages = 16",
        ),
        force_level=table.number("force_level", "1.0", least=0.0),
        length_unit=table.number("length_unit", "1e-3", least=0.0),
        conjugate=CONVENTIONS[convention or "exp(+i w t)"],
        case=table.value("case", _is_table, "a table", "[case]"),
    )


def _file_name(table: TomlTable, name: str, example: str) -> str | None:
    """Name of a file in the folder of the mapping; no path leads out of it."""
    return table.value(
        name,
        lambda value: is_text(value) and value == Path(value).name and value not in (".", ".."),
        "the name of a file in the folder of the mapping",
        f'{name} = "{example}"',
    )


def _channels(table: TomlTable) -> str | Json | None:
    if _is_table(table.content.get("channels")):
        return table.content["channels"]
    return _file_name(table, "channels", "channels.xlsx")


def _frf_rules(table: TomlTable, unit: str | None) -> tuple[FrfRule, ...]:
    rules = table.value(
        "frf",
        lambda value: _is_table(value) or (isinstance(value, list) and all(map(_is_table, value))),
        "a table, or a list of tables, one for each pair,",
        'frf = { array = "H", axes = ["frequency", "sensor", "actuator"], unit = "(m/s^2)/N" }',
    )
    if rules is None:
        return ()
    if _is_table(rules):
        return (_frf_rule(TomlTable(rules, table.place, "frf"), unit, pair=False),)
    tables = [TomlTable(item, table.place, f"frf[{number}]") for number, item in enumerate(rules)]
    return tuple(_frf_rule(item, unit, pair=True) for item in tables)


def _frf_rule(table: TomlTable, unit: str | None, *, pair: bool) -> FrfRule:
    table.check_known(_FRF_FIELDS)
    names = tuple(name for name in _PART_NAMES if name in table.content)
    if names not in PARTS:
        raise _incomplete(table, names)
    needed = "the name of an array, or the number of a column from 1,"
    parts: Json = {name: table.value(name, is_column, needed, f'{name} = "H"') for name in names}
    channels = {"sensor", "actuator"} & table.content.keys()
    if len(channels) == 1 or (pair and not channels):
        raise table.error(
            "sensor" if "actuator" in table.content else "actuator",
            "the label of a channel of each pair",
            '[[frf]] with sensor = "s1+x" and actuator = "a1+x"',
        )
    return FrfRule(
        parts,
        _axes(table),
        table.text("unit", "(m/s^2)/N") or unit,
        table.text("sensor", "s1+x"),
        table.text("actuator", "a1+x"),
        table.value("coherence", is_column, needed, 'coherence = "C"'),
    )


def _incomplete(table: TomlTable, names: tuple[str, ...]) -> InputError:
    """Error of a rule that names too few arrays or too many, with what is there kept."""
    needed = next((parts for parts in PARTS if len({*parts} & {*names}) == 1), PARTS[1])
    examples = {"real": "Re", "imaginary": "Im", "array": "H"}
    line = ", ".join(
        f"{part} = {_as_toml(table.content.get(part, examples.get(part, part)))}" for part in needed
    )
    return InputError(
        f"{table.place}: {table.path} names {' and '.join(names) or 'no array'}; one of these is "
        f"needed, since FRFs are complex: {PARTS_NEEDED}. For example, write {line} there."
    )


def _as_toml(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, default=str)


def _axes(table: TomlTable) -> tuple[str, ...] | None:
    value = table.value(
        "axes",
        lambda value: are_texts(value) and set(value) <= set(AXES) and len({*value}) == len(value),
        f"a list of {', '.join(AXES)}, in the order of the array, each once,",
        'axes = ["frequency", "sensor", "actuator"]',
    )
    return None if value is None else tuple(value)


def _coherence(table: TomlTable) -> Json:
    if not _is_table(table.content.get("coherence")):
        needed = "the name of an array, or a table with `array` and `axes`,"
        return {"coherence": table.value("coherence", is_column, needed, 'coherence = "C"')}
    inner = TomlTable(table.content["coherence"], table.place, "coherence")
    inner.check_known(("array", "axes"))
    name = inner.value("array", is_column, "the name of an array", 'array = "C"')
    if name is None:
        raise inner.error("array", "the name of an array", 'coherence = { array = "C" }')
    return {"coherence": name, "coherence_axes": _axes(inner)}


def _frequency(table: TomlTable) -> FrequencyRule | None:
    example = 'frequency = { array = "f", unit = "Hz" }'
    value = table.content.get("frequency")
    if value is None:
        return None
    if is_column(value):
        return FrequencyRule(value, None, None, None)
    if not _is_table(value):
        raise table.error("frequency", "an array with its unit, or first and step,", example)
    inner = TomlTable(value, table.place, "frequency")
    inner.check_known(_FREQUENCY_FIELDS)
    rule = FrequencyRule(
        inner.value("array", is_column, "the name of an array", 'array = "f"'),
        inner.value("first", _is_number_or_name, "a number [unit]", "first = 10.0"),
        inner.value("step", _is_number_or_name, "a number [unit]", "step = 0.5"),
        inner.text("unit", "Hz"),
    )
    if (rule.array is None) != (rule.first is not None and rule.step is not None):
        raise table.error("frequency", "either an array, or first and step,", example)
    return rule


def _labels(table: TomlTable, name: str, example: str) -> tuple[str, ...] | str | None:
    value = table.value(
        name,
        lambda value: are_texts(value) or is_text(value),
        "a list of labels in their order, or the name of an array of texts,",
        f"{name} = {example}",
    )
    return tuple(value) if isinstance(value, list) else value


def _is_number_or_name(value: object) -> bool:
    return is_number(value) or is_text(value)


def _is_table(value: object) -> bool:
    return isinstance(value, dict)
