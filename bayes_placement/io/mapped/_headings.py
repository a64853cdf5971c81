"""Which part of an FRF the heading of a column says that it is, by its words and its unit."""

import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from ..arrays.named_arrays import NamedArrays
from ..arrays.text import split_unit

WORDS = {
    "real": "real",
    "re": "real",
    "imaginary": "imaginary",
    "imag": "imaginary",
    "im": "imaginary",
    "magnitude": "magnitude",
    "mag": "magnitude",
    "amplitude": "magnitude",
    "ampl": "magnitude",
    "amp": "magnitude",
    "abs": "magnitude",
    "modulus": "magnitude",
    "decibels": "decibel",
    "decibel": "decibel",
    "db": "decibel",
    "degrees": "degrees",
    "degree": "degrees",
    "deg": "degrees",
    "°": "degrees",
    "radians": "radians",
    "radian": "radians",
    "rad": "radians",
    "phase": "phase",
    "angle": "phase",
    "coherence": "coherence",
    "coh": "coherence",
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
