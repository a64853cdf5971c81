"""The lines of a mapping that a file needs, written for the arrays that it holds."""

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ..._types import InputError
from ..arrays.named_arrays import NamedArrays
from ._values import name_of
from .mapping import AXES, Column, FrequencyRule, Mapping

_MOST_SHOWN = 12
_FIRST, _STEP = "x_values.start_value", "x_values.increment"


def check_complete(mapping: Mapping, held: NamedArrays, table_labels: dict[str, list[str]]) -> None:
    """Refuse arrays of which neither file nor mapping says what they are.

    Parameters
    ----------
    mapping
        What is said.
    held
        The arrays.
    table_labels
        Labels of the channel table for `sensors` and `actuators`, as far as there is one.

    Raises
    ------
    InputError
        If something is missing, with the lines that say it.
    """
    lines = list(_missing(mapping, held, table_labels))
    if not lines:
        return
    target = _target(mapping, held)
    first = [] if mapping.file or mapping.place else [f"file = {_quoted(held.path.name)}"]
    raise InputError(
        f"{held.path} holds {described(held.arrays)}, and nothing says "
        f"{', nor '.join(what for what, _ in lines)}; a mapping must say so, since nothing is "
        f"guessed. {target}, corrected:\n\n" + "\n".join([*first, *(line for _, line in lines)])
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


def _target(mapping: Mapping, held: NamedArrays) -> str:
    if mapping.place:
        return f"Add these lines at the top of {mapping.place}"
    suggested = held.path.with_suffix(".toml")
    return f"Save these lines as {suggested} and give that file in its place (or as --mapping)"


def _missing(
    mapping: Mapping, held: NamedArrays, labels: dict[str, list[str]]
) -> Iterable[tuple[str, str]]:
    """What is missing in words, and the line that says it."""
    main = _main(held.arrays)
    if not mapping.frf:
        yield "which array holds the FRFs, with which axes and unit", _frf_line(main, held)
    elif any(_unit(rule.unit, rule.parts.values(), held) is None for rule in mapping.frf):
        yield "in which unit the FRFs are", 'unit = "(m/s^2)/N"  # at the top of the mapping'
    if mapping.frequency is None:
        yield "at which frequencies", _frequency_line(held.arrays)
    elif _unit(mapping.frequency.unit, _frequency_columns(mapping.frequency), held) is None:
        yield "in which unit the frequencies are", _frequency_line(held.arrays, mapping)
    columns = not mapping.frf and _frf_line(main, held).startswith("frf = [")
    single = columns or (mapping.frf and all(rule.sensor and rule.actuator for rule in mapping.frf))
    for name in ("sensors", "actuators"):
        if not single and getattr(mapping, name) is None:
            known = labels.get(name) or {"sensors": ["s1+x", "s2+x"], "actuators": ["a1+x"]}[name]
            listed = ", ".join(map(_quoted, known))
            yield f"of which {name}", f"{name} = [{listed}]  # in the order of the array"


def _unit(unit: str | None, columns: Iterable[Column], held: NamedArrays) -> str | None:
    """Unit by the mapping, or else by the file."""
    stated = held.units if unit is None else {}
    names = (name_of(held, column) for column in columns if stated)
    return unit or next((stated[name] for name in names if name in stated), None)


def _frequency_columns(rule: FrequencyRule) -> list[Column]:
    return [] if rule.array is None else [rule.array]


def _main(arrays: dict[str, np.ndarray]) -> str:
    """Name of the array that is most likely the FRFs: complex, then the largest."""
    numbers = {name: values for name, values in arrays.items() if values.dtype.kind in "iufc"}
    ranked = sorted(numbers, key=lambda name: (numbers[name].dtype.kind == "c", numbers[name].size))
    return ranked[-1] if ranked else "H"


def _frf_line(main: str, held: NamedArrays) -> str:
    values = held.arrays.get(main)
    if values is not None and values.ndim == 1 and values.dtype.kind != "c":
        return _columns_line(held)
    size = " x ".join(map(str, values.shape)) if values is not None else "its"
    listed = ", ".join(f'"{axis}"' for axis in AXES)
    what = f"array = {_quoted(main)}"
    if values is not None and values.dtype.kind != "c":
        what = 'real = "Re", imaginary = "Im"'
    return (
        f'frf = {{ {what}, axes = [{listed}], unit = "(m/s^2)/N" }}  # in the order of {size} '
        "numbers"
    )


def _columns_line(held: NamedArrays) -> str:
    """Line that says which columns are a pair."""
    names = [name for name, values in held.arrays.items() if values.dtype.kind in "iuf"]
    real, imaginary = (*names[1:3], "Re", "Im")[:2]
    return (
        f'frf = [{{ sensor = "s1+x", actuator = "a1+x", real = {_quoted(real)}, '
        f'imaginary = {_quoted(imaginary)}, unit = "(m/s^2)/N" }}]  # one table for each pair'
    )


def _frequency_line(arrays: dict[str, np.ndarray], mapping: Mapping | None = None) -> str:
    if mapping is not None and mapping.frequency is not None and mapping.frequency.array:
        return f'frequency = {{ array = {_quoted(str(mapping.frequency.array))}, unit = "Hz" }}'
    for first in (name for name in arrays if name.endswith(_FIRST)):  # as Simcenter Testlab writes
        step = first.removesuffix(_FIRST) + _STEP
        if step in arrays:
            return (
                f'frequency = {{ first = {_quoted(first)}, step = {_quoted(step)}, unit = "Hz" }}'
            )
    axis = next((name for name, values in arrays.items() if _is_axis(values)), None)
    if axis is not None:
        return f'frequency = {{ array = {_quoted(axis)}, unit = "Hz" }}'
    return 'frequency = { first = 10.0, step = 0.5, unit = "Hz" }'


def _quoted(name: str) -> str:
    """A text as TOML writes it, which is as JSON does."""
    return json.dumps(name, ensure_ascii=False)


def _is_axis(values: np.ndarray) -> bool:
    """Whether an array rises as an axis does."""
    flat = np.squeeze(values)
    return flat.dtype.kind in "iuf" and flat.ndim == 1 and bool(np.all(np.diff(flat) > 0))


def file_needed(folder: Path, names: list[str]) -> InputError:
    """Error of a folder of which nobody says what its files are."""
    listed = ", ".join(names) or "no file"
    return InputError(
        f"{folder} holds {listed}, and nothing says which is which; a mapping in it must say so, "
        'since nothing is guessed. Save as measured.toml there:\n\nfile = "measured.uff"\n'
        'channels = "channels.xlsx"'
    )
