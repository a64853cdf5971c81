"""Arrays of a file by the rules of a mapping: FRFs, coherence, lines and labels, in SI."""

import difflib
import json
import math
import re
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from ..._shared.errors import InputError
from ...experiment._measurement_words import counted
from .._frf_units import FREQUENCY, Scale, frf_unit, plain
from ..arrays import NamedArrays
from ._headings import ANGLES, columns_by_part, first_pair, part_of, part_of_column
from .mapping import AXES, PARTS, Column, FrequencyRule, FrfRule

_REFERENCE = re.compile(r"dB( re( 1)? )?", re.IGNORECASE)  # decibels re 1 of the unit behind
_NO_UNIT = {"-", "1", ""}
_EXACT = ("decibel", "degrees", "radians", "phase", "coherence")  # and no other part


class FrequencyAxis(NamedTuple):
    """Frequencies [Hz], and a sentence that says where they come from."""

    frequency: np.ndarray
    sentence: str


def array_of(source: NamedArrays, column: Column, kinds: str = "biuf") -> np.ndarray:
    """Return an array by its name, or a column by its number."""
    name = name_of(source, column)
    values = source.arrays[name]
    if values.dtype.kind not in kinds:
        needed = "texts" if kinds == "U" else "numbers" if "c" in kinds else "real numbers"
        raise InputError(
            f"{source.path}: {name} holds {_kind(values)}; {needed} are needed there. Name another "
            "array in the mapping."
        )
    return values


def _kind(values: np.ndarray) -> str:
    return {"U": "text", "c": "complex numbers"}.get(values.dtype.kind, "real numbers")


def name_of(source: NamedArrays, column: Column) -> str:
    """Return the name of an array, which may be called by the number of its column."""
    names = list(source.arrays)
    if isinstance(column, int) and column <= len(names):
        return names[column - 1]
    if column in source.arrays:
        return str(column)
    nearest = difflib.get_close_matches(str(column), names, n=1, cutoff=0.0)
    similar = f' The nearest is "{nearest[0]}".' if nearest else ""
    reason = (
        f" {column} was not read: {source.left_out[column]}." if column in source.left_out else ""
    )
    raise InputError(
        f"{source.path} has no array {column!r} that is read; it has {', '.join(names) or 'none'}."
        f"{reason}{similar} Correct the name in the mapping."
    )


def lines_of(source: NamedArrays, rule: FrequencyRule, count: int) -> FrequencyAxis:
    """Frequencies [Hz] of an array or of an even axis."""
    stated = source.units.get(name_of(source, rule.array)) if rule.array is not None else None
    unit = plain(_agreed(source, rule.unit, stated, "frequency"))
    if unit not in FREQUENCY:
        raise InputError(
            f"{source.path}: the unit of the frequency is {unit!r}; one of {', '.join(FREQUENCY)} "
            'is needed, since lines are compared in Hz. Write frequency = { ..., unit = "Hz" }.'
        )
    if rule.array is not None:
        values = one_axis(array_of(source, rule.array)).astype(float).reshape(-1)
        origin = f"array {name_of(source, rule.array)}"
    else:
        first, step = (_number(source, value) for value in (rule.first, rule.step))
        values = first + step * np.arange(count)
        origin = f"first {first:g}, step {step:g} as the mapping says"
    if values.size != count:
        raise InputError(
            f"{source.path}: the frequency has {counted(values.size, 'line')} and the FRFs have "
            f"{count} for each pair; both must agree, since a line belongs to each "
            "value. Correct frequency, sensors or actuators."
        )
    values = values * FREQUENCY[unit]
    band = f"{counted(count, 'line')} from {values[0]:g} to {values[-1]:g} Hz"
    sentence = f"Frequency: {origin}, in {unit}: {band}."
    return FrequencyAxis(values, sentence)


