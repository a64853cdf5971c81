"""Text of an analyser in blocks: lines `key: value`, then rows of numbers, again and again."""

import re
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .._gate import reading
from . import text
from .named_arrays import NamedArrays
from .text import FORM, is_number, numbers_of, of_rows, with_point

_KEY = re.compile(r"(?P<key>[^:\t]{1,60}):\s*(?P<value>.*)")
_FEWEST_KEYS = 2  # a single line between rows may be a damaged row
_X, _Y = "x-axis", "y-axis"


class TextBlock(NamedTuple):
    """A block: what its head says, by key in lower case, and its rows as lines of text."""

    stated: dict[str, str]
    lines: list[str]


def load(path: Path) -> NamedArrays:
    """Read blocks of rows, or else columns by their heading."""
    with reading(path, FORM, text.REMEDY):
        blocks = blocks_of(text.lines_of(path))
        return of_blocks(path, blocks) if blocks else text.load(path)


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
            if _counts(values):
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


def _counts(values: np.ndarray) -> bool:
    """Whether a column is the number of the row."""
    return bool(np.array_equal(values, np.arange(1, values.size + 1)))
