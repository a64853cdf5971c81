"""The lines of a mapping that a file needs, written for the arrays that it holds."""

import json
import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ..._shared.errors import InputError
from .._frf_units import FREQUENCY, plain
from ..arrays import NamedArrays
from ._headings import (
    ANGLES,
    FIRSTS,
    PartPair,
    columns_by_part,
    first_pair,
    of_same,
    part_of,
    part_of_column,
    partners_of,
    said_of,
)
from ._values import name_of, one_axis, stated_units
from .mapping import AXES, PARTS, FrequencyRule, FrfRule, Mapping

_MOST_SHOWN = 12
_OPEN = "unknown"
_FIRST, _STEP = "x_values.start_value", "x_values.increment"


def check_complete(
    mapping: Mapping, source: NamedArrays, table_labels: dict[str, list[str]]
) -> None:
    """Refuse arrays of which neither file, channel table nor mapping says what they are."""
    if not mapping.frf:
        _check_numbers(source)
        _check_second_parts(source)
    lines = list(_missing(mapping, source, table_labels))
    if not lines:
        return
    target = _target(mapping, source)
    first = [] if mapping.file or mapping.place else [f"file = {_quoted(source.path.name)}"]
    raise InputError(
        f"{source.path} holds {described(source.arrays)}, and nothing says "
        f"{', nor '.join(what for what, _ in lines)}; a mapping must say so, since nothing is "
        f"guessed. {target}, corrected:\n\n" + "\n".join([*first, *(line for _, line in lines)])
    )


def _check_numbers(source: NamedArrays) -> None:
    """Refuse a file that can hold no FRFs: no mapping makes them of it."""
    if any(values.dtype.kind in "iufc" and values.size > 1 for values in source.arrays.values()):
        return
    raise InputError(
        f"{source.path} holds {described(source.arrays)}; a column or an array of at least two "
        "numbers is needed, since FRFs are given at several frequencies. Give the file of the "
        "measured FRFs, or export it again with its numbers."
    )


def _check_second_parts(source: NamedArrays) -> None:
    """Refuse columns that, by their headings, are one part of FRFs each time: none has another."""
    columns = _real_columns(source)
    first = next((name for name, part in columns.items() if part in FIRSTS), None)
    if first is None or {None, *partners_of(columns[first])} & {*columns.values()}:
        return
    part, second = columns[first], "a phase in degrees or radians"
    if part == "real":
        second = "an imaginary part"
    raise InputError(
        f"{source.path} holds {described(source.arrays)}; beside {_quoted(first)}, by its heading "
        f"{part}, no column can be {second}, and both are needed, since an FRF is complex. Export "
        "both parts of each FRF."
    )


def described(arrays: dict[str, np.ndarray]) -> str:
    """Names, kinds and sizes of arrays, briefly."""
    shown = [f"{name} ({_kind(values)})" for name, values in arrays.items()]
    more = f" and {len(shown) - _MOST_SHOWN} more" if len(shown) > _MOST_SHOWN else ""
    return (", ".join(shown[:_MOST_SHOWN]) or "no array") + more


def _kind(values: np.ndarray) -> str:
    size = " x ".join(map(str, values.shape)) or "1"
    return f"{size}{', complex' if values.dtype.kind == 'c' else ''}" + (
        ", text" if values.dtype.kind == "U" else ""
    )


def _target(mapping: Mapping, source: NamedArrays) -> str:
    if mapping.place:
        return f"Add these lines at the top of {mapping.place}"
    suggested = source.path.with_suffix(".toml")
    return f"Save these lines as {suggested} and give that file in its place (or as --mapping)"


