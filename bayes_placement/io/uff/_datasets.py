"""Datasets of a universal file as pyuff decodes them, checked to be complete."""

import re
from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import Any, NamedTuple

from ..._types import InputError
from .._gate import existing
from ._gate import HEAD_LINES, LAYOUT, faults

NODES, UNITS, FUNCTION, DATA_AT_NODES = (15, 2411), 164, 58, 55

_DELIMITER = re.compile(rb"^ {4}-1 *\r?$", re.MULTILINE)
_DELIMITER_AFTER_BINARY = re.compile(rb" {4}-1 *\r?$", re.MULTILINE)
_NOTHING = b"\x1a \0\r\n\t"  # an end of file of old systems, and blanks

_FROM_ARRAYS = {DATA_AT_NODES: "ModalModel.from_arrays"}


class MeasurementFileError(InputError):
    """A universal file that is malformed, incomplete or ambiguous.

    Examples
    --------
    >>> issubclass(bp.io.uff.MeasurementFileError, ValueError)
    True
    """


class Dataset(NamedTuple):
    """One dataset of a universal file.

    Parameters
    ----------
    place
        Where it stands, for messages: file, position in the file, number.
    number
        Number of its kind, such as 58.
    fields
        What it holds, by pyuff's names.
    """

    place: str
    number: int
    fields: dict[str, Any]


def load(path: Path, data: int = FUNCTION) -> list[Dataset]:
    """Read the nodes, the units and one kind of data of a universal file.

    Parameters
    ----------
    path
        The file.
    data
        Number of the datasets that hold the data: 58 for functions, 55 for data at nodes.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    MeasurementFileError
        If it is no universal file, ends inside a dataset, or a dataset cannot be decoded.
    """
    import pyuff

    blocks = _blocks(existing(path, "a universal file (.uff, .unv)"))
    wanted = {*NODES, UNITS, data}
    places = {
        index: f"{path}, block {index + 1} (dataset {block.number})"
        for index, block in enumerate(blocks)
        if block.number in wanted
    }
    for index, place in places.items():
        _check_block(blocks[index], place)
    file = pyuff.UFF(str(path))
    numbers = [block.number for block in blocks]
    if numbers != [int(number) for number in file.get_set_types()]:
        # pyuff takes any line that ends in four blanks and -1 for the end of a dataset.
        raise MeasurementFileError(
            f"{path} holds the datasets {numbers}, but pyuff separates them differently; a -1 at "
            "the end of a line, such as a node colour of -1, is taken for the end of a dataset. "
            "Change that field and read again."
        )
    return [
        Dataset(place, numbers[index], _decoded(file, index, numbers[index], place))
        for index, place in places.items()
    ]


VARIANCE_NOTE = '{"function": "variance"}'
"""ID line 4 of the variance of an FRF, for which the format has no type of function."""


def left_out(path: Path, function_types: Collection[int]) -> dict[str, int]:
    """Count what a file holds besides nodes, units and functions of some types, in words."""
    kinds: Counter[str] = Counter()
    for block in _blocks(path):
        if block.number == FUNCTION:
            kind = int(block.lines[5][:5])
            if kind not in function_types and block.lines[3].strip() != VARIANCE_NOTE:
                kinds[f"dataset {FUNCTION} of function type {kind}"] += 1
        elif block.number not in {*NODES, UNITS}:
            kinds[f"dataset {block.number}"] += 1
    return dict(kinds)


def _decoded(file: Any, index: int, number: int, place: str) -> dict[str, Any]:
    try:
        fields: dict[str, Any] = dict(file.read_sets(index))
    except Exception as error:  # pyuff raises bare Exception for every malformed field
        raise MeasurementFileError(
            f"{place} cannot be decoded ({error}); every field must be in the columns that the "
            "format gives it. Export the file again, or read the numbers yourself and give them "
            f"to {_FROM_ARRAYS.get(number, 'Measurement.from_arrays')}."
        ) from error
    if number == FUNCTION:
        _check_length(fields, place)
    return fields


