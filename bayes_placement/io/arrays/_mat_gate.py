"""The letter of a MATLAB 5 to 7 file: every element by its bytes, before a library reads it.

MATLAB, MAT-File Format (MathWorks), chapter 1.
"""

import itertools
import struct
import zlib
from collections.abc import Iterator
from math import prod
from typing import NamedTuple

import numpy as np

from ..._shared.errors import InputError
from .._gate import check_limit, most

UNPACKED = "unpacked bytes of a MATLAB file"
HEADER_BYTES = 128
_DEEPEST = 30
_MATRIX, _COMPRESSED = 14, 15
_BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
"""Bytes of a value by the type of an element; 16 to 18 are UTF-8, -16 and -32."""

_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_NUMERIC = range(6, 16)
SPARSE = "it is a sparse matrix"
"""Why a sparse matrix is not read as an array."""

_FOREIGN = {
    _OBJECT: "it is an object of a class, of which only MATLAB knows the meaning",
    _FUNCTION: "it is a function",
    _OPAQUE: "it is an object of a class (a string, table or datetime), stored in MATLAB's own way",
    _SPARSE: SPARSE,
}
_COMPLEX = 0x08


class _Element(NamedTuple):
    kind: int
    content: memoryview


class _Walk(NamedTuple):
    """A walk through a file: the order of its bytes, the elements met, and bytes unpacked."""

    order: str
    met: Iterator[int]
    unpacked: list[int]


class _Foreign(Exception):  # noqa: N818, no error: a variable that is left out
    """A variable holds something that is not read."""


def variables(data: bytes) -> dict[str, str]:
    """Check a file; return why each of its variables is not read, empty where it is."""
    order = {b"IM": "<", b"MI": ">"}.get(data[126:128])
    if order is None or len(data) <= HEADER_BYTES:
        raise InputError("its first 128 bytes are not those of a MATLAB 5 to 7 file")
    walk = _Walk(order, itertools.count(1), [])
    known: dict[str, str] = {}
    for element in _elements(walk, memoryview(data)[HEADER_BYTES:], packed=True):
        name, reason = _variable(walk, element)
        if name in known:
            raise InputError("a variable occurs twice, and either could be meant")
        if name:
            known[name] = reason
    return known


