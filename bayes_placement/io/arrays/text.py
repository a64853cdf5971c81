"""Columns of text (CSV, TSV, blanks) as named arrays, and blocks of them as analysers write.

A block has lines `key: value`, then rows of numbers; the next follows.
"""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from itertools import groupby, takewhile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._shared.errors import InputError
from ...experiment._measurement_words import counted
from .._contents import decoded
from .._frf_units import is_unit
from .._gate import check_limit, existing, most, reading
from .named_arrays import NamedArrays

FORM = "columns of text"
"""What the files are, for messages."""

REMEDY = "Export the columns again, with a comma, a semicolon or a tab between them."
LONGEST_NAME = 500
_COMMENTS = ("#", "%", "//", "!")
_UNIT = re.compile(r"(?P<name>.*?)\s*[\[(](?P<unit>[^\[\]]*)[\])]\s*")
_ARGUMENT = re.compile(
    r"(re|real|im|imag|abs|mag|arg|angle|phase)\((H|FRF)\w*\)", re.IGNORECASE
)  # of a function, which is no unit
_FREQUENCY_UNITS = {"hz": "Hz", "khz": "kHz"}
_SEPARATORS = ("\t", ";", ",")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_NUMBER = re.compile(r"[+-]?(\d++\.?\d*+|\.\d++)([eEdD][+-]?\d++)?|nan|[+-]?inf", re.I | re.ASCII)


class Rows(NamedTuple):
    """Rows of a text file: names of its columns, cells, and lines before them that say nothing."""

    names: list[str]
    cells: list[list[str]]
    skipped: list[str]


def load(path: Path) -> NamedArrays:
    """Read columns of numbers, or of numbers and texts, by their heading.

    The columns are separated by tabs, semicolons, commas or blanks; a comma is the decimal point
    only where semicolons or tabs separate and no number has a point. The heading is the last line
    before the numbers; a unit may stand in it in brackets: `frequency [Hz]`, or all units in a line
    of their own below it. Columns without heading are `column 1` and so on.
    """
    with reading(path, FORM, REMEDY):
        rows = read_rows(path)
        return of_rows(path, FORM, rows.names, rows.cells, rows.skipped)


def read_rows(path: Path) -> Rows:
    """Read the rows of a file."""
    lines = lines_of(path)
    rows, decimal = _split_rows(lines)
    width = _width(rows)
    first = _first_of_numbers(rows, width, decimal)
    before = [*_commented(lines), *rows[:first]]
    cells = _with_points(rows[first:], decimal)
    _check_lengths(cells, width, first)
    return _with_names(before, cells)


def numbers_of(lines: list[str]) -> list[list[str]]:
    """Cells of rows of numbers."""
    rows, decimal = _split_rows(lines)
    cells = _with_points(rows, decimal)
    _check_lengths(cells, _width(rows), 0)
    return cells


def lines_of(path: Path) -> list[str]:
    """Lines of a file that are not blank."""
    return [line for line in text_of(path).splitlines() if line.strip()]


def read_table(path: Path) -> Rows:
    """Read a table whose first row, comments apart, names its columns; cells may be empty."""
    rows, decimal = _split_rows(lines_of(path))
    names, *cells = _with_points(rows, decimal)
    _check_lengths(cells, len(names), 1)
    return Rows(names, cells, [])


def of_rows(
    path: Path, form: str, names: Sequence[str], cells: list[list[str]], skipped: Sequence[str]
) -> NamedArrays:
    """Make named arrays of rows; a unit in brackets after a name is that of the array.

    A column whose name is too long or cannot be printed is named by its number; columns that differ
    in their units alone keep these in their names.
    """
    plain, units = {}, {}
    columns = zip(*cells, strict=True)
    headings = [split_unit(name) for name in names]
    often = Counter(label for label, _ in headings)
    for number, (name, column) in enumerate(zip(names, columns, strict=True), start=1):
        label, unit = headings[number - 1]
        label = name if often[label] > 1 else label
        if not label.strip() or not label.isprintable() or len(label) > LONGEST_NAME:
            label = f"column {number}"  # left out, it would shift the numbers of those behind it
        if label in plain:
            raise InputError(f"two columns are named {label!r}, and either could be meant")
        plain[label] = _column(label, column)
        if unit is not None:
            units[label] = unit
    left_out = {f"line {text[:60]!r}": "it is before the columns" for text in skipped}
    return NamedArrays(path, form, plain, units, left_out)


def split_unit(heading: str) -> tuple[str, str | None]:
    """Name and unit of a heading such as `H [dB]`; None where no unit stands behind the name."""
    match = _UNIT.fullmatch(heading[:LONGEST_NAME])
    if match is None or not match["name"] or _ARGUMENT.fullmatch(heading.strip()):
        return heading, None
    return match["name"], match["unit"].strip()


def plain_name(heading: str) -> tuple[str, str | None]:
    """Name of a heading in small letters with _ for blanks, and its unit, None where it has none.

    `Frequency [Hz]` and `frequency_hz` are one.
    """
    name, unit = split_unit(heading)
    *words, last = re.split(r"[\s_]+", name.strip().lower())
    if words and last in _FREQUENCY_UNITS:
        return "_".join(words), unit or _FREQUENCY_UNITS[last]
    return "_".join([*words, last]), unit