def _missing(
    mapping: Mapping, source: NamedArrays, labels: dict[str, list[str]]
) -> Iterable[tuple[str, str]]:
    """What is missing in words, and the line that says it."""
    frf_line = _frf_line(source, mapping)
    if not mapping.frf:
        yield "which array holds the FRFs, with which axes and unit", frf_line
    elif any(not _has_unit(rule, source) for rule in mapping.frf):
        yield "in which unit the FRFs are", 'unit = "(m/s^2)/N"  # at the top of the mapping'
    if mapping.frequency is None:
        yield "at which frequencies", _frequency_line(source)
    elif _unit(mapping.frequency, source) is None:
        yield "in which unit the frequencies are", _frequency_line(source, mapping)
    columns = not mapping.frf and "frf = [" in frf_line
    single = columns or (mapping.frf and all(rule.sensor and rule.actuator for rule in mapping.frf))
    sizes = _sizes_of_axes(source, mapping)
    for name in ("sensors", "actuators"):
        if not single and getattr(mapping, name) is None:
            count = sizes[name.removesuffix("s")]
            known = labels.get(name) or [f"{name[0]}{number}+x" for number in range(1, count + 1)]
            label_list = ", ".join(map(_quoted, known))
            yield f"of which {name}", f"{name} = [{label_list}]  # in the order of the array"


def _has_unit(rule: FrfRule, source: NamedArrays) -> bool:
    """Whether mapping or file says the unit of FRFs; decibels and angles are none."""
    columns = rule.parts.values()
    return bool(rule.unit or (source.units and stated_units(source, columns)))


def _unit(rule: FrequencyRule, source: NamedArrays) -> str | None:
    """Unit of frequencies by the mapping, or else by the file."""
    if rule.unit is not None or rule.array is None or not source.units:
        return rule.unit or None
    return source.units.get(name_of(source, rule.array))


def _numbers(source: NamedArrays) -> dict[str, np.ndarray]:
    """Arrays that may hold FRFs, those of complex numbers alone where there are some."""
    several = {
        name: values
        for name, values in source.arrays.items()
        if values.dtype.kind in "iufc" and values.size > 1
    }
    of_complex = {name: values for name, values in several.items() if values.dtype.kind == "c"}
    return of_complex or several


def _named_as_frfs(source: NamedArrays) -> list[str]:
    """Arrays that their names say are FRFs, else those of which they say nothing."""
    said = {name: said_of(name) for name in _numbers(source)}
    named = [name for name, is_frf in said.items() if is_frf]
    return named or [name for name, is_frf in said.items() if is_frf is None]


def _frf_line(source: NamedArrays, mapping: Mapping) -> str:
    """Line that says which array holds the FRFs; all that it can be, where names leave it open."""
    numbers = _numbers(source)
    if all(values.dtype.kind != "c" for values in numbers.values()):
        flat = all(values.ndim == 1 for values in numbers.values())
        return _columns_line(source, mapping) if flat else _block_of_parts(source, mapping)
    chosen = _named_as_frfs(source)
    said = [name for name in chosen if said_of(name)]
    blocks = [name for name in chosen if numbers[name].squeeze().ndim > 1]
    is_open = not chosen or len(blocks) > 1 or (len(chosen) > 1 and not said)
    if is_open:
        lines = [_complex_line([name], source, mapping) for name in numbers]
        return _question("Which array holds the FRFs, the names do not say", lines)
    return _complex_line(blocks or chosen, source, mapping)


def _question(what: str, lines: Iterable[str]) -> str:
    """Lines of which one is to be chosen; as comments, so that none is taken before."""
    head = f"# {what}: take away the # before what is right."
    return "\n".join([head, *(f"# {line}" for line in lines)])


def _complex_line(names: list[str], source: NamedArrays, mapping: Mapping) -> str:
    """Line of one array of all pairs, or of arrays of one pair each."""
    unit = "" if mapping.unit else ', unit = "(m/s^2)/N"'
    values = source.arrays[names[0]]
    if values.squeeze().ndim > 1:
        size = " x ".join(map(str, values.shape))
        line = f"frf = {{ array = {_quoted(names[0])}, axes = {_axes(source, values)}{unit} }}"
        return f"{line}  # in the order of {size} numbers"
    alike = [name for name, known in source.arrays.items() if known.size == values.size]
    coherences = [name for name in alike if part_of(name) == "coherence"]
    pairs = [
        f'{{ sensor = "s{number}+x", actuator = "a1+x", array = {_quoted(name)}'
        f"{_coherence_of(name, coherences)}{unit} }}"
        for number, name in enumerate(names, start=1)
    ]
    return f"frf = [{', '.join(pairs)}]  # one table for each pair"


def _coherence_of(name: str, coherences: list[str]) -> str:
    found = of_same(name, coherences)
    return f", coherence = {_quoted(found)}" if found else ""