def _check_length(fields: dict[str, Any], place: str) -> None:
    count, announced = min(len(fields["x"]), len(fields["data"])), fields["num_pts"]
    if count != announced or len(fields["x"]) != len(fields["data"]):
        raise MeasurementFileError(
            f"{place} announces {announced} values and holds {count}; all of them are needed, "
            "since a line without its value shifts every later one. Export the file again."
        )


class _Block(NamedTuple):
    """A dataset as bytes: its number, the line with it, and the lines after that as text."""

    number: int
    identity: bytes
    lines: list[str]

    @property
    def binary(self) -> bool:
        """Whether its values are binary; its lines are then those before the values."""
        return self.identity[6:7].lower() == b"b"


def _blocks(path: Path) -> list[_Block]:
    """All datasets by their delimiters; refuses a truncated file before decoding."""
    data = path.read_bytes()
    blocks: list[_Block] = []
    end = 0
    while opening := _DELIMITER.search(data, end):
        _check_nothing_between(data[end : opening.start()], path, len(blocks))
        place = f"{path}, block {len(blocks) + 1}"
        identity, start = _line(data, opening.end() + 1)
        number, binary = _number(identity, place), identity[6:7].lower() == b"b"
        values_end = _end_of_binary(data, start, place) if binary else start
        closing = (_DELIMITER_AFTER_BINARY if binary else _DELIMITER).search(data, values_end)
        if closing is None:
            raise _truncated(place)
        lines = _text_lines(data[start : closing.start()], HEAD_LINES if binary else None)
        blocks.append(_Block(number, identity, lines))
        end = closing.end()
    if not blocks:
        raise MeasurementFileError(
            f"{path} is not a universal file: its {len(data)} bytes hold no line with -1 in "
            "columns 5 and 6, which must open and close every dataset. Give the file that "
            "was exported as UFF (universal file format, dataset 55 for modes, 58 for FRFs)."
        )
    _check_nothing_between(data[end:], path, len(blocks))
    return blocks


def _text_lines(content: bytes, most: int | None) -> list[str]:
    pieces = content.split(b"\n", -1 if most is None else most)
    lines = pieces[:-1] if most is None else pieces[:most]
    return [line.rstrip(b"\r").decode("latin-1") for line in lines]


def _check_nothing_between(content: bytes, path: Path, blocks: int) -> None:
    stray = content.strip(_NOTHING)
    if stray:
        raise MeasurementFileError(
            f"{path} holds {stray[:40]!r} outside of its datasets, after {blocks} of them; nothing "
            "may stand there, since a delimiter (-1 in columns 5 and 6) is missing and a dataset "
            "would be skipped. Export the file again."
        )


def _check_block(block: _Block, place: str) -> None:
    """Refuse a dataset with a field that is not in its columns, or in binary of another kind."""
    if block.binary:
        order, form = block.identity[7:13].strip(), block.identity[13:19].strip()
        if order not in (b"1", b"2") or form != b"2":
            raise MeasurementFileError(
                f"{place} has the byte order {order!r} and the floating point format {form!r}; 1 "
                "or 2, and 2 (IEEE 754) are needed, since they say how to read the values. Export "
                "it again, or as text."
            )
    for fault in faults(block.number, block.lines, binary=block.binary):
        raise MeasurementFileError(
            f"{place} cannot be decoded: in line {fault.line} after the one with its number, "
            f"{fault.what}; every field must be in the columns that the format gives it, since a "
            "shifted one is another number. Export the file again, or give the arrays to "
            f"{_FROM_ARRAYS.get(block.number, 'Measurement.from_arrays')}."
        )


def _line(data: bytes, start: int) -> tuple[bytes, int]:
    """Line that begins at an offset, and the offset of the next line."""
    end = data.find(b"\n", start)
    end = len(data) if end < 0 else end
    return data[start:end], end + 1


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


def _end_of_binary(data: bytes, start: int, place: str) -> int:
    """Offset at which the values of dataset 58b end, computed from its seventh record.

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
    return end


def _truncated(place: str) -> MeasurementFileError:
    return MeasurementFileError(
        f"{place}: the file ends inside this dataset; a closing line with -1 in columns 5 and 6 is "
        "needed, without which values are missing. The file is truncated: copy or export it again."
    )
