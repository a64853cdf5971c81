"""Time records as recorders write them: WAV, universal files, LabVIEW text, TDMS and MDF.

TDMS and MDF are read by libraries that are extras. LabVIEW text (.lvm): National Instruments,
Specification for the LabVIEW Measurement File (.lvm), version 2.0.
"""

import itertools
import os
import re
import struct
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.io import wavfile

from ..._shared.errors import InputError, warn
from ..._shared.files import Json
from ...positions.channel import Channel
from .._gate import FileWarning, reading
from .._library_process import TIMES
from .._reader_process import run_library
from ..arrays.text import decimal_point, is_number, text_of, with_point
from ..uff._datasets import FUNCTION, Dataset, MeasurementFileError
from ..uff._datasets import load as datasets_of
from .records import JITTER, Sampled, check_starts, rate_of_times, same_rate


def load_tdms(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels, whose names are `group/channel`, with unit and sampling rate."""
    arrays, metadata = _read(path, "a TDMS file", "tdms")
    check_starts({name: metadata["starts"][name] for name in names if name in metadata["starts"]})
    return Sampled(arrays, metadata["units"], metadata["rates"], metadata["faults"])


def load_mdf(path: Path, names: Iterable[str]) -> Sampled:
    """Read channels of versions 3 and 4 by name, with unit and the rate of their time stamps."""
    arrays, metadata = _read(path, "an MDF file", "mdf")
    groups = metadata["groups"]
    times = {name: arrays[TIMES.format(groups[name])] for name in names if name in groups}
    check_starts({name: float(values[0]) for name, values in times.items()})
    return Sampled(
        arrays={name: arrays[name] for name in groups},
        units=metadata["units"],
        rates={name: rate_of_times(values) for name, values in times.items()},
        left_out=metadata["faults"],
    )


def _read(path: Path, form: str, extra: str) -> tuple[dict[str, np.ndarray], Json]:
    """Arrays by name, and what else the file states."""
    with reading(path, form, "Export it again."):
        return run_library(path, extra)[:2]


def load_wav(path: Path, names: Iterable[str]) -> Sampled:
    """Read all channels as `channel 1` and so on; integers as shares of full scale, -1 to 1."""
    _check_parts(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error", wavfile.WavFileWarning)  # a file that ends too early
        warnings.filterwarnings("ignore", "Chunk .* not understood", wavfile.WavFileWarning)
        rate, samples = wavfile.read(path)
    columns = _shares(samples if samples.ndim == 2 else samples[:, None]).T
    arrays = {f"channel {number}": column for number, column in enumerate(columns, 1)}
    return Sampled(arrays, {}, dict.fromkeys(arrays, float(rate)))


def _check_parts(path: Path) -> None:
    """Refuse parts that do not follow each other, as where a recorder ended before it noted sizes.

    Those of RF64 stand elsewhere, and are compared by SciPy.
    """
    length = path.stat().st_size
    with path.open("rb") as file:
        form, whole, _ = struct.unpack("<4sI4s", file.read(12))
        while form == b"RIFF" and file.tell() < (whole + 8 if whole else length):
            name, size = struct.unpack("<4sI", file.read(8))
            left = length - file.tell()
            readable = name.decode("latin-1").isprintable() and size <= left
            if not readable or (name == b"data" and not size):
                raise InputError(
                    f"its part {name!r} announces {size} bytes and {left} are left in the file; as "
                    "many as there are must be announced, since others would be lost without a "
                    "word. Write the sizes anew: sox --ignore-length in.wav out.wav"
                )
            file.seek(size + size % 2, os.SEEK_CUR)


def _shares(samples: np.ndarray) -> np.ndarray:
    if samples.dtype.kind == "f":
        return samples.astype(float)
    half = 2.0 ** (8 * samples.dtype.itemsize - 1)
    offset = half if samples.dtype.kind == "u" else 0.0  # 8 bits are stored without sign
    return (samples - offset) / half


TIME_RESPONSE = 1
_TIME = 17  # data type of the abscissa
_UNSTATED = ("", "NONE")


def load_universal(path: Path, names: Iterable[str]) -> Sampled:
    """Read time histories by node and direction (`12+z`), with unit and sampling rate.

    Further records of one node and direction are `12+z (2)` and so on.
    """
    functions = [dataset for dataset in datasets_of(path) if dataset.number == FUNCTION]
    records = _named([one for one in functions if one.fields["func_type"] == TIME_RESPONSE])
    if not records:
        types = sorted({dataset.fields["func_type"] for dataset in functions})
        raise MeasurementFileError(
            f"{path} holds {f'functions of type {types}' if types else 'no function'}; time "
            f"histories (dataset 58, function type {TIME_RESPONSE}) are needed here. FRFs are read "
            "by bp.io.read(path)."
        )
    times = {name: np.asarray(record.fields["x"], float) for name, record in records.items()}
    check_starts({name: float(times[name][0]) for name in names if name in times})
    return Sampled(
        arrays={name: np.asarray(record.fields["data"]) for name, record in records.items()},
        units={name: _unit(record) for name, record in records.items()},
        rates={name: rate_of_times(values) for name, values in times.items()},
    )


def _named(datasets: list[Dataset]) -> dict[str, Dataset]:
    seen: Counter[str] = Counter()
    named = {}
    for dataset in datasets:
        _check_abscissa(dataset)
        fields = dataset.fields
        node, direction = str(fields["rsp_node"]), fields["rsp_dir"]
        is_translation = abs(direction) <= 3
        label = (
            Channel(node, direction).label if is_translation else f"{node} direction {direction}"
        )
        seen[label] += 1
        named[f"{label} ({seen[label]})" if seen[label] > 1 else label] = dataset
    return named


def _check_abscissa(dataset: Dataset) -> None:
    kind = dataset.fields["abscissa_spec_data_type"]
    label = dataset.fields["abscissa_axis_units_lab"].strip()
    if kind != _TIME or label not in (*_UNSTATED, "s", "sec"):
        raise MeasurementFileError(
            f"{dataset.place} is a time history over data type {kind} in {label!r}; time (17) in s "
            "is needed, since the sampling rate follows from it. Export it over seconds."
        )


def _unit(dataset: Dataset) -> str:
    label: str = dataset.fields["ordinate_axis_units_lab"].strip()
    return "" if label in _UNSTATED else label


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


def load_lvm(path: Path, names: Iterable[str]) -> Sampled:
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
    timed = {
        name: one
        for name, one in channels.items()
        if one.dimension in ("", "Time") and one.samples.size > 0
    }
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
            by_times = rate_of_times(times) if times.size > 1 and not interval > 0 else np.nan
            rate = 1 / interval if interval > 0 else by_times
            unit, dimension = (stated.get(tag, "") for tag in ("Y_Unit_Label", "X_Dimension"))
            again = heading.index(heading_cell) < column
            name = f"{heading_cell} (column {column + 1})" if again else heading_cell
            yield _Channel(name, unit, dimension, values, start, rate)


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