def _axes(source: NamedArrays, values: np.ndarray) -> str:
    names = ", ".join(f'"{axis}"' for axis in _order_of_axes(source, values))
    return f"[{names}]"


def _order_of_axes(source: NamedArrays, values: np.ndarray) -> list[str]:
    """Axes of an array: that of the lines is as long as a rising array, else the longest."""
    lines = {one_axis(known).size for known in source.arrays.values() if _is_axis(known)}
    shape = values.shape[: len(AXES)]
    fitting = [place for place, size in enumerate(shape) if size in lines and size > 1]
    frequency = fitting[0] if fitting else int(np.argmax(shape or (0,)))
    order = [axis for axis in AXES if axis != "frequency"]
    order.insert(frequency, "frequency")
    return order


def _sizes_of_axes(source: NamedArrays, mapping: Mapping) -> dict[str, int]:
    """Numbers of sensors and actuators by the shape of the array of the FRFs."""
    sizes = dict.fromkeys(("sensor", "actuator"), 1)
    named = [*mapping.frf[0].parts.values()] if mapping.frf else _named_as_frfs(source)[:1]
    values = next((source.arrays[str(name)] for name in named if name in source.arrays), None)
    if values is None or values.ndim < 2:
        return sizes
    axes = (mapping.frf[0].axes if mapping.frf else None) or _order_of_axes(source, values)
    return sizes | dict(zip(axes, values.shape, strict=False))


def _block_of_parts(source: NamedArrays, mapping: Mapping) -> str:
    """Line of two real arrays of all pairs, by what their names say of their parts."""
    numbers = {n: values for n, values in _numbers(source).items() if values.ndim > 1}
    pair = first_pair(columns_by_part(source, [n for n in numbers if said_of(n) is not False]))
    unit = "" if mapping.unit else ', unit = "(m/s^2)/N"'
    values = (
        next(iter(numbers.values())) if pair is None else numbers[next(iter(pair.parts.values()))]
    )
    parts = dict(pair.parts) if pair else {"real": "NAME OF THE REAL PART", "imaginary": "NAME"}
    fields = ", ".join(f"{part} = {_quoted(name)}" for part, name in parts.items())
    line = f"frf = {{ {fields}, axes = {_axes(source, values)}{unit} }}"
    if pair is not None and "phase" not in parts:
        return f"{line}  # in the order of {' x '.join(map(str, values.shape))} numbers"
    others = (
        "# Modes are read by bp.io.modal_parameters.read, matrices by bp.io.read_matrices, time "
    )
    open_line = _question("Which arrays are the parts of the FRFs, the names do not say", [line])
    return f"{open_line}\n{others}records by bp.time_records.read."


def _columns_line(source: NamedArrays, mapping: Mapping) -> str:
    """Line that says which columns are a pair; where headings leave it open, all lines it can be.

    These are comments, so that none is taken before one of them is chosen.
    """
    columns = _real_columns(source)
    pair = first_pair(columns) or _unknown_pair(columns)
    lines = [
        _pair_line(dict(zip(parts, pair.parts.values(), strict=True)), pair, source, mapping)
        for parts in PARTS
        if len(parts) == 2 and all(map(_may_be, parts, pair.parts))
    ]
    if len(lines) == 1 and not any(part.startswith(_OPEN) for part in pair.parts):
        return f"{lines[0]}  # one table for each pair"
    return _question("Which parts they are, the headings do not say", lines)


def _real_columns(source: NamedArrays) -> dict[str, str | None]:
    """Columns of real numbers but the frequency, with the part that their headings say.

    None where there are arrays that are no columns, or complex ones.
    """
    if any(values.dtype.kind == "c" or values.ndim > 1 for values in _numbers(source).values()):
        return {}
    axis = _axis(source)
    size = max(values.size for values in source.arrays.values() if values.dtype.kind in "iuf")
    numbers = [
        name
        for name, values in source.arrays.items()
        if values.dtype.kind in "iuf" and values.size == size and name != axis
    ]
    return columns_by_part(source, numbers)


def _may_be(part: str, heading_part: str) -> bool:
    """Whether a column of which a heading says something may be a part."""
    return (
        part == heading_part
        or heading_part.startswith(_OPEN)
        or (heading_part == "phase" and part in ANGLES)
    )


