"""Symbols of the numbers of a network, their values in words, and its stiffness as a formula."""

import dataclasses
from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple, TypeAlias

import pandas as pd

from .._shared.reprs import in_words
from .._shared.sites import stated_unit
from .law import Element, Group, Law, Parallel, Scaled, Series

GREEK = {"alpha": "α", "eta": "η", "lambda": "λ"}  # noqa: RUF001
"""Letters of symbols that are written as words."""

SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


class Number(NamedTuple):
    """A number of an element, or the strength of a law."""

    letter: str
    numeral: str
    """Its symbol; the numeral is empty where the letter occurs once."""
    field: str
    """Its name in the element."""
    value: str
    unit: str
    """Its value or prior in words, and the unit; that of a pure number is empty."""

    @property
    def latex(self) -> str:
        r"""Symbol in a formula: `\alpha_2`."""
        letter = rf"\{self.letter}" if self.letter in GREEK else self.letter
        numeral = f"{{{self.numeral}}}" if len(self.numeral) > 1 else self.numeral
        return f"{letter}_{numeral}" if numeral else letter

    @property
    def symbol(self) -> str:
        """Symbol in a text: α₂."""
        return GREEK.get(self.letter, self.letter) + self.numeral.translate(SUBSCRIPTS)


Owned: TypeAlias = tuple[Element | Scaled, list[Number]]
"""An element or a factor on a law, and its numbers."""


def numbers(law: Law) -> list[Owned]:
    """Numbers of a network in its order, a factor before what it multiplies.

    Examples
    --------
    >>> from bayes_placement.laws.symbols import numbers
    >>> law = bp.effects.Spring(1e4) | bp.effects.Spring(2e4) - bp.effects.Mass(0.1)
    >>> [number.symbol for _, held in numbers(law) for number in held]
    ['k₁', 'k₂', 'm']
    """
    owners = [*_owners(law)]
    occurring = Counter(letter for owner in owners for letter in owner.symbols)
    so_far: Counter[str] = Counter()
    return [(owner, [*_of_owner(owner, occurring, so_far)]) for owner in owners]


def table(law: Law) -> pd.DataFrame:
    """Symbol, element, field, value and unit of each number of a network."""
    rows = [
        (number.symbol, type(owner).__name__, number.field, number.value, number.unit)
        for owner, held in numbers(law)
        for number in held
    ]
    return pd.DataFrame(rows, columns=["symbol", "element", "field", "value", "unit"])


def _owners(law: Law) -> Iterator[Element | Scaled]:
    if isinstance(law, Element | Scaled):
        yield law
    if isinstance(law, Scaled):
        yield from _owners(law.law)
    if isinstance(law, Group):
        for part in law.parts:
            yield from _owners(part)


def _of_owner(
    owner: Element | Scaled, occurring: "Counter[str]", so_far: "Counter[str]"
) -> Iterator[Number]:
    """Numbers of an element; letters that occur more than once are numbered."""
    fields = [field for field in dataclasses.fields(owner) if "unit" in field.metadata]
    for letter, field in zip(owner.symbols, fields, strict=True):
        so_far[letter] += 1
        numeral = str(so_far[letter]) if occurring[letter] > 1 else ""
        unit = stated_unit(field.metadata, owner)
        value = in_words(getattr(owner, field.name))
        yield Number(letter, numeral, field.name, value, "" if unit == "1" else unit)


def formula(law: Law) -> str:
    r"""LaTeX of the dynamic stiffness, with the symbols of `symbols.numbers`.

    Examples
    --------
    >>> from bayes_placement.laws.symbols import formula
    >>> print(formula(bp.effects.Spring(1e4) - bp.effects.Mass(0.1)))
    \left(\frac{1}{k} + \frac{1}{-\omega^2 m}\right)^{-1}
    """
    return _formula(law, iter(numbers(law)))


def _formula(law: Law, owned: Iterator[Owned]) -> str:
    if isinstance(law, Series):
        inverses = " + ".join(_inverse(_formula(part, owned)) for part in law.parts)
        return rf"\left({inverses}\right)^{{-1}}"
    if isinstance(law, Parallel):
        return " + ".join(_formula(part, owned) for part in law.parts).replace("+ -", "- ")
    symbols = [number.latex for number in next(owned)[1]]
    if isinstance(law, Scaled):
        return f"{symbols[0]} {_factor(law.law, _formula(law.law, owned))}"
    return law.formula.format(*symbols)  # type: ignore[attr-defined]


def _inverse(term: str) -> str:
    return rf"\frac{{1}}{{{term}}}"


def _factor(law: Law, term: str) -> str:
    """Formula of a law as a factor: a sum, or what begins with a minus, stands in brackets."""
    bare = not isinstance(law, Parallel) and not term.startswith("-")
    return term if bare else rf"\left({term}\right)"
