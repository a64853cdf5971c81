"""What a file of arrays states itself, as a mapping: our own names, and headings of columns.

Arrays `frf` (sensor, actuator, frequency; in SI), `frequency` [Hz], `sensors`, `actuators` and
`quantity` are those of `Measurement.from_arrays`. Columns are `frequency [Hz]`, and for each pair
`s1+x/a1+x real [(m/s^2)/N]` with `imaginary`, or `magnitude` or `dB` with `degrees`, and
`s1+x/a1+x coherence`.
"""

import re
from pathlib import Path
from typing import Any

from ..._types import InputError
from ...experiment.quantities import QUANTITIES
from .._frf_units import plain
from ..arrays.named_arrays import NamedArrays
from ._toml_fields import TomlTable
from .mapping import Mapping, of_table

_ARRAY_NAMES = ("frf", "frequency", "sensors", "actuators", "quantity")
_PARTS = {
    "real": "real",
    "imaginary": "imaginary",
    "imag": "imaginary",
    "magnitude": "magnitude",
    "db": "decibel",
    "degrees": "degrees",
    "deg": "degrees",
    "radians": "radians",
    "coherence": "coherence",
}
_COLUMN = re.compile(
    rf"(?P<sensor>[^/]+?)\s*/\s*(?P<actuator>[^/]+?)\s+(?P<part>{'|'.join(_PARTS)})", re.IGNORECASE
)


def stated(held: NamedArrays, unit: str | None) -> Mapping:
    """Return what a file says of itself, with a unit of the FRFs that it leaves open.

    Raises
    ------
    InputError
        If what it says is no mapping.
    """
    fields = {**_of_columns(held), **_of_named_arrays(held), **({"unit": unit} if unit else {})}
    return of_table(TomlTable(fields, f"{held.path}, by its own names"), held.path.parent)


def completed(mapping: Mapping, held: NamedArrays) -> Mapping:
    """Complete what a mapping says by what the file says; the mapping has the last word.

    Raises
    ------
    InputError
        If the file states another unit of the FRFs.
    """
    known = stated(held, mapping.unit)
    if not mapping.frf:
        _check_units(mapping, known, held.path)
    empty = Mapping()
    missing = {
        name: getattr(known, name)
        for name in ("frf", "coherence", "frequency", "sensors", "actuators", "averages")
        if getattr(mapping, name) == getattr(empty, name)
    }
    if mapping.frf:  # coherence and channels belong to the FRFs that the file would have stated
        missing = {name: missing[name] for name in ("frequency",) if name in missing}
    return mapping._replace(**missing)


def _check_units(mapping: Mapping, known: Mapping, path: Path) -> None:
    """Refuse a unit of the mapping that is not that of the file."""
    for unit in {rule.unit for rule in known.frf if rule.unit and mapping.unit}:
        if plain(str(unit)) != plain(str(mapping.unit)):
            raise InputError(
                f"{mapping.place} says that the FRFs are in {mapping.unit!r} and {path} says "
                f"{unit!r}; both must agree, since either could be meant. Correct the one that is "
                "wrong."
            )


def _of_named_arrays(held: NamedArrays) -> dict[str, Any]:
    if not set(_ARRAY_NAMES) <= held.arrays.keys():
        return {"frequency": "frequency"} if "frequency" in held.arrays else {}
    axes = ["sensor", "actuator", "frequency"]
    fields: dict[str, Any] = {
        "frf": {"array": "frf", "axes": axes, "unit": _unit(str(held.arrays["quantity"]))},
        "frequency": {"array": "frequency", "unit": "Hz"},
        "sensors": "sensors",
        "actuators": "actuators",
    }
    if "coherence" in held.arrays:
        fields["coherence"] = "coherence"
    averages = held.arrays.get("averages")
    if averages is not None and averages.size == 1 and averages.dtype.kind in "iuf":
        fields["averages"] = int(averages.item())
    return fields


def _unit(quantity: str) -> str:
    """Unit in SI; the word itself, which is no unit, where it is no quantity."""
    units = {word: known.ascii_unit for known in QUANTITIES for word in (known.frf, known.motion)}
    return units.get(quantity.strip(), quantity.strip() or "none")


def _of_columns(held: NamedArrays) -> dict[str, Any]:
    pairs: dict[tuple[str, str], dict[str, Any]] = {}
    for name in held.arrays:
        match = _COLUMN.fullmatch(name)
        if match:
            pair = pairs.setdefault((match["sensor"], match["actuator"]), {})
            pair[_PARTS[match["part"].lower()]] = name
    frequency = next((name for name in held.arrays if name.lower() == "frequency"), None)
    rules = [
        {"sensor": sensor, "actuator": actuator, **parts}
        for (sensor, actuator), parts in pairs.items()
    ]
    fields: dict[str, Any] = {"frf": rules} if rules else {}
    return fields | ({"frequency": frequency} if frequency else {})