def one_axis(values: np.ndarray) -> np.ndarray:
    """Axis of an array without sides of 1: of blocks that have all the same axis, that one."""
    flat = np.squeeze(values)
    return flat[0] if flat.ndim == 2 and np.array_equal(flat, [flat[0]] * len(flat)) else flat


def _number(source: NamedArrays, value: float | str | None) -> float:
    if not isinstance(value, str):
        return float(value or 0.0)
    values = array_of(source, value)
    if values.size != 1:
        raise InputError(f"{source.path}: {value} has {values.size} numbers; one is needed there.")
    return float(values.item())


def frf_of(source: NamedArrays, rule: FrfRule) -> np.ndarray:
    """Complex numbers of a rule, in the unit of the file."""
    _check_parts(source, rule)
    arrays = {
        part: array_of(source, column, "biufc" if part == "array" else "biuf")
        for part, column in rule.parts.items()
    }
    shapes = {values.shape for values in arrays.values()}
    if len(shapes) > 1:
        raise InputError(
            f"{source.path}: {' and '.join(map(str, rule.parts.values()))} have the sizes "
            f"{' and '.join(map(str, shapes))}; the same are needed, since they are parts of one."
        )
    if "array" in arrays:
        return _complex(source, rule.parts["array"], arrays["array"])
    first, second = (values.astype(float) for values in arrays.values())
    names = tuple(arrays)
    if names == ("real", "imaginary"):
        return first + 1j * second
    amplitude = 10 ** (first / 20) if names[0] == "decibel" else first
    return amplitude * np.exp(1j * second * (math.pi / 180 if names[1] == "degrees" else 1.0))


def _complex(source: NamedArrays, column: Column, values: np.ndarray) -> np.ndarray:
    if values.dtype.kind != "c":
        name = name_of(source, column)
        raise InputError(
            f"{source.path}: {name} holds real numbers; the complex FRFs are needed there, since "
            "amplitudes or decibels alone say nothing of the phase. Name two arrays: frf = { real "
            '= "Re", imaginary = "Im" }, or decibel and degrees, magnitude and radians.'
        )
    return values.astype(complex)


def _check_parts(source: NamedArrays, rule: FrfRule) -> None:
    """Refuse radians that the mapping takes for degrees, decibels for amplitudes, and so on."""
    stated_parts = {part: _stated_part(source, part, column) for part, column in rule.parts.items()}
    for part, column in rule.parts.items():
        if stated_parts[part] == part:
            continue
        label = source.units.get(name_of(source, column), "")
        says = (
            f"the file says that it is in {label!r}"
            if label
            else f"its name says {stated_parts[part]}"
        )
        raise InputError(
            f"{source.path}: the mapping takes {column!r} for {part} and {says}; both must agree, "
            f"since either could be meant. Write {_corrected(source, rule, stated_parts)} in the "
            "mapping, or correct the heading in the file."
        )


def _stated_part(source: NamedArrays, part: str, column: Column) -> str:
    """Part that the file says a column is, by its heading; that of the mapping where both agree."""
    name = name_of(source, column)
    stated = part_of_column(source, name)
    if part == "array":  # whose name may say anything
        return stated if stated == "decibel" and name in source.units else part
    if stated == "phase" and part in ("degrees", "radians"):
        return part
    return stated if stated in _EXACT else part


def _corrected(source: NamedArrays, rule: FrfRule, stated_parts: dict[str, str]) -> str:
    """Parts of a rule as the file says them, or else those that its headings say."""
    parts = {stated_parts[part]: column for part, column in rule.parts.items()}
    if tuple(parts) not in PARTS:
        numbers = [name for name, values in source.arrays.items() if values.dtype.kind in "iuf"]
        pair = first_pair(columns_by_part(source, numbers))
        parts = dict(pair.parts) if pair else {"real": "Re", "imaginary": "Im"}
    fields = ", ".join(
        f"{part} = {json.dumps(column, ensure_ascii=False)}" for part, column in parts.items()
    )
    return fields.replace("phase = ", "degrees (or radians) = ")


