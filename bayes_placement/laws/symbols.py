"""Numbers of a network by symbols, its stiffness as a formula, and its drawing as SVG."""

import dataclasses
from collections import Counter
from collections.abc import Iterator, Sequence
from html import escape
from itertools import accumulate, pairwise
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
        inverses = " + ".join(rf"\frac{{1}}{{{_formula(part, owned)}}}" for part in law.parts)
        return rf"\left({inverses}\right)^{{-1}}"
    if isinstance(law, Parallel):
        return " + ".join(_formula(part, owned) for part in law.parts).replace("+ -", "- ")
    symbols = [number.latex for number in next(owned)[1]]
    if isinstance(law, Scaled):
        return f"{symbols[0]} {_factor(law.law, _formula(law.law, owned))}"
    return law.formula.format(*symbols)  # type: ignore[attr-defined]


def _factor(law: Law, term: str) -> str:
    """Formula of a law as a factor: a sum, or what begins with a minus, stands in brackets."""
    bare = not isinstance(law, Parallel) and not term.startswith("-")
    return term if bare else rf"\left({term}\right)"


CORE, HALF = 36.0, 12.0
"""Width and half of the height of an element without its lines [px]."""

PITCH, GAP, STUB, PADDING = 64.0, 10.0, 8.0, 10.0
"""Least width with lines, space between branches, lines at nodes, space around a factor [px]."""

FONT, LINE, LETTER = 11.0, 13.0, 6.8
"""Height of letters and of lines, width of a letter [px]."""

TEXT = 'fill="currentColor" stroke="none" text-anchor="middle"'

LONGEST = 30
"""Letters of a value below an element; the table has all of them."""

GLYPHS = {
    "k": "l3-8 6 16 6-16 6 16 6-16 6 16 3-8",
    "c": "h8m20-9h-20v18h20m-6-3v-12m0 6h14",
    "m": "m0 0v-12h36v24h-36z",
    "p": "m0 0l18-12 18 12-18 12zm36 0",
    "h": "l2.5-8 5 16 5-16 5 16 5-16 2.5 8h11m-8 6l4-12m0 12l4-12m0 6",
    "t": "m0-9h36v18h-36zm4 13l7-8 7 5 7-7 7 4m4 2",
}
"""Path of each element, from the end of one line to the start of the other."""

GROUND = "v-12v24m0-21l7-5m-7 11l7-5m-7 11l7-5m-7 11l7-5"
"""Wall with hatching, from the end of a line."""

POINTS = 0.75
"""Points of 1/72 inch in a pixel."""


class End(NamedTuple):
    """Right end of a branch; one that is a mass needs no ground."""

    x: float
    y: float
    is_mass: bool = False

    def moved(self, x: float, y: float) -> "End":
        """Return the end of a branch that was moved."""
        return End(self.x + x, self.y + y, self.is_mass)


class Piece(NamedTuple):
    """Part of a drawing, whose left end is the origin."""

    marks: str
    """SVG."""
    width: float
    above: float
    below: float
    """Space that it takes [px]."""
    ends: tuple[End, ...]
    """Right ends, where it can go on."""
    is_heavy: bool = False
    """Whether a mass is in it."""


def drawing(law: Law, known: Sequence[Owned] | None = None) -> str:
    """SVG of a network in the colour and the family of letters of what is around it.

    Series go from left to right, parallel branches lie below each other, and a factor stands below
    a broken frame. Of a chain the part with masses comes last. A mass that is not the end of a
    chain even so moves against what comes next, not against the ground: a line leaves it. Numbers
    that are written are in the order of `symbols.numbers`, by default those of the law.

    Examples
    --------
    >>> from bayes_placement.laws.symbols import drawing
    >>> drawing(bp.effects.Spring(1e4)).count("<path")
    2
    """
    owned = numbers(law) if known is None else known
    return _svg(_grounded(_piece(law, iter(owned))), repr(law))


def _piece(law: Law, owned: Iterator[Owned]) -> Piece:
    if isinstance(law, Series):
        return _chain([_piece(part, owned) for part in law.parts])
    if isinstance(law, Parallel):
        return _stack([_piece(part, owned) for part in law.parts])
    owner, held = next(owned)
    if isinstance(owner, Scaled):
        return _framed(_piece(owner.law, owned), held)
    return _element(type(owner).__name__, owner.letter, held)


def _element(kind: str, letter: str, held: Sequence[Number]) -> Piece:
    """Element between two lines, a mass at the end of one, with its values below."""
    width = max(PITCH, _text_width(held) + LETTER)
    start, is_mass = (width - CORE) / 2, letter == "m"
    line = "" if is_mass else f"H{width:g}"
    marks = f"{_path(f'M0 0H{start:g}{GLYPHS[letter]}{line}')}{_text(held, width / 2, HALF)}"
    end = End(start + CORE, 0, is_mass) if is_mass else End(width, 0)
    named = f"<g><title>{kind}</title>{marks}</g>"
    return Piece(named, width, HALF, HALF + LINE * len(held) + 3, (end,), is_mass)


