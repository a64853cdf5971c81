"""Entries of claimed effects in words: where each acts, by which law, and what else fits."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..._shared.files import Json
from ...inference.units import probability_in_words
from ...laws.catalogue import WORDS
from ...laws.elements import typed
from ...laws.law import Element, Group, Law, Scaled
from ...laws.symbols import Number, numbers
from ._parameter_estimate import PLACES, ParameterEstimate, spoken

Entry = Json
"""An entry of `effects` in a file; see `_claims.py`."""


class Numbered(NamedTuple):
    """A number of an element of a network, or of an effect of the library.

    The symbol is as in the drawing of the network, of the library its word; `what` is the element,
    or the effect. The words are the value with the 95 % interval, in a unit for people. A number
    that is given has no estimate.
    """

    symbol: str
    what: str
    field: str
    words: str
    estimate: ParameterEstimate | None = None


def claims_in_words(effects: Sequence[Entry]) -> list[str]:
    """Say of each claimed effect where it acts, what it is, and what explains the data as well."""
    return [
        f"{either}{_in_words(entry)}."
        for claimed in effects
        for either, entry in [("", claimed), *(("or ", each) for each in claimed["equivalent"])]
    ]


def _in_words(entry: Entry) -> str:
    return f"{where_in_words(entry)}: {what_in_words(entry)}{_odds(entry['probability'])}"


def _odds(share: float | None) -> str:
    return "" if share is None else f" ({probability_in_words(share)})"


def where_in_words(entry: Entry) -> str:
    """Say on what an effect acts, and its places with 95 % intervals."""
    pairs = zip(entry["place_m"], entry["place_95_m"], strict=True)
    places = " to ".join(dict.fromkeys(_place(*pair) for pair in pairs))
    kind, on = entry["acts_on"].replace("_", " "), entry["on"]
    words = ["" if on.startswith(kind) else kind, on, places and f"at {places}"]
    return " ".join(filter(None, words))


def _place(at: Sequence[float], ends: Sequence[Sequence[float]]) -> str:
    """Say where a place is, coordinates with intervals where they are not known exactly."""
    return ", ".join(_coordinate(*pair) for pair in zip(at, ends, strict=True))


def _coordinate(middle: float, ends: Sequence[float]) -> str:
    low, high = ends
    if low == high:
        return f"{1e3 * middle:.4g} mm"
    decimals = int(np.clip(1 - np.floor(np.log10(1e3 * (high - low))), 0, 2))
    number, *interval = (f"{1e3 * x:.{decimals}f}" for x in (middle, low, high))
    return f"{number} mm (95 %: {' to '.join(interval)})"


def what_in_words(entry: Entry) -> str:
    """Say what an effect is: a network with its numbers, or its name in the library and its own."""
    law = law_of_entry(entry)
    if law is not None:
        return _law(law, iter(numbers_of(entry)))
    return ", ".join(
        [entry["kind"], *(f"{each.symbol} {each.words}" for each in numbers_of(entry))]
    )


def _law(law: Law, known: Iterator[Numbered]) -> str:
    """A network as it is typed, its elements in words with their numbers."""
    if isinstance(law, Group):
        parts = (_part(part, known) for part in law.parts)
        return f" {law.sign} ".join(parts)
    first, *others = (next(known) for _ in law.symbols)  # type: ignore[attr-defined]
    if isinstance(law, Scaled):
        return f"{first.words} * {_part(law.law, known)}"
    named = (f"{each.field.replace('_', ' ')} {each.words}" for each in others)
    return ", ".join([f"{first.what} of {first.words}", *named])


def _part(law: Law, known: Iterator[Numbered]) -> str:
    words = _law(law, known)
    return f"({words})" if isinstance(law, Group) else words


def law_of_entry(entry: Entry) -> Law | None:
    """Law of an entry that is a network, with its numbers; None of an effect of the library."""
    return typed(entry["law"]) if entry["name"] == "network" and entry["law"] else None


def numbers_of(entry: Entry) -> list[Numbered]:
    """Numbers of a network in its order, or of an effect of the library, with intervals."""
    law = law_of_entry(entry)
    known = {
        word: ParameterEstimate.from_json(each)
        for word, each in entry["parameters"].items()
        if each["field"] not in PLACES and each["mean"] is not None
    }
    if law is None:
        return [
            Numbered(spoken(word), entry["kind"], each.field, each.with_interval(), each)
            for word, each in known.items()
        ]
    return [
        _of_element(number, kind, known.get(".".join(filter(None, [path, number.field]))))
        for path, (owner, held) in zip(_paths(law), numbers(law), strict=True)
        for kind in [WORDS[owner.letter] if isinstance(owner, Element) else "factor"]
        for number in held
    ]


def _of_element(number: Number, kind: str, estimate: ParameterEstimate | None) -> Numbered:
    given = f"{number.value} {number.unit}".rstrip()
    words = given if estimate is None else estimate.with_interval()
    return Numbered(number.symbol, kind, number.field, words, estimate)


def _paths(law: Law, path: str = "law") -> Iterator[str]:
    """Path of each element in an effect, as its unknowns are named; a factor is of the effect."""
    if isinstance(law, Scaled):
        yield ""
        yield from _paths(law.law, path)
    elif isinstance(law, Group):
        for number, part in enumerate(law.parts, 1):
            yield from _paths(part, f"{path}.parts.{number}")
    else:
        yield path