def is_number(cell: str) -> bool:
    """Whether a cell is a number."""
    return _NUMBER.fullmatch(cell.strip()) is not None


def text_of(path: Path) -> str:
    """Text of a file, in UTF-8, UTF-16 or Latin-1."""
    check_limit("bytes of text", existing(path, "a text file").stat().st_size)
    text = decoded(path.read_bytes())
    if "\0" in text:
        raise InputError("it holds bytes that are no text")
    return text


def _split_rows(lines: list[str]) -> tuple[list[list[str]], str]:
    """Cells of the lines that are no comments, and the decimal point in them."""
    plain = [line for line in lines if not line.lstrip().startswith(_COMMENTS)]
    if not plain:
        raise InputError("it has no row")
    separator = _separator(plain)
    _check_cells(plain, separator)
    rows = [_split(line, separator) for line in plain]
    return rows, decimal_point(rows) if separator in ("\t", ";") else "."


def _check_cells(lines: list[str], separator: str) -> None:
    """Count cells before each becomes a text, which takes a hundred bytes."""
    if sum(map(len, lines)) > most("cells of text"):
        cell = re.compile(re.escape(separator) or r"\S+")
        check_limit("cells of text", sum(1 for line in lines for _ in cell.finditer(line)))


def _width(rows: list[list[str]]) -> int:
    """Number of columns of most rows."""
    return Counter(map(len, rows)).most_common(1)[0][0]


def decimal_point(rows: list[list[str]]) -> str:
    """Return the decimal point of numbers that commas do not separate."""
    width = _width(rows)  # lines above the columns may hold anything
    cells = [cell for row in rows if len(row) == width for cell in row]
    with_comma = [cell for cell in cells if "," in cell and is_number(with_point(cell, ","))]
    if not with_comma:
        return "."
    pointed = next((cell for cell in cells if "." in cell and is_number(cell)), None)
    if pointed is not None or all(map(_THOUSANDS.fullmatch, with_comma)):
        counterpart = f"and also {pointed}" if pointed else "and others like it"
        raise InputError(
            f"it holds the number {with_comma[0]} {counterpart}, whose comma may be a decimal "
            "point or part the thousands"
        )
    return ","


def _separator(lines: list[str]) -> str:
    """What separates the columns: the separator of most rows, else blanks."""
    rows = [sum(separator in line for line in lines) for separator in _SEPARATORS]
    most = max(rows)
    return _SEPARATORS[rows.index(most)] if 2 * most > len(lines) else ""


def _split(line: str, separator: str) -> list[str]:
    if not separator:
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]
    except csv.Error as error:
        raise InputError(
            f"one of its cells has more than {csv.field_size_limit()} letters, and a cell is a "
            "number or a name"
        ) from error


def _commented(lines: list[str]) -> list[list[str]]:
    """Comments before the first row, as rows: a heading may be one."""
    head = takewhile(lambda line: line.lstrip().startswith(_COMMENTS), lines)
    texts = [line.lstrip().lstrip("#%/!").strip() for line in head]
    return [_split(text, _separator([text])) for text in texts if text]


def _with_points(rows: list[list[str]], decimal: str) -> list[list[str]]:
    """Rows with points in the numbers."""
    if decimal == ".":
        return rows
    return [[with_point(cell, decimal) for cell in row] for row in rows]


def with_point(cell: str, decimal: str) -> str:
    """Return a number with a point in the place of its decimal sign; other cells as they are."""
    pointed = cell.replace(",", ".") if decimal == "," and cell.count(",") == 1 else cell
    return pointed if is_number(pointed) else cell


def _first_of_numbers(rows: list[list[str]], width: int, decimal: str) -> int:
    """First of the rows that have a number; the heading of a table has none."""
    for number, row in enumerate(rows):
        if len(row) == width and any(is_number(with_point(cell, decimal)) for cell in row):
            return number
    raise InputError(
        "no row of it has a number; measured FRFs are needed as columns of numbers, a row for each "
        "frequency, with a heading above them: frequency [Hz], s1+x/a1+x real [(m/s^2)/N], "
        "s1+x/a1+x imaginary [(m/s^2)/N]"
    )


def _check_lengths(cells: list[list[str]], width: int, first: int) -> None:
    for number, row in enumerate(cells, start=first + 1):
        if len(row) != width:
            raise InputError(
                f"row {number} has {counted(len(row), 'column')} and earlier ones have {width}; a "
                "cell is missing or left over"
            )


def _with_names(before: list[list[str]], cells: list[list[str]]) -> Rows:
    """The heading is the last line before the numbers that has a word for each column."""
    width = len(cells[0])
    if len(before) > 1 and _is_row_of_units(before[-1]) and len(before[-2]) == width:
        *before, names, units = before
        named = (name or f"column {number}" for number, name in enumerate(names, start=1))
        whole = [f"{name} [{u.strip('[]')}]" for name, u in zip(named, units, strict=True)]
        before = [*before, whole]
    if before and len(before[-1]) == width and not any(map(is_number, before[-1])):
        *skipped, names = before
        return Rows(names, cells, [" ".join(row) for row in skipped])
    names = [f"column {number}" for number in range(1, width + 1)]
    return Rows(names, cells, [" ".join(row) for row in before])