def stated_units(source: NamedArrays, columns: Iterable[Column]) -> set[str]:
    """Units of FRFs that a file states with columns; decibels and angles are none."""
    names = [name_of(source, column) for column in columns] if source.units else []
    labels = [source.units[name] for name in names if name in source.units]
    return {
        _REFERENCE.sub("", label) for label in labels if part_of("", label) not in ANGLES
    } - _NO_UNIT


def unit_of(source: NamedArrays, rule: FrfRule) -> Scale:
    """Unit of the FRFs of a rule, as the mapping or the file states it."""
    stated = stated_units(source, rule.parts.values())
    if len(stated) > 1:
        raise InputError(
            f"{source.path}: FRFs of one pair are in {' and in '.join(sorted(stated))}."
        )
    label = _agreed(source, rule.unit, next(iter(stated), None), "FRFs")
    unit = frf_unit(label)
    if unit is None:
        raise InputError(
            f"{source.path}: the unit of the FRFs is {label!r}; one such as (m/s^2)/N, (m/s)/N, "
            "m/N, g/N, mm/N or V/V (with sensitivities) is needed, since quantity and factor "
            'follow from it. Write unit = "(m/s^2)/N" in the mapping.'
        )
    return unit


def _agreed(source: NamedArrays, of_mapping: str | None, stated: str | None, what: str) -> str:
    """Unit by the mapping and by the file, which must agree."""
    if of_mapping is not None and stated is not None and plain(of_mapping) != plain(stated):
        raise InputError(
            f"{source.path}: the mapping says that the {what} are in {of_mapping!r} and the file "
            f"says {stated!r}; both must agree, since either could be meant. Correct the one "
            "that is wrong."
        )
    return of_mapping or stated or ""


def arranged(
    source: NamedArrays,
    what: str,
    values: np.ndarray,
    axes: tuple[str, ...] | None,
    sizes: dict[str, int],
) -> np.ndarray:
    """Arrange an array as sensor, actuator, frequency.

    Axes of one element may be missing in the array, since MATLAB drops them.
    """
    if axes is None:
        axes = _only_axes(source, what, values, sizes)
    missing = [axis for axis in AXES if axis not in axes]
    expected = tuple(sizes[axis] for axis in axes)
    fits = _without_ones(values.shape) == _without_ones(expected)
    if not fits or any(sizes[axis] > 1 for axis in missing):
        raise InputError(
            f"{source.path}: {what} has {_sizes(values.shape)} numbers, but the mapping makes them "
            f"{_sizes(expected)} ({', '.join(axes)}), with {counted(sizes['sensor'], 'sensor')}, "
            f"{counted(sizes['actuator'], 'actuator')} and {counted(sizes['frequency'], 'line')}; "
            "both must agree, since each value has one place. Correct axes, sensors or actuators."
        )
    complete = values.reshape((*expected, *(1 for _ in missing)))
    order = (*axes, *missing)
    return np.transpose(
        complete, [order.index(axis) for axis in ("sensor", "actuator", "frequency")]
    )


def _only_axes(
    source: NamedArrays, what: str, values: np.ndarray, sizes: dict[str, int]
) -> tuple[str, ...]:
    """Axes of an array of one pair, which has one axis only."""
    if sizes["sensor"] * sizes["actuator"] > 1:
        raise InputError(
            f"{source.path}: {what} has {_sizes(values.shape)} numbers and nothing says which axis "
            "is which; a mapping must say so, since nothing is guessed. Write axes = "
            '["frequency", "sensor", "actuator"] in it, in the order of the array.'
        )
    return ("frequency",)


def _without_ones(shape: Iterable[int]) -> tuple[int, ...]:
    return tuple(size for size in shape if size != 1)


def _sizes(shape: Iterable[int]) -> str:
    return " x ".join(map(str, shape)) or "1"
