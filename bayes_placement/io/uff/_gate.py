"""Checks of a universal file: every field of the datasets that are read, by its columns."""

import re
from collections.abc import Callable, Iterator, Sequence
from itertools import accumulate, pairwise
from typing import NamedTuple

INTEGER = re.compile(r"\s*[+-]?\d+\s*|\s*", re.ASCII)
"""A whole number in its columns, or blanks, which stand for zero."""

NUMBER = re.compile(r"\s*[+-]?(\d++\.?\d*+|\.\d++)([eEdD][+-]?\d++|[+-]\d{3})?\s*", re.ASCII)
"""A real number in its columns; Fortran has no letter before an exponent of three digits."""

_INTEGER_WORD = re.compile(r"[+-]?\d+", re.ASCII)
_LONGEST_INTEGER = 18  # digits, which an integer of 64 bits has

HEAD_LINES = 11
REAL, _OF_TWO_PARTS = 2, 5
NORMAL, COMPLEX = 2, (3, 7)
"""Analysis types of modes: real ones, and complex ones of the first and of the second order."""

_FUNCTION_FIELDS = {
    "function type": (0, 5),
    "function number": (5, 15),
    "version": (15, 20),
    "load case": (20, 30),
    "response node": (41, 51),
    "response direction": (51, 55),
    "reference node": (66, 76),
    "reference direction": (76, 80),
}
_STATED_FIELDS = (
    "function type",
    "response node",
    "response direction",
    "reference node",
    "reference direction",
)
_BLANK_COLUMNS = (30, 55)
_FORM_FIELDS = {"ordinate type": (0, 10), "count": (10, 20), "spacing": (20, 30)}
_FORM_NUMBERS = {"first abscissa": (30, 43), "abscissa step": (43, 56)}
_AXES = {7: "abscissa", 8: "ordinate", 9: "ordinate denominator"}
_AXIS_WIDTHS = (10, 5, 5, 5)

LAYOUT = {2: (4, 1), 4: (8, 1), 5: (4, 2), 6: (8, 2)}
"""Bytes of a number and numbers of an ordinate, by the ordinate data type of dataset 58."""


class FormatFault(NamedTuple):
    """What is against the format: the line of the dataset, from 1, and a sentence without end."""

    line: int
    what: str


def faults(number: int, lines: Sequence[str], *, binary: bool = False) -> Iterator[FormatFault]:
    """Faults of one dataset, by the lines after its number; of a binary one by eleven."""
    if number == 58 and binary:
        return _function_head(lines)
    return _CHECKS[number](lines)


def columns(line: str, widths: Sequence[int]) -> list[str]:
    """Cut a line into fields of some widths."""
    edges = [0, *accumulate(widths)]
    return [line[low:high] for low, high in pairwise(edges)]


def _function_head(lines: Sequence[str]) -> Iterator[FormatFault]:
    """Faults of the eleven lines before the values of dataset 58."""
    if len(lines) < HEAD_LINES:
        yield FormatFault(len(lines), "its head has less than eleven lines")
        return
    yield from _wrong_fields(lines, 5, _FUNCTION_FIELDS, INTEGER, "whole number")
    yield from _blank_fields(lines[5].ljust(80))
    yield from _wrong_fields(lines, 6, _FORM_FIELDS, INTEGER, "whole number")
    yield from _wrong_fields(lines, 6, _FORM_NUMBERS, NUMBER, "number")
    for number, name in _AXES.items():
        cells = columns(lines[number].ljust(80), _AXIS_WIDTHS)
        wrong = [text for text in cells if not INTEGER.fullmatch(text)]
        if wrong:
            yield FormatFault(number + 1, f"a type or unit exponent of the {name} is {wrong[0]!r}")


def _blank_fields(line: str) -> Iterator[FormatFault]:
    """Faults of record 6 that a shift by a column makes: its numbers then end in the gaps."""
    for name in _STATED_FIELDS:
        low, high = _FUNCTION_FIELDS[name]
        if not line[low:high].strip():
            yield FormatFault(6, f"the {name} (columns {low + 1} to {high}) is blank")
        elif line[high - 1].isspace():
            yield FormatFault(
                6, f"the {name} (columns {low + 1} to {high}) ends before its columns do"
            )
    if line[80:].strip():
        yield FormatFault(6, f"{line[80:].strip()!r} stands behind its last field")
    for column in _BLANK_COLUMNS:
        if line[column].strip():
            yield FormatFault(6, f"column {column + 1} between two fields holds {line[column]!r}")


def _wrong_fields(
    lines: Sequence[str],
    number: int,
    fields: dict[str, tuple[int, int]],
    rule: re.Pattern[str],
    noun: str,
) -> Iterator[FormatFault]:
    line = lines[number].ljust(80)
    for name, (low, high) in fields.items():
        if not rule.fullmatch(line[low:high]):
            what = f"the {name} (columns {low + 1} to {high}) is {line[low:high]!r}, no {noun}"
            yield FormatFault(number + 1, what)


def _function(lines: Sequence[str]) -> Iterator[FormatFault]:
    """Faults of dataset 58 with values as text."""
    head = list(_function_head(lines))
    yield from head
    if head:
        return
    kind, count, even = (int(text or 0) for text in _form(lines[6]))
    if kind not in LAYOUT or even not in (0, 1) or count < 1:
        yield FormatFault(
            7, f"type {kind}, count {count} and spacing {even} are not those of values"
        )
        return
    total = 0
    widths = value_widths(kind, even)
    for number, line in enumerate(lines[HEAD_LINES:], start=HEAD_LINES + 1):
        values = [text for text in columns(line, widths) if text.strip()]
        wrong = [text for text in values if not NUMBER.fullmatch(text)]
        surplus = line[sum(widths) :].strip()
        if wrong or surplus or _is_cut(line, widths):
            what = (
                f"{wrong[0]!r} is no number in its columns"
                if wrong
                else f"{surplus!r} stands behind them"
            )
            yield FormatFault(number, what if wrong or surplus else "its last number is cut off")
            return
        total += len(values)
    announced = count * (LAYOUT[kind][1] + (even == 0))
    if total != announced:
        yield FormatFault(7, f"{announced} numbers are announced and {total} are there")


