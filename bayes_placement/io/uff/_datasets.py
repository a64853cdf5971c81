"""Datasets of a universal file, found by their delimiters, checked and decoded where asked for."""

import mmap
import re
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._shared.errors import InputError
from .._contents import WIDE, decoded, is_wide
from .._gate import existing
from ._decode import DECODERS, HEAD_LINES, LAYOUT, Fields, FormatError, function, function_head

NODES, UNITS, FUNCTION, DATA_AT_NODES = (15, 2411), 164, 58, 55

LEAST, MOST = 1e-60, 1e60
"""Sizes of binary values, other than zero, beyond which bytes were lost."""

_DELIMITER = re.compile(rb"^ {4}-1 *\r?$", re.MULTILINE)
_DELIMITER_AFTER_BINARY = re.compile(rb" {4}-1 *\r?$", re.MULTILINE)
_ONLY_NUMBERS = re.compile(r"\s*([+-]?[\d.]++([eEdD][+-]?\d++)?+\s*+)++")
_NOTHING = b"\x1a \0\r\n\t"  # an end of file of old systems, and blanks

Wanted = Callable[[Fields], bool]


class MeasurementFileError(InputError):
    """A universal file that is malformed, incomplete or ambiguous.

    Examples
    --------
    >>> issubclass(bp.io.uff.MeasurementFileError, ValueError)
    True
    """


class Dataset(NamedTuple):
    """One dataset of a universal file: its place, its kind (58), fields by pyuff's names."""

    place: str
    number: int
    fields: Fields


class DatasetBytes(NamedTuple):
    """A dataset as bytes, of which only those that are asked for are read from the disk.

    The line `identity` has the number of its kind, such as 58; lines after it, and binary values,
    begin at `start` and `values_start`.
    """

    number: int
    identity: bytes
    content: bytes | mmap.mmap
    start: int
    values_start: int
    end: int

    @property
    def binary(self) -> bool:
        """Whether its values are binary."""
        return self.identity[6:7].lower() == b"b"

    @property
    def lines(self) -> list[str]:
        """All lines."""
        return _text_lines(self.content[self.start : self.end])

    @property
    def head(self) -> list[str]:
        """The first lines of a function."""
        end = self.start
        for _ in range(HEAD_LINES):
            end = min(self.content.find(b"\n", end, self.end) + 1 or self.end, self.end)
        return _text_lines(self.content[self.start : end])

    @property
    def values(self) -> bytes:
        """Binary values."""
        return bytes(self.content[self.values_start : self.end])


def load(path: Path, data: int = FUNCTION, *, wanted: Wanted = lambda head: True) -> list[Dataset]:
    """Read nodes, units and one kind of data of a universal file: 58 functions, 55 at nodes.

    `wanted` tells by the fields of its head whether a function is read; values of others are
    skipped.
    """
    datasets = []
    for index, block in enumerate(blocks_of(existing(path, "a universal file (.uff, .unv)"))):
        place = f"{path}, block {index + 1} (dataset {block.number})"
        with _decoding(block.number, place):
            if block.number == FUNCTION == data and not wanted(function_head(block.head)):
                continue
            if block.number in {*NODES, UNITS, data}:
                datasets.append(Dataset(place, block.number, _decoded(block, place)))
    return datasets


VARIANCE_NOTE = '{"function": "variance"}'
"""ID line 4 of the variance of an FRF, for which the format has no type of function."""


def left_out(path: Path, function_types: Collection[int]) -> dict[str, int]:
    """Count what a file holds besides nodes, units and functions of some types, in words."""
    kinds: Counter[str] = Counter()
    for block in blocks_of(path):
        if block.number == FUNCTION:
            kind = int(block.head[5][:5])
            if kind not in function_types and block.head[3].strip() != VARIANCE_NOTE:
                kinds[f"dataset {FUNCTION} of function type {kind}"] += 1
        elif block.number not in {*NODES, UNITS}:
            kinds[f"dataset {block.number}"] += 1
    return dict(kinds)


_READERS = {
    "function type 4": "FRFs by bp.io.read",
    "function type 1": "time histories by bp.time_records.read",
    f"dataset {DATA_AT_NODES}": "measured modes by bp.io.modal_parameters.read, modes of a model "
    "by bp.io.read_modes",
    "dataset 2412": "a mesh by bp.io.mesh.read",
}
"""What reads datasets, by the end or the whole of their names."""


def described(path: Path) -> str:
    """Say what a file holds besides nodes and units, and what reads that."""
    kinds = left_out(path, ())
    held = (
        ", ".join(f"{kind} ({count})" for kind, count in kinds.items()) or "nodes and units alone"
    )
    ways = [way for name, way in _READERS.items() if any(kind.endswith(name) for kind in kinds)]
    read_as = f", which are read as {' and '.join(ways)}" if ways else ""
    return f"holds {held}{read_as}"


def _decoded(block: DatasetBytes, place: str) -> Fields:
    """Fields of a dataset, each of which is in its columns, or in binary of the usual kind."""
    if block.binary:
        order, form = block.identity[7:13].strip(), block.identity[13:19].strip()
        if order not in (b"1", b"2") or form != b"2":
            raise MeasurementFileError(
                f"{place} has the byte order {order!r} and the floating point format {form!r}; 1 "
                "or 2, and 2 (IEEE 754) are needed, since they say how to read the values. Export "
                "it again, or as text."
            )
        fields = function(block.head, block.values, "<" if order == b"1" else ">")
        size = np.abs(fields["data"])
        if np.any((size > 0) & ~((size >= LEAST) & (size <= MOST))):
            raise MeasurementFileError(
                f"{place} holds binary values from {size.min():.3g} to {size.max():.3g}; {LEAST:g} "
                f"to {MOST:g} are needed, since others come of lost bytes, after which all that "
                "follow are shifted. Copy the file again as binary, or export it as text."
            )
        return fields
    return DECODERS[block.number](block.lines)