def _elements(walk: _Walk, data: memoryview, *, packed: bool = False) -> Iterator[_Element]:
    """Elements that follow each other; they fill the bytes exactly."""
    place = 0
    while place < len(data):
        check_limit("elements of a MATLAB file", next(walk.met))
        element, size = _element(walk, data[place:])
        packed_here = element.kind == _COMPRESSED
        if packed_here and not packed:
            raise InputError("a compressed element stands within another one")
        place += size if packed_here else -(-size // 8) * 8  # only these are not padded
        yield element
    if place > len(data) + 7:
        raise InputError("its last element is cut off")


def _element(walk: _Walk, data: memoryview) -> tuple[_Element, int]:
    """First element, and its bytes with its tag."""
    if len(data) < 8:
        raise InputError(f"{len(data)} bytes are left where an element begins")
    kind, size = struct.unpack_from(f"{walk.order}II", data)
    if kind >> 16:  # a small element has its values in the tag
        kind, size = kind & 0xFFFF, kind >> 16
        if size > 4:
            raise InputError(f"a small element announces {size} bytes")
        return _Element(kind, data[4 : 4 + size]), 8
    if size > len(data) - 8:
        raise InputError(
            f"the file ends too early: an element has {size} bytes and {len(data) - 8} are left"
        )
    return _Element(kind, data[8 : 8 + size]), 8 + size


def _variable(walk: _Walk, element: _Element) -> tuple[str, str]:
    """Name of a variable, and why it is not read."""
    if element.kind == _COMPRESSED:
        unpacked = list(_elements(walk, _unpacked(walk, element.content)))
        if len(unpacked) != 1:
            raise InputError("a compressed element does not hold one variable")
        element = unpacked[0]
    if element.kind != _MATRIX:
        raise InputError(f"an element of type {element.kind} stands where a variable is needed")
    name = _name(list(itertools.islice(_elements(walk, element.content), 3)))
    try:
        _check_matrix(walk, element, 0)
    except _Foreign as foreign:
        return name, str(foreign)
    return name, ""


def _unpacked(walk: _Walk, content: memoryview) -> memoryview:
    machine = zlib.decompressobj()
    try:
        data = machine.decompress(content, most(UNPACKED) + 1)
    except zlib.error as error:
        raise InputError(f"a compressed variable cannot be unpacked ({error})") from error
    walk.unpacked.append(len(data))
    check_limit(UNPACKED, sum(walk.unpacked))
    if not machine.eof or machine.unused_data:
        raise InputError("a compressed variable has another length than it announces")
    return memoryview(data)


def _name(header: list[_Element]) -> str:
    """Name of a variable; that of an opaque object stands in the place of its sizes."""
    if header and header[0].kind == 6 and len(header[0].content) == 8:
        opaque = _OPAQUE in (header[0].content[0], header[0].content[3])
        texts = [part.content for part in header[1:] if part.kind in (1, 16)]
        if texts and (opaque or len(header) == 3):
            return bytes(texts[0]).decode("latin-1")
    return ""


def _check_matrix(walk: _Walk, element: _Element, depth: int) -> None:
    """Check an array with its flags, sizes, name and values."""
    if depth > _DEEPEST:
        raise InputError(f"arrays are nested more than {_DEEPEST} deep")
    if not len(element.content):
        return  # an empty array
    parts = list(_elements(walk, element.content))
    if parts[0].kind != 6 or len(parts[0].content) != 8:
        raise InputError("a variable does not begin with its flags")
    flags = struct.unpack_from(f"{walk.order}I", parts[0].content)[0]
    kind, is_complex = flags & 0xFF, bool(flags >> 8 & _COMPLEX)
    if kind == _SPARSE:
        _check_sparse(walk, parts, 2 if is_complex else 1)
    if kind in _FOREIGN:
        raise _Foreign(_FOREIGN[kind])
    count = prod(_sizes(walk, parts))
    values = parts[3:]
    if kind in _NUMERIC:
        _check_numbers(values, count, 2 if is_complex else 1)
    elif kind == _CHAR:
        _check_texts(values, count)
    elif kind == _CELL:
        _check_nested(walk, values, count, depth)
    elif kind == _STRUCT:
        _check_nested(walk, values[2:], count * _fields(walk, values), depth)
    else:
        raise InputError(f"a variable is of class {kind}, which MATLAB does not have")


def _sizes(walk: _Walk, parts: list[_Element]) -> tuple[int, ...]:
    if len(parts) < 3 or parts[1].kind != 5 or parts[2].kind not in (1, 16):
        raise InputError("a variable has no sizes or no name")
    content = parts[1].content
    if len(content) % 4 or len(content) < 8:
        raise InputError("the sizes of a variable are cut off")
    sizes = struct.unpack(f"{walk.order}{len(content) // 4}i", content)
    if min(sizes) < 0:
        raise InputError(f"a variable has the sizes {sizes}")
    return sizes


def _check_numbers(values: list[_Element], count: int, parts: int) -> None:
    if len(values) != parts:
        raise InputError(f"a variable has {len(values)} parts in the place of {parts}")
    for value in values:
        size = _BYTES.get(value.kind, 0)
        if value.kind > 13 or size * count != len(value.content) or not size:
            raise InputError(
                f"a variable announces {count} numbers and holds {len(value.content)} bytes of "
                f"type {value.kind}"
            )


def _check_sparse(walk: _Walk, parts: list[_Element], count: int) -> None:
    """Check the rows of the entries, where each column begins, and the numbers."""
    rows, columns = _sizes(walk, parts)
    if len(parts) != 5 + count or any(part.kind != 5 for part in parts[3:5]):
        raise InputError(f"a sparse matrix has {len(parts)} parts")
    row, begin = (np.frombuffer(part.content, f"{walk.order}i4") for part in parts[3:5])
    entries = int(begin[-1]) if begin.size == columns + 1 else -1
    rising = begin.size and begin[0] == 0 and bool(np.all(np.diff(begin) >= 0))
    if not rising or not 0 <= entries <= row.size:
        raise InputError("the columns of a sparse matrix do not follow each other")
    if entries and not (row[:entries].min() >= 0 and row[:entries].max() < rows):
        raise InputError("an entry of a sparse matrix stands outside of it")
    for part in parts[5:]:
        if len(part.content) < entries * _BYTES.get(part.kind, 0) or part.kind not in _BYTES:
            raise InputError("a sparse matrix has fewer numbers than entries")


def _check_texts(values: list[_Element], count: int) -> None:
    if count and len(values) != 1:
        raise InputError(f"a text has {len(values)} parts")
    for value in values:
        if value.kind not in _BYTES or len(value.content) > 4 * count:
            raise InputError(f"a text of {count} letters holds {len(value.content)} bytes")


def _fields(walk: _Walk, values: list[_Element]) -> int:
    """Number of fields of a structure."""
    if len(values) < 2 or values[0].kind != 5 or len(values[0].content) != 4:
        raise InputError("a structure does not say how long the names of its fields are")
    longest = struct.unpack_from(f"{walk.order}i", values[0].content)[0]
    names = values[1].content
    if not 0 < longest <= 64 or len(names) % longest:
        raise InputError("the names of the fields of a structure are cut off")
    return len(names) // longest


def _check_nested(walk: _Walk, values: list[_Element], count: int, depth: int) -> None:
    if len(values) != count or any(value.kind != _MATRIX for value in values):
        raise InputError(f"{len(values)} arrays stand where {count} are announced")
    for value in values:
        _check_matrix(walk, value, depth + 1)
