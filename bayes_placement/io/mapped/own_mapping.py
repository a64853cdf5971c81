"""What a file of arrays states itself, as a mapping: our own names, and headings of columns.

Arrays `frf` (sensor, actuator, frequency; in SI), `frequency` [Hz], `sensors`, `actuators` and
`quantity` are those of `Measurement.from_arrays`. Columns are `frequency [Hz]`, and for each pair
`s1+x/a1+x real [(m/s^2)/N]` with `imaginary`, or `magnitude` or `decibel` with `degrees` or
`radians` (also `magnitude [dB]` and `phase [deg]`), and `s1+x/a1+x coherence`.
"""

import re
from pathlib import Path

from ..._shared.errors import InputError
from ..._shared.files import Json
from ...experiment.quantities import QUANTITIES
from .._frf_units import plain
from ..arrays.named_arrays import NamedArrays
from ..arrays.text import split_unit
from ._headings import WORDS, part_of
from ._toml_fields import TomlTable
from .mapping import PARTS, PARTS_NEEDED, Mapping, of_table

_ARRAY_NAMES = ("frf", "frequency", "sensors", "actuators", "quantity")
_WORD = "|".join(map(re.escape, WORDS))
_COLUMN = re.compile(
    rf"(?P<sensor>[^/]+?)(?<!\s)\s*/\s*+(?P<actuator>[^/]+?)(?P<words>((?<!\s)\s+({_WORD}))*)", re.I
)


def own_mapping(source: NamedArrays, unit: str | None) -> Mapping:
    """Return what a file says of itself, with a unit of the FRFs that it leaves open."""
    fields = {**_frequency(source), **_of_named_arrays(source)}
    if "frf" not in fields:
        fields |= _of_columns(source)
    return _mapping(source, {**fields, **({"unit": unit} if unit else {})})


def _mapping(source: NamedArrays, fields: Json) -> Mapping:
    return of_table(TomlTable(fields, f"{source.path}, by its own names"), source.path.parent)


def _frequency(source: NamedArrays) -> Json:
    name = next((name for name in source.arrays if name.lower() == "frequency"), None)
    return {} if name is None else {"frequency": name}


def completed(mapping: Mapping, source: NamedArrays) -> Mapping:
    """Complete what a mapping says by what the file says; the mapping has the last word."""
    if mapping.frf:  # coherence and channels belong to the FRFs that the file would have stated
        known = _mapping(source, _frequency(source))
        return mapping._replace(frequency=mapping.frequency or known.frequency)
    known = own_mapping(source, mapping.unit)
    _check_units(mapping, known, source.path)
    empty = Mapping()
    missing = {
        name: getattr(known, name)
        for name in ("frf", "coherence", "frequency", "sensors", "actuators", "averages")
        if getattr(mapping, name) == getattr(empty, name)
    }
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


def _of_named_arrays(source: NamedArrays) -> Json:
    if not set(_ARRAY_NAMES) <= source.arrays.keys():
        return {}
    axes = ["sensor", "actuator", "frequency"]
    fields: Json = {
        "frf": {"array": "frf", "axes": axes, "unit": _unit(str(source.arrays["quantity"]))},
        "frequency": {"array": "frequency", "unit": "Hz"},
        "sensors": "sensors",
        "actuators": "actuators",
    }
    if "coherence" in source.arrays:
        fields["coherence"] = "coherence"
    averages = source.arrays.get("averages")
    if averages is not None and averages.size == 1 and averages.dtype.kind in "iuf":
        fields["averages"] = int(averages.item())
    return fields


def _unit(quantity: str) -> str:
    """Unit in SI; the word itself, which is no unit, where it is no quantity."""
    units = {word: known.ascii_unit for known in QUANTITIES for word in (known.frf, known.motion)}
    return units.get(quantity.strip(), quantity.strip() or "none")


def _of_columns(source: NamedArrays) -> Json:
    """FRFs of which each pair has columns that say its parts."""
    pairs: dict[tuple[str, str], dict[str, str]] = {}
    for name in source.arrays:
        match = _COLUMN.fullmatch(split_unit(name)[0])
        part = match and part_of(match["words"].lower(), source.units.get(name, ""))
        if not match or not part or (not match["words"] and " " in match["actuator"]):
            continue
        parts = pairs.setdefault((match["sensor"], match["actuator"]), {})
        if part in parts:
            raise InputError(
                f"{source.path}: {parts[part]!r} and {name!r} both are the {part} of "
                f"{match['sensor']}/{match['actuator']}, and either could be meant; each part is "
                "needed once. Correct one of the two headings."
            )
        parts[part] = name
    rules = [_rule(source, sensor, actuator, parts) for (sensor, actuator), parts in pairs.items()]
    return {"frf": rules} if rules else {}


def _rule(source: NamedArrays, sensor: str, actuator: str, parts: dict[str, str]) -> dict[str, str]:
    """Rule of a pair, of the first two parts that make complex numbers."""
    needed = next((names for names in PARTS if {*names} <= parts.keys()), None)
    if needed is None:
        raise _incomplete(source, f"{sensor}/{actuator}", parts)
    names = [*needed, "coherence"] if "coherence" in parts else needed
    channels = {"sensor": sensor, "actuator": actuator}
    return {**channels, **{name: parts[name] for name in names}}


def _incomplete(source: NamedArrays, pair: str, parts: dict[str, str]) -> InputError:
    """Error of columns that are no complex numbers together."""
    if "phase" in parts and not {"degrees", "radians"} & parts.keys():
        sensor, _, actuator = pair.partition("/")
        named = ", ".join(f'{part} = "{name}"' for part, name in parts.items())
        remedy = (
            f'Write the unit of the phase into its heading: "{pair} phase [deg]" or [rad]; or into '
            f'a mapping: frf = [{{ sensor = "{sensor}", actuator = "{actuator}", '
            f"{named.replace('phase =', 'degrees =')} }}], or radians."
        )
    else:
        remedy = (
            f'Export the other part too, with the heading "{pair} imaginary" for real, or '
            f'"{pair} phase [deg]" for magnitude.'
        )
    columns = " and ".join(map(repr, parts.values()))
    return InputError(
        f"{source.path} has {columns} of {pair} alone; one of these is needed, since FRFs are "
        f"complex: {PARTS_NEEDED}. {remedy}"
    )
