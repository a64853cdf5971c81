"""LabVIEW text (.lvm): segments of channels, with units and intervals.

National Instruments, Specification for the LabVIEW Measurement File (.lvm), version 2.0.
"""

import itertools
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._shared.errors import InputError, warn
from .._gate import FileWarning
from ..arrays.text import decimal_point, is_number, text_of, with_point
from .clock import JITTER, Sampled, check_starts, rate_of_times
from .recording import same_rate

_END = re.compile(r"^\*\*\*End_of_Header\*\*\*.*$", re.MULTILINE)
_SPECIAL = re.compile(
    r"^\*\*\*Start_Special\*\*\*(.*\n(?!\*\*\*Start_Special))*?\*\*\*End_Special\*\*\*.*$", re.M
)
_SEPARATORS = {"Tab": "\t", "Comma": ",", "Semicolon": ";", "Space": " "}
_X, _COMMENT = "X_Value", "Comment"
"""Headings of columns that hold no channel."""

Row = list[str]


class _Channel(NamedTuple):
    """A channel of a segment; its start and rate are NaN where the file does not state them."""

    name: str
    unit: str
    dimension: str
    samples: np.ndarray
    start: float
    rate: float


class _Layout(NamedTuple):
    """How the rows of a file are written."""

    separator: str
    decimal: str

    def rows(self, text: str) -> list[Row]:
        """Cells of the lines that are not blank."""
        lines = (line for line in text.splitlines() if line.strip(f"{self.separator} "))
        return [[cell.strip() for cell in line.split(self.separator)] for line in lines]

    def number(self, cell: str) -> float:
        """Number in a cell, NaN where there is nothing in it."""
        pointed = with_point(cell, self.decimal) or "nan"
        if not is_number(pointed):
            raise InputError(f"{cell!r} stands where a number is needed; export it again.")
        return float(pointed)


def load(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels by their names, with unit and sampling rate.

    Segments that continue each other in time are joined. Where they do not, as for hits one by one,
    names are `segment 2/Hammer`.
    """
    segments = list(_segments(path))
    if not segments:
        raise InputError("it has no segment with channels; export it with the headers of segments")
    joined = _joined(segments)
    many = len(joined) > 1
    channels = {
        f"segment {number}/{channel.name}" if many else channel.name: channel
        for number, segment in enumerate(joined, start=1)
        for channel in segment
    }
    timed = {name: one for name, one in channels.items() if _is_record(one)}
    named = {name: timed[name].start for name in names if name in timed}
    check_starts({name: start for name, start in named.items() if np.isfinite(start)})
    return Sampled(
        arrays={name: channel.samples for name, channel in timed.items()},
        units={name: channel.unit for name, channel in timed.items()},
        rates={name: one.rate for name, one in timed.items() if np.isfinite(one.rate)},
        left_out={
            name: f"it is over {channel.dimension}, or holds no samples"
            for name, channel in channels.items()
            if name not in timed
        },
    )


def _is_record(channel: _Channel) -> bool:
    return channel.dimension in ("", "Time") and channel.samples.size > 0


def _segments(path: Path) -> Iterator[list[_Channel]]:
    """Channels of each segment: its tags end one part of the file, its rows begin the next."""
    head, *parts = _END.split(_SPECIAL.sub("", text_of(path)))
    layout = _layout(head, parts)
    for tags, body in itertools.pairwise([layout.rows(part) for part in parts]):
        stated = {row[0]: row for row in tags if row[0][:1].isalpha() and row[0] != _X}
        values = [row for row in body[1:] if not row[0][:1].isalpha()]
        yield list(_channels(path, layout, stated, body[0] if body else [], values))


def _layout(head: str, parts: list[str]) -> _Layout:
    """Separator and decimal sign as the header states them, else by the numbers."""
    separator = re.search(r"^Separator\W+(\w+)", head, re.MULTILINE)
    decimal = re.search(r"^Decimal_Separator.(\S)", head, re.MULTILINE)
    cells = _SEPARATORS.get(separator[1], "\t") if separator else "\t"
    rows = _Layout(cells, ".").rows("".join(parts[1:]))
    if decimal is not None or cells == "," or not rows:
        return _Layout(cells, decimal[1] if decimal else ".")
    return _Layout(cells, decimal_point(rows))


def _channels(
    path: Path, layout: _Layout, tags: dict[str, Row], heading: Row, rows: list[Row]
) -> Iterator[_Channel]:
    """Channels of a segment; a column of X stands before one channel, or before all of them."""
    times = np.zeros(0)
    for column, heading_cell in enumerate(heading):
        if heading_cell == _COMMENT:  # which may hold any text
            continue
        values = np.array([layout.number(_at(row, column)) for row in rows if _at(row, column)])
        if heading_cell == _X:
            times = values
        elif heading_cell:
            stated = {tag: _at(row, column) for tag, row in tags.items()}
            _check_count(path, heading_cell, stated.get("Samples", ""), values.size)
            start, interval = (layout.number(stated.get(tag, "")) for tag in ("X0", "Delta_X"))
            rate = 1 / interval if interval > 0 else _rate(times)
            unit, dimension = (stated.get(tag, "") for tag in ("Y_Unit_Label", "X_Dimension"))
            again = heading.index(heading_cell) < column
            name = f"{heading_cell} (column {column + 1})" if again else heading_cell
            yield _Channel(name, unit, dimension, values, start, rate)


def _rate(times: np.ndarray) -> float:
    return rate_of_times(times) if times.size > 1 else np.nan


def _at(row: Row, column: int) -> str:
    return row[column] if column < len(row) else ""


def _check_count(path: Path, name: str, announced: str, count: int) -> None:
    if announced and announced != str(count):
        warn(
            f"{path} announces {announced} samples of {name!r} and holds {count}; those that are "
            "there are read. Check that the recording was not cut off.",
            FileWarning,
        )


def _joined(segments: list[list[_Channel]]) -> list[list[_Channel]]:
    """Segments, each joined to the one before where it continues it in time."""
    joined = segments[:1]
    for segment in segments[1:]:
        before = joined[-1]
        if len(before) == len(segment) and all(map(_continues, before, segment)):
            joined[-1] = list(map(_with, before, segment))
        else:
            joined.append(segment)
    return joined


def _continues(before: _Channel, after: _Channel) -> bool:
    """Whether a channel begins an interval after another one ends."""
    ended = before.start + before.samples.size / before.rate
    same = before.name == after.name and same_rate(before.rate, after.rate)
    return bool(same and abs(after.start - ended) * before.rate < JITTER)


def _with(before: _Channel, after: _Channel) -> _Channel:
    return before._replace(samples=np.concatenate([before.samples, after.samples]))
