"""What a file of arrays states itself: parts of FRFs by headings, and all of it as a mapping.

Arrays `frf` (sensor, actuator, frequency; in SI), `frequency` [Hz], `sensors`, `actuators` and
`quantity` are those of `Measurement.from_arrays`. Columns are `frequency [Hz]`, and for each pair
`s1+x/a1+x real [(m/s^2)/N]` with `imaginary`, or `magnitude` or `decibel` with `degrees` or
`radians` (also `magnitude [dB]` and `phase [deg]`), and `s1+x/a1+x coherence`.
"""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from ..._shared.errors import InputError
from ..._shared.files import Json
from ...experiment.quantities import QUANTITIES
from .._frf_units import FREQUENCY, plain
from ..arrays import NamedArrays
from ..arrays.text import plain_name, split_unit
from ._toml_fields import TomlTable
from .mapping import PARTS, PARTS_NEEDED, Mapping, of_table

WORDS = {
    word: part
    for part, words in {
        "real": "real re",
        "imaginary": "imaginary imag im",
        "magnitude": "magnitude mag amplitude ampl amp abs modulus",
        "decibel": "decibels decibel db",
        "degrees": "degrees degree deg °",
        "radians": "radians radian rad",
        "phase": "phase angle",
        "coherence": "coherence coh",
    }.items()
    for word in words.split()
}
"""Words in headings, and the part that they mean; a `phase` is in degrees or radians."""

_OF_FRFS = {
    *("frf", "frfs", "h", "hf", "hv", "hs", "tf", "transfer", "response", "receptance"),
    *("mobility", "accelerance", "inertance", "compliance"),
}
_OF_OTHERS = {
    *("cross", "auto", "spec", "spectrum", "spectra", "psd", "asd", "csd", "power", "fft"),
    *("coh", "coherence", "correlation", "cov", "covariance", "window", "error", "noise"),
    *("impulse", "mode", "modes", "shape", "shapes", "eig", "pole", "poles"),
}
"""Words in names of arrays that say FRFs, and that say something else."""

FIRSTS, ANGLES = ("real", "magnitude", "decibel"), ("degrees", "radians", "phase")
_EXACT = {"decibel": "magnitude", "degrees": "phase", "radians": "phase"}
_REFERENCE = re.compile(r"(dB|decibels?)\s+re\b", re.IGNORECASE)
_ANGULAR_FREQUENCY = re.compile(r"rad\s*/\s*s(ec)?\b", re.IGNORECASE)
_TOKEN = re.compile(r"[A-Z]?[a-zß-ÿ]+|[A-Z]+(?![a-zß-ÿ])|°|\d+|[+-]")


class PartPair(NamedTuple):
    """Columns of one FRF: two by their parts, and that of its coherence."""

    parts: dict[str, str]
    coherence: str | None


def part_of(heading: str, unit: str = "") -> str | None:
    """Return the part of an FRF that a heading says, None where it says none or several.

    The unit behind it, `dB` with or without a reference, `deg`, `°` or `rad`, has the last word: a
    magnitude in dB is a decibel.
    """
    of_unit = _of_unit(unit.strip().lower())
    if of_unit is not None:
        return of_unit
    known = {WORDS[word] for word in _tokens(heading) if word in WORDS}
    known -= {general for exact, general in _EXACT.items() if exact in known}
    return known.pop() if len(known) == 1 else None


def _of_unit(label: str) -> str | None:
    """Part of an FRF that has a unit alone: levels in decibels and angles."""
    if label.startswith("db"):
        return "decibel"
    return WORDS[label] if WORDS.get(label) in ANGLES else None


def said_of(name: str) -> bool | None:
    """Whether the name of an array says that it holds FRFs; None where it says nothing."""
    words = {*_tokens(name)}
    if words & _OF_OTHERS:
        return False
    return True if words & _OF_FRFS else None


def part_of_column(source: NamedArrays, name: str) -> str | None:
    """Return the part of an FRF that the heading of a column says."""
    return part_of(split_unit(name)[0], source.units.get(name, ""))


def columns_by_part(source: NamedArrays, names: list[str]) -> dict[str, str | None]:
    """Columns with the part that their headings say."""
    return {name: part_of_column(source, name) for name in names}


def first_pair(columns: dict[str, str | None]) -> PartPair | None:
    """Return the first two columns whose headings say that they are the parts of one FRF."""
    return next(_pairs(columns), None)


def _pairs(columns: dict[str, str | None]) -> Iterator[PartPair]:
    for name, part in columns.items():
        if part not in FIRSTS:
            continue
        wanted = partners_of(part)
        partner = of_same(name, {key: kind for key, kind in columns.items() if kind in wanted})
        if partner is not None:
            coherences = {key: kind for key, kind in columns.items() if kind == "coherence"}
            yield PartPair({part: name, str(columns[partner]): partner}, of_same(name, coherences))


def partners_of(part: str | None) -> tuple[str, ...]:
    """Parts that make complex numbers with a first one."""
    return ("imaginary",) if part == "real" else ANGLES


def of_same(name: str, candidates: Iterable[str]) -> str | None:
    """Return the column of the same FRF: whose other words agree, or the only one there is."""
    same = [key for key in candidates if _stem(key) == _stem(name)] or list(candidates)
    return same[0] if len(same) == 1 else None


def _stem(heading: str) -> list[str]:
    """Words of a heading that say no part."""
    return [word for word in _tokens(split_unit(heading)[0]) if word not in WORDS]


def _tokens(heading: str) -> list[str]:
    """Words of a heading, in lower case: `HdB` and `H_dB` have `h` and `db`."""
    text = _ANGULAR_FREQUENCY.sub(" ", _REFERENCE.sub(" dB ", heading))
    return [word.lower() for word in _TOKEN.findall(re.sub(r"dB(?![a-z])", " db ", text))]


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
    """Array of the lines: called frequency, or the only one called so in short, with its unit."""
    named = {name: plain_name(name) for name in source.arrays}
    whole = [name for name, (word, _) in named.items() if word == "frequency"]
    units = {name: source.units.get(name) or unit for name, (_, unit) in named.items()}
    short = [name for name, (word, _) in named.items() if word in ("f", "freq")]
    short = [name for name in short if plain(units[name] or "") in FREQUENCY]
    if not whole and len(short) != 1:
        return {}
    (name, *_) = whole or short
    return {"frequency": {"array": name, **({"unit": units[name]} if units[name] else {})}}


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
    units = {word: known.ascii_unit for known in QUANTITIES for word in (known.frf, known.motion)}
    quantity = str(source.arrays["quantity"]).strip()
    unit = units.get(quantity, quantity or "none")  # the word itself is no unit
    fields: Json = {
        "frf": {"array": "frf", "axes": axes, "unit": unit},
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