def _is_row_of_units(row: list[str]) -> bool:
    """Whether each cell is a unit, one of them a known one, so that the names stand above."""
    cells = [cell.strip("[]") for cell in row]
    return any(map(is_unit, cells)) and all(not cell or is_unit(cell) for cell in cells)


def _column(name: str, cells: Sequence[str]) -> np.ndarray:
    if all(map(_NUMBER.fullmatch, cells)):  # which are many, so that no function of ours is called
        return np.array([float(cell.lower().replace("d", "e")) for cell in cells])
    numeric = [is_number(cell) for cell in cells]
    if any(numeric):
        wrong = cells[numeric.index(False)]
        raise InputError(f"the column {name!r} holds numbers and {wrong!r}, which is none")
    return np.array(cells)


_KEY = re.compile(r"(?P<key>[^:\t]{1,60}):\s*(?P<value>.*)")
_FEWEST_KEYS = 2  # a single line between rows may be a damaged row
_X, _Y = "x-axis", "y-axis"


class TextBlock(NamedTuple):
    """A block: what its head says, by key in lower case, and its rows as lines of text."""

    stated: dict[str, str]
    lines: list[str]


def load_text(path: Path) -> NamedArrays:
    """Read blocks of rows, or else columns by their heading."""
    with reading(path, FORM, REMEDY):
        blocks = blocks_of(lines_of(path))
        return of_blocks(path, blocks) if blocks else load(path)


def blocks_of(lines: list[str]) -> list[TextBlock]:
    """Blocks of a text; none where it has fewer than two, or their heads say other things."""
    groups = [list(group) for _, group in groupby(lines, key=_is_row)]
    heads, rows = groups[::2], groups[1::2]
    if len(rows) < 2 or len(heads) != len(rows) or _is_row(lines[0]):
        return []
    blocks = [TextBlock(_stated(head), body) for head, body in zip(heads, rows, strict=True)]
    keys = {tuple(block.stated) for block in blocks}
    complete = all(
        len(block.stated) == len(head) for block, head in zip(blocks, heads, strict=True)
    )
    return blocks if complete and len(keys) == 1 and len(min(keys)) >= _FEWEST_KEYS else []


def of_blocks(path: Path, blocks: list[TextBlock]) -> NamedArrays:
    """Make named arrays of blocks: `Point 1 column 3`, where the heads differ in `Point 1`.

    The column that the head describes as the x axis is `Point 1 x-axis`, in its unit; others are in
    the unit of the y axis.
    """
    arrays: dict[str, np.ndarray] = {}
    units: dict[str, str] = {}
    for label, block in zip(_labels(blocks), blocks, strict=True):
        cells = numbers_of(block.lines)
        names = [f"{label} column {number}" for number in range(1, len(cells[0]) + 1)]
        known = of_rows(path, FORM, names, cells, ())
        for name, values in known.arrays.items():
            if np.array_equal(values, np.arange(1, values.size + 1)):  # the number of the row
                continue
            is_x = _is_x(values, block.stated)
            named = f"{label} {_X}" if is_x else name
            arrays[named] = values
            unit = block.stated.get(f"{_X if is_x else _Y} unit", "")
            if unit:
                units[named] = unit
    said = {f"{key} of the blocks": "it is above the rows" for key in blocks[0].stated}
    return NamedArrays(path, f"{FORM} in {len(blocks)} blocks", arrays, units, said)


def _is_row(line: str) -> bool:
    return is_number(with_point(re.split(r"[\t;,\s]", line.strip())[0], ","))


def _stated(head: list[str]) -> dict[str, str]:
    matches = filter(None, map(_KEY.fullmatch, map(str.strip, head)))
    return {match["key"].strip().lower(): match["value"].strip() for match in matches}


def _labels(blocks: list[TextBlock]) -> list[str]:
    """Names of the blocks, by what tells them apart; by their numbers where nothing does."""
    differing = [key for key in blocks[0].stated if len({b.stated[key] for b in blocks}) > 1]
    labels = [" ".join(block.stated[key] for key in differing) for block in blocks]
    distinct = len(set(labels)) == len(labels) and all(labels)
    return labels if distinct else [f"block {number}" for number in range(1, len(blocks) + 1)]


def _is_x(values: np.ndarray, stated: dict[str, str]) -> bool:
    """Whether a column has the first value and the steps that the head states for the x axis."""
    words = [with_point(stated.get(f"{_X} {what}", ""), ",") for what in ("first", "delta")]
    if not all(map(is_number, words)) or values.dtype.kind != "f":
        return False
    first, step = map(float, words)
    return bool(np.allclose(values, first + step * np.arange(values.size), atol=0.1 * abs(step)))