def _chain(pieces: Sequence[Piece]) -> Piece:
    """Pieces one after the other, those with masses last."""
    *first, last = sorted(pieces, key=lambda piece: piece.is_heavy)
    row = [*map(_joined, first), last]
    at = [*accumulate((piece.width for piece in row), initial=0.0)]
    return Piece(
        "".join(_moved(piece, x, 0.0) for piece, x in zip(row, at[:-1], strict=True)),
        at[-1],
        max(piece.above for piece in row),
        max(piece.below for piece in row),
        tuple(end.moved(at[-2], 0.0) for end in last.ends),
        any(piece.is_heavy for piece in row),
    )


def _stack(pieces: Sequence[Piece]) -> Piece:
    """Pieces below each other, whose left ends are one node."""
    steps = (upper.below + GAP + lower.above for upper, lower in pairwise(pieces))
    down = [*accumulate(steps, initial=0.0)]
    rows = [(piece, y - down[-1] / 2) for piece, y in zip(pieces, down, strict=True)]
    node = _path(f"M0 0H{STUB:g}{_bar(STUB, [y for _, y in rows])}")
    return Piece(
        node + "".join(_moved(piece, STUB, y) for piece, y in rows),
        STUB + max(piece.width for piece in pieces),
        down[-1] / 2 + pieces[0].above,
        down[-1] / 2 + pieces[-1].below,
        tuple(end.moved(STUB, y) for piece, y in rows for end in piece.ends),
        any(piece.is_heavy for piece in pieces),
    )


def _framed(piece: Piece, held: Sequence[Number]) -> Piece:
    """Piece in a broken frame, with the factor on it below."""
    piece = piece if piece.is_heavy else _joined(piece)
    width = max(piece.width, _text_width(held)) + 2 * PADDING
    above, below = piece.above + PADDING / 2, piece.below + PADDING / 2
    frame = (
        f'<rect x="{PADDING / 2:g}" y="{-above:g}" width="{width - PADDING:g}" '
        f'height="{above + below:g}" rx="4" stroke-width="1" stroke-dasharray="4 3"/>'
    )
    lines = f"{_path(f'M0 0H{PADDING:g}')}{frame}{_text(held, width / 2, below)}"
    return piece._replace(
        marks=f"<g><title>Scaled</title>{lines}</g>{_moved(piece, PADDING, 0.0)}",
        width=width,
        above=above,
        below=below + LINE * len(held) + 3,
        ends=tuple(end.moved(PADDING, 0.0) for end in piece.ends),
    )


def _joined(piece: Piece) -> Piece:
    """Piece whose right ends are one node."""
    if len(piece.ends) == 1:
        lines, width = _lines(piece.ends, piece.width), piece.width
    else:
        bar = _bar(piece.width, [end.y for end in piece.ends])
        width = piece.width + STUB
        lines = f"{_lines(piece.ends, piece.width)}{bar}M{piece.width:g} 0H{width:g}"
    return piece._replace(marks=piece.marks + _path(lines), width=width, ends=(End(width, 0),))


def _grounded(piece: Piece) -> Piece:
    """Piece whose right ends stand on the ground, but for its masses."""
    standing = [end for end in piece.ends if not end.is_mass]
    walls = "".join(f"M{piece.width:g} {end.y:g}{GROUND}" for end in standing)
    marks = piece.marks + (_path(_lines(standing, piece.width) + walls) if standing else "")
    return piece._replace(marks=marks, width=piece.width + STUB)


def _lines(ends: Sequence[End], x: float) -> str:
    """Path of lines from the right ends to a place."""
    return "".join(f"M{end.x:g} {end.y:g}H{x:g}" for end in ends if end.x < x)


def _bar(x: float, heights: Sequence[float]) -> str:
    """Path of a node, as far as the outer edges of its lines."""
    return f"M{x:g} {min(heights) - 0.75:g}V{max(heights) + 0.75:g}"


def _path(steps: str) -> str:
    return f'<path d="{steps}"/>' if steps else ""


def _moved(piece: Piece, x: float, y: float) -> str:
    return f'<g transform="translate({x:g} {y:g})">{piece.marks}</g>'


def _text(held: Sequence[Number], x: float, y: float) -> str:
    """Values one below the other."""
    return "".join(
        f'<text x="{x:g}" y="{y + LINE * line:g}" {TEXT}>{escape(_label(number))}</text>'
        for line, number in enumerate(held, start=1)
    )


def _label(number: Number) -> str:
    """Symbol, value and unit of a number, in a few letters."""
    value = number.value
    value = value if len(value) <= LONGEST else f"{value[: LONGEST - 3]}..."
    return f"{number.symbol} = {value} {number.unit}".rstrip()


def _text_width(held: Sequence[Number]) -> float:
    return max(len(_label(number)) for number in held) * LETTER


def _svg(piece: Piece, words: str) -> str:
    """SVG with the port; widths in points are taken by browsers and by reports alike."""
    margin = 8
    width, height = piece.width + 2 * margin, piece.above + piece.below + 2 * margin
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{escape(words)}" '
        f'viewBox="{-margin} {-piece.above - margin:g} {width:g} {height:g}" '
        f'width="{width * POINTS:g}pt" height="{height * POINTS:g}pt" '
        f'style="max-width:100%;height:auto" font-family="sans-serif" font-size="{FONT:g}">'
        '<g fill="none" stroke="currentColor" stroke-width="1.5"><circle cx="-3" cy="0" r="3"/>'
        f"{piece.marks}</g></svg>"
    )