def _is_cut(line: str, widths: Sequence[int]) -> bool:
    """Whether a line ends inside the columns of a number."""
    return len(line.rstrip()) not in (0, *accumulate(widths))


def _form(line: str) -> list[str]:
    return [text.strip() for text in columns(line.ljust(80), (10, 10, 10))]


def value_widths(kind: int, even: int) -> tuple[int, ...]:
    """Return the widths of the numbers of a line, by ordinate type and spacing."""
    if kind in (2, 5):
        return (13,) * 6
    if even:
        return (20,) * 4
    return (13, 20, 20) if kind == 6 else (13, 20, 13, 20)


def _nodes_15(lines: Sequence[str]) -> Iterator[FormatFault]:
    for number, line in enumerate(lines, start=1):
        if line.strip():
            yield from _counted(number, words_of_node(line), 4, 3)


def words_of_node(line: str) -> list[str]:
    """Return the numbers of a node of dataset 15, by their columns where no blank parts them."""
    words = line.split()
    if len(words) == 7:
        return words
    return [text.strip() for text in columns(line, (10,) * 4 + (13,) * 3)]


def _nodes_2411(lines: Sequence[str]) -> Iterator[FormatFault]:
    stated = [(number, line.split()) for number, line in enumerate(lines, 1) if line.strip()]
    if len(stated) % 2:
        yield FormatFault(stated[-1][0], "a node has no line of coordinates")
    for index, (number, words) in enumerate(stated):
        yield from _counted(number, words, *((4, 0) if index % 2 == 0 else (0, 3)))


def _units_164(lines: Sequence[str]) -> Iterator[FormatFault]:
    if not lines or not INTEGER.fullmatch(lines[0][:10]):
        yield FormatFault(1, "the code of the units is no whole number")
    words = " ".join(lines[1:]).split()
    yield from _counted(2, words, 0, 4)


def _counted(number: int, words: Sequence[str], integers: int, reals: int) -> Iterator[FormatFault]:
    """Fault of a line in free columns: so many whole numbers, then so many real ones."""
    if len(words) != integers + reals:
        yield FormatFault(
            number, f"{integers + reals} numbers are needed and {len(words)} are there"
        )
        return
    for place, word in enumerate(words):
        is_integer = place < integers
        right = _INTEGER_WORD.fullmatch(word) if is_integer else NUMBER.fullmatch(word)
        if not right or (is_integer and len(word) > _LONGEST_INTEGER):
            yield FormatFault(number, f"{word!r} is no {'whole ' if is_integer else ''}number")
            return


def _mode(lines: Sequence[str]) -> Iterator[FormatFault]:
    """Faults of dataset 55; only those of its kinds where it holds no mode."""
    if len(lines) < 8:
        yield FormatFault(len(lines), "its head has less than eight lines")
        return
    kinds = columns(lines[5].ljust(80), (10,) * 6)
    if not all(map(INTEGER.fullmatch, kinds)):
        yield FormatFault(6, "a kind of its data is no whole number")
        return
    analysis, data_type, count = (int(kinds[place].strip() or 0) for place in (1, 4, 5))
    if analysis not in (NORMAL, *COMPLEX):
        return
    integers, reals = columns(lines[6].ljust(80), (10,) * 4), columns(lines[7].ljust(80), (13,) * 6)
    if not all(map(INTEGER.fullmatch, integers)):
        yield FormatFault(7, "the load case or the number of the mode is no whole number")
    if not all(NUMBER.fullmatch(text) for text in reals[: 3 if analysis == NORMAL else 4]):
        yield FormatFault(8, "the frequency, modal mass or damping is no number")
    if data_type not in (REAL, _OF_TWO_PARTS) or count < 1:
        yield FormatFault(6, f"{count} numbers of data type {data_type} are no values of a node")
        return
    yield from _records(lines[8:], count, data_type)


def lines_of_node(count: int, data_type: int) -> int:
    """Return the number of lines with the values of a node, of which six stand in each."""
    return -(-_numbers_of_node(count, data_type) // 6)


def _numbers_of_node(count: int, data_type: int) -> int:
    return count * (1 if data_type == REAL else 2)


def _records(lines: Sequence[str], count: int, data_type: int) -> Iterator[FormatFault]:
    """Faults of the records of the nodes: a line with the number, and those with its values."""
    step, needed = 1 + lines_of_node(count, data_type), _numbers_of_node(count, data_type)
    for index in range(0, len(lines), step):
        node, *rows = lines[index : index + step]
        if not node.strip() or not INTEGER.fullmatch(node):
            yield FormatFault(index + 9, f"{node.strip()!r} is no number of a node")
            return
        words = [text for row in rows for text in columns(row, (13,) * 6) if text.strip()]
        surplus = any(row[78:].strip() for row in rows)
        if len(words) != needed or surplus or not all(map(NUMBER.fullmatch, words)):
            what = f"{needed} numbers of a node are announced, not {' '.join(rows)!r}"
            yield FormatFault(index + 10, what)
            return


_CHECKS: dict[int, Callable[[Sequence[str]], Iterator[FormatFault]]] = {
    15: _nodes_15,
    2411: _nodes_2411,
    164: _units_164,
    58: _function,
    55: _mode,
}