@contextmanager
def _decoding(number: int, place: str) -> Iterator[None]:
    """Refuse a dataset with a field that is not in its columns."""
    try:
        yield
    except FormatError as fault:
        line, what = fault.args
        arrays = "ModalModel" if number == DATA_AT_NODES else "Measurement"
        raise MeasurementFileError(
            f"{place} cannot be decoded: in line {line} after the one with its number, "
            f"{what}; every field must be in the columns that the format gives it, since a "
            "shifted one is another number. Export the file again, or give the arrays to "
            f"{arrays}.from_arrays."
        ) from fault


def blocks_of(path: Path) -> Iterator[DatasetBytes]:
    """All datasets by their delimiters."""
    data: bytes | mmap.mmap = b""
    if path.stat().st_size:
        with path.open("rb") as file:
            data = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    number, end = 0, 0
    while opening := _DELIMITER.search(data, end):
        _check_between(data[end : opening.start()], path, number)
        number += 1
        block, end = _block(data, opening.end() + 1, f"{path}, block {number}")
        yield block
    if not number:
        what = WIDE if is_wide(data[:100]) else "not a universal file"
        raise MeasurementFileError(
            f"{path} is {what}: its {len(data)} bytes hold no line with -1 in "
            "columns 5 and 6, which must open and close every dataset. Give the file that "
            "was exported as UFF (universal file format, dataset 55 for modes, 58 for FRFs)."
        )
    _check_between(data[end:], path, number)


def _block(data: bytes | mmap.mmap, start: int, place: str) -> tuple[DatasetBytes, int]:
    """Dataset whose line with the number begins at an offset, and where it is closed."""
    identity, start = _line(data, start)
    number, binary = _number(identity, place), identity[6:7].lower() == b"b"
    first, last = _binary_values(data, start, place) if binary else (start, start)
    closing = (_DELIMITER_AFTER_BINARY if binary else _DELIMITER).search(data, last)
    if closing is None:
        raise _truncated(place)
    end = last if binary else closing.start()
    return DatasetBytes(number, identity, data, start, first, end), closing.end()


def _text_lines(content: bytes) -> list[str]:
    return [line.rstrip("\r") for line in decoded(content).split("\n")[:-1]]


def _check_between(content: bytes, path: Path, blocks: int) -> None:
    """Refuse what stands between datasets, unless it is a comment: no dataset is without a number.

    A dataset of which a delimiter is lost has a line with numbers alone, or bytes that are no text.
    """
    stray = content.strip(_NOTHING)
    lines = stray.decode("latin-1").replace("\t", " ").splitlines()
    if all(line.isprintable() and not _ONLY_NUMBERS.fullmatch(line) for line in lines):
        return
    raise MeasurementFileError(
        f"{path} holds {stray[:40]!r} outside of its datasets, after {blocks} of them; only lines "
        "of words may stand there, since a delimiter (-1 in columns 5 and 6) is missing and a "
        "dataset would be skipped. Export the file again."
    )


def _line(data: bytes | mmap.mmap, start: int) -> tuple[bytes, int]:
    """Line that begins at an offset, and the offset of the next line."""
    end = data.find(b"\n", start)
    end = len(data) if end < 0 else end
    return bytes(data[start:end]), end + 1


def _number(identity: bytes, place: str) -> int:
    digits, suffix = identity[:6].strip(), identity[6:].strip()
    if digits.isdigit() and (not suffix or suffix[:1].lower() == b"b"):
        return int(digits)
    if not identity.strip():
        raise _truncated(place)
    raise MeasurementFileError(
        f"{place} opens with {identity[:20]!r}; the number of its dataset is needed in the "
        "first six columns, since it says how to read the rest. Export the file again."
    )


def _binary_values(data: bytes | mmap.mmap, start: int, place: str) -> tuple[int, int]:
    """Offsets at which the values of dataset 58b begin and end, by its seventh record.

    The number of bytes in the first line is not used: common writers, pyuff among them, put the
    count of real numbers of one part there.
    """
    records = []
    for _ in range(HEAD_LINES):
        record, start = _line(data, start)
        records.append(record)
    data_form = records[6]
    try:
        data_type, count, even = (int(data_form[column : column + 10]) for column in (0, 10, 20))
        size, parts = LAYOUT[data_type]
    except (KeyError, ValueError) as error:
        if start > len(data):
            raise _truncated(place) from error
        raise MeasurementFileError(
            f"{place} has the data form {data_form!r}; an ordinate type of 2, 4, 5 or 6, a count "
            "and a spacing are needed there, since they say how to read the values. Export it "
            "again."
        ) from error
    end = start + count * size * (parts + (even == 0))
    if count < 1 or end > len(data):
        raise _truncated(place)
    return start, end


def _truncated(place: str) -> MeasurementFileError:
    return MeasurementFileError(
        f"{place}: the file ends inside this dataset; a closing line with -1 in columns 5 and 6 is "
        "needed, without which values are missing. The file is truncated: copy or export it again."
    )