def _unknown_pair(columns: dict[str, str | None]) -> PartPair:
    """Return the columns that may be a pair: one whose heading says a part, and those that do not.

    Parts that no heading says, and columns that are not there, have names of their own.
    """
    first = next((name for name, part in columns.items() if part in FIRSTS), None)
    seconds = partners_of(columns[first]) if first else ("imaginary", *ANGLES)
    angle = next((name for name, part in columns.items() if part in seconds), None)
    unknown = [name for name, part in columns.items() if part is None]
    first = first or (unknown.pop(0) if unknown else "NAME OF THE FIRST PART")
    angle = angle or (unknown.pop(0) if unknown else "NAME OF THE SECOND PART")
    known = [columns.get(name) or f"{_OPEN}{number}" for number, name in enumerate((first, angle))]
    return PartPair(dict(zip(known, (first, angle), strict=True)), None)


def _pair_line(parts: dict[str, str], pair: PartPair, source: NamedArrays, mapping: Mapping) -> str:
    named = {**parts, **({"coherence": pair.coherence} if pair.coherence else {})}
    fields = ", ".join(f"{part} = {_quoted(name)}" for part, name in named.items())
    read = [name for name in pair.parts.values() if name in source.arrays]
    known = mapping.unit or (source.units and stated_units(source, read))
    unit = "" if known else ', unit = "(m/s^2)/N"'
    return f'frf = [{{ sensor = "s1+x", actuator = "a1+x", {fields}{unit} }}]'


def _frequency_line(source: NamedArrays, mapping: Mapping | None = None) -> str:
    if mapping is not None and mapping.frequency is not None and mapping.frequency.array:
        return f'frequency = {{ array = {_quoted(str(mapping.frequency.array))}, unit = "Hz" }}'
    arrays = source.arrays
    for first in (name for name in arrays if name.endswith(_FIRST)):  # as Simcenter Testlab writes
        step = first.removesuffix(_FIRST) + _STEP
        if step in arrays:
            return (
                f'frequency = {{ first = {_quoted(first)}, step = {_quoted(step)}, unit = "Hz" }}'
            )
    axis = _axis(source)
    if axis is not None:
        unit = f'unit = "{source.units.get(axis) or _unit_in_name(axis)}"'
        return f"frequency = {{ array = {_quoted(axis)}, {unit} }}"
    return 'frequency = { first = 10.0, step = 0.5, unit = "Hz" }'


def _unit_in_name(name: str) -> str:
    """Unit of a frequency that stands in its name without brackets, such as `f kHz`."""
    words = [word.strip("_.,:;") for word in re.split(r"[\s_]+", name.lower())]
    return next((unit for unit in FREQUENCY if unit.lower() in words), "Hz")


def _quoted(name: str) -> str:
    """A text as TOML writes it, which is as JSON does."""
    return json.dumps(name, ensure_ascii=False)


def _axis(source: NamedArrays) -> str | None:
    """Array that is most likely the frequency: it rises, as long as others, and is no part."""
    numbers = _numbers(source)
    rising = [
        name
        for name, values in source.arrays.items()
        if _is_axis(values)
        and part_of_column(source, name) is None
        and any(
            one_axis(values).size in other.shape for key, other in numbers.items() if key != name
        )
    ]
    named = [
        name
        for name in rising
        if name[:1].lower() == "f" or plain(source.units.get(name, "")) in FREQUENCY
    ]
    return next(iter([*named, *rising]), None)


def _is_axis(values: np.ndarray) -> bool:
    """Whether an array rises as an axis does."""
    flat = one_axis(values)
    return flat.dtype.kind in "iuf" and flat.ndim == 1 and bool(np.all(np.diff(flat) > 0))


def file_needed(folder: Path, names: list[str]) -> InputError:
    """Error of a folder of which nobody says what its files are."""
    file_list = ", ".join(names) or "no file"
    return InputError(
        f"{folder} holds {file_list}, and nothing says which is which; a mapping in it must say "
        'so, since nothing is guessed. Save as measured.toml there:\n\nfile = "measured.uff"\n'
        'channels = "channels.xlsx"'
    )
