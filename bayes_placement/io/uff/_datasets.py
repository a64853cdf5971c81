"""Datasets of a universal file as pyuff decodes them, checked to be complete."""

import re
from pathlib import Path
from typing import Any, NamedTuple

from ..._types import InputError

NODES, UNITS, FUNCTION, DATA_AT_NODES = (15, 2411), 164, 58, 55

_DELIMITER = re.compile(rb"^ {4}-1 *\r?$", re.MULTILINE)
_DELIMITER_AFTER_BINARY = re.compile(rb" {4}-1 *\r?$", re.MULTILINE)
_LINES_BEFORE_VALUES = 11

# Bytes of one number and numbers of one ordinate, by the ordinate data type of dataset 58.
_LAYOUT = {2: (4, 1), 4: (8, 1), 5: (4, 2), 6: (8, 2)}

_FROM_ARRAYS = {DATA_AT_NODES: "ModalModel.from_arrays"}


class MeasurementFileError(InputError):
    """A universal file that is malformed, incomplete or ambiguous."""


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

    if not path.is_file():
        raise FileNotFoundError(
            f"There is no file {path}; a universal file (.uff, .unv) is needed. Check the folder: "
            "Path(...).resolve()."
        )
    numbers = _dataset_numbers(path)
    file = pyuff.UFF(str(path))
    if numbers != [int(number) for number in file.get_set_types()]:
        # pyuff takes any line that ends in four blanks and -1 for the end of a dataset.
        raise MeasurementFileError(
            f"{path} holds the datasets {numbers}, but pyuff separates them differently; a -1 at "
            "the end of a line, such as a node colour of -1, is taken for the end of a dataset. "
            "Change that field and read again."
        )
    wanted = {*NODES, UNITS, data}
    return [
        Dataset(place, number, _decoded(file, index, number, place))
        for index, number in enumerate(numbers)
        if number in wanted and (place := f"{path}, block {index + 1} (dataset {number})")
    ]


def _decoded(file: Any, index: int, number: int, place: str) -> dict[str, Any]:
    try:
        fields = file.read_sets(index)
    except Exception as error:  # pyuff raises bare Exception for every malformed field
        raise MeasurementFileError(
            f"{place} cannot be decoded ({error}); every field must be in the columns that the "
            "format gives it. Export the file again, or read the numbers yourself and give them "
            f"to {_FROM_ARRAYS.get(number, 'Measurement.from_arrays')}."
        ) from error
    if fields["type"] == FUNCTION:
        _check_length(fields, place)
    return fields


def _check_length(fields: dict[str, Any], place: str) -> None:
    count, announced = min(len(fields["x"]), len(fields["data"])), fields["num_pts"]
    if count != announced or len(fields["x"]) != len(fields["data"]):
        raise MeasurementFileError(
            f"{place} announces {announced} values and holds {count}; all of them are needed, "
            "since a line without its value shifts every later one. Export the file again."
        )


def _dataset_numbers(path: Path) -> list[int]:
    """Numbers of all datasets by their delimiters; refuses a truncated file before decoding."""
    data = path.read_bytes()
    numbers: list[int] = []
    opening = _DELIMITER.search(data)
    while opening:
        place = f"{path}, block {len(numbers) + 1}"
        identity, start = _line(data, opening.end() + 1)
        numbers.append(_number(identity, place))
        binary = identity[6:7].lower() == b"b"
        end = _end_of_binary(data, start, place) if binary else start
        closing = (_DELIMITER_AFTER_BINARY if binary else _DELIMITER).search(data, end)
        if closing is None:
            raise _truncated(place)
        opening = _DELIMITER.search(data, closing.end())
    if not numbers:
        raise MeasurementFileError(
            f"{path} is not a universal file: its {len(data)} bytes hold no line with -1 in "
            "columns 5 and 6, which must open and close every dataset. Give the file that "
            "was exported as UFF (universal file format, dataset 55 for modes, 58 for FRFs)."
        )
    return numbers


def _line(data: bytes, start: int) -> tuple[bytes, int]:
    """Line that begins at an offset, and the offset of the next line."""
    end = data.find(b"\n", start)
    end = len(data) if end < 0 else end
    return data[start:end], end + 1


def _number(identity: bytes, place: str) -> int:
    try:
        return int(identity[:6])
    except ValueError as error:
        if not identity.strip():
            raise _truncated(place) from error
        raise MeasurementFileError(
            f"{place} opens with {identity[:20]!r}; the number of its dataset is needed in the "
            "first six columns, since it says how to read the rest. Export the file again."
        ) from error


def _end_of_binary(data: bytes, start: int, place: str) -> int:
    """Offset at which the values of dataset 58b end, computed from its seventh record.

    The number of bytes in the first line is not used: common writers, pyuff among them, put the
    count of real numbers of one part there.
    """
    records = []
    for _ in range(_LINES_BEFORE_VALUES):
        record, start = _line(data, start)
        records.append(record)
    data_form = records[6]
    try:
        data_type, count, even = (int(data_form[column : column + 10]) for column in (0, 10, 20))
        size, parts = _LAYOUT[data_type]
    except (KeyError, ValueError) as error:
        if start > len(data):
            raise _truncated(place) from error
        raise MeasurementFileError(
            f"{place} has the data form {data_form!r}; an ordinate type of 2, 4, 5 or 6, a count "
            "and a spacing are needed there, since they say how to read the values. Export it "
            "again."
        ) from error
    return start + count * size * (parts + (even == 0))


def _truncated(place: str) -> MeasurementFileError:
    return MeasurementFileError(
        f"{place}: the file ends inside this dataset; a closing line with -1 in columns 5 and 6 is "
        "needed, without which values are missing. The file is truncated: copy or export it again."
    )
