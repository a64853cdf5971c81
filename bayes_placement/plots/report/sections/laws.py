"""Where each claimed effect acts, its law as a network, and what laws at each place could do."""

from collections.abc import Iterator

from ...._shared.files import Json
from ....criticism.missing._claims_in_words import (
    Numbered,
    claims_in_words,
    law_of_entry,
    numbers_of,
    what_in_words,
    where_in_words,
)
from ....laws.law import Law
from ....laws.symbols import Number, Owned, drawing, numbers
from .._saved import Saved
from .._svg import checked_svg
from ..content import Cell, Drawing, Item, Table, Text
from ..report import LAWS, SUSPICION

TAGS = ("effect", "law")

NUMBERS = ("number", "of", "value", "95 % from", "95 % to", "unit")
"""Columns of the numbers of a law."""

FIGURES = {
    "reach": (
        SUSPICION,
        "What one law at each place could do",
        "Pale: share of the misfit that any law at a place could remove; dark: what a law of few "
        "numbers removes; where both are flat, these sensors do not tell the place.",
    ),
    "law": (
        LAWS,
        "The law as measured",
        "The law that the data ask for at the place, line by line with 95 % intervals, and the "
        "most probable networks through it.",
    ),
}
"""Section, title and caption of each figure of the run, by the name of its files."""


def items(saved: Saved) -> Iterator[Item]:
    """Say where each claimed effect acts, draw its law, and show what other laws could do."""
    if saved.effects:
        claimed = claims_in_words([{**entry, "equivalent": []} for entry in saved.effects])
        yield Item(LAWS, "Where it acts", Text(tuple(claimed)), tags=TAGS)
    for number, entry in enumerate(saved.effects, 1):
        yield from _of_effect(entry, f" {number}" if len(saved.effects) > 1 else "")
    for name, (section, title, caption) in FIGURES.items():
        svg, table = saved.drawing(f"{name}.svg"), saved.table(f"{name}.csv")
        if svg is not None and table is not None:
            data = Table.of(table.dropna(axis="columns", how="all"))
            yield Item(section, title, Drawing(svg, data, follows_theme=True), caption, TAGS)
    others = [each for entry in saved.effects for each in (entry, *entry["equivalent"])]
    if len(others) > len(saved.effects):
        words = "Other explanations that fit the data as well as the effect that is claimed."
        yield Item(LAWS, "What the data do not tell apart", _equivalent(others), words, TAGS)


def _of_effect(entry: Json, number: str) -> Iterator[Item]:
    """Draw the network of an effect, and list the numbers of any."""
    known, law = numbers_of(entry), law_of_entry(entry)
    table = Table(NUMBERS, tuple(map(_row, known)))
    if law is not None:
        svg = checked_svg(drawing(law, _written(law, known)))
        words = (
            f"{entry['kind']}, {where_in_words(entry)}, from its place on the structure (the "
            "circle at the left) to the ground or the other side; with 95 % intervals."
        )
        yield Item(LAWS, f"Network{number}", Drawing(svg, table, follows_theme=True), words, TAGS)
    if known:
        words = f"Numbers of {entry['kind']}, {where_in_words(entry)}."
        yield Item(LAWS, f"Numbers{number}", table, words, TAGS)


def _row(number: Numbered) -> tuple[Cell, ...]:
    if number.estimate is None:
        return (number.symbol, number.what, number.words, None, None, "given")
    *cells, unit = number.estimate.for_people()
    return (number.symbol, number.what, *map(float, cells), unit)


def _written(law: Law, known: list[Numbered]) -> list[Owned]:
    """Numbers of a law with their intervals, as they stand below its elements."""
    rest = iter(known)
    return [
        (owner, [_with_interval(number, next(rest)) for number in of_owner])
        for owner, of_owner in numbers(law)
    ]


def _with_interval(number: Number, known: Numbered) -> Number:
    if known.estimate is None:
        return number
    mean, low, high, unit = known.estimate.for_people()
    return number._replace(value=f"{mean} ({low} to {high})", unit=unit)


def _equivalent(entries: list[Json]) -> Table:
    shares = [entry["probability"] for entry in entries]
    rounded = [None if share is None else float(f"{share:.2g}") for share in shares]
    rows = tuple(
        (where_in_words(entry), what_in_words(entry), share)
        for entry, share in zip(entries, rounded, strict=True)
    )
    return Table(("where", "what", "probability [1]"), rows)
