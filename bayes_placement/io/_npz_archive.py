"""Arrays and matrices in archives (.npz) and files of Matrix Market, counted before they are read.

Sizes and indices are checked, pickles refused. SciPy's reader of Matrix Market (.mtx, .mtx.gz) ends
the interpreter on some damaged files. That format: https://math.nist.gov/MatrixMarket
"""

import gzip
import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
import scipy.sparse
from jaxtyping import Float
from numpy.lib import format as npy
from scipy.sparse import sparray

from .._shared.errors import InputError
from ._gate import UnreadableError, check_limit, existing, most

_PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED, _PATCHED, _STRONG = 0x1, 0x20, 0x40
_GREATEST_RATIO = 1100  # deflate packs 1032 bytes into one at most
_CHUNK = 1 << 20
_KINDS = "biufcSU"  # numbers and texts; objects are pickles


class NpzArchive:
    """An .npz file: named arrays, read one at a time.

    Refused is what is no archive of arrays, and a member that is packed in another way than NumPy
    packs, is encrypted, occurs twice or announces more bytes than it can hold.
    """

    def __init__(self, path: Path, contents: str):
        self.path, self.contents = existing(path, f"a .npz file of {contents}"), contents
        with path.open("rb") as handle:
            members = self._directory(handle)
        self._members = {member.filename.removesuffix(".npy"): member for member in members}

    @property
    def names(self) -> list[str]:
        """Names of the arrays."""
        return list(self._members)

    def array(self, name: str) -> np.ndarray:
        """Read an array of numbers or text that has as many bytes as it announces."""
        try:
            with zipfile.ZipFile(self.path) as archive, archive.open(self._members[name]) as stream:
                return array_in(stream, self._members[name].file_size)
        except Exception as error:  # damaged archives raise any exception
            raise self._refused(f"array {name}: {error}") from error

    def _directory(self, handle: BinaryIO) -> list[zipfile.ZipInfo]:
        if handle.read(6) == npy.MAGIC_PREFIX:
            raise self._refused("it is a single array")
        try:
            with zipfile.ZipFile(handle) as archive:
                members = archive.infolist()
        except Exception as error:  # damaged archives raise any exception
            raise self._refused(str(error)) from error
        for member in members:
            reason = _fault(member)
            if reason:
                raise self._refused(f"its member {member.filename!r} {reason}")
        check_limit("unpacked bytes of a NumPy archive", sum(m.file_size for m in members))
        names = [member.filename for member in members]
        if len(set(names)) < len(names):
            raise self._refused("one of its members occurs twice, and either could be meant")
        return members

    def _refused(self, reason: str) -> InputError:
        return InputError(
            f"{self.path} cannot be read as .npz ({reason}); named arrays are needed, for "
            f"{self.contents}. Write them again with numpy.savez, or copy the file once more."
        )


def _fault(member: zipfile.ZipInfo) -> str:
    """Why a member is not read; empty where it is."""
    if not member.filename.endswith(".npy") or set("/\\") & set(member.filename):
        return "is no array (.npy)"
    return fault_of_packing(member, "numpy does")


def fault_of_packing(member: zipfile.ZipInfo, writer: str) -> str:
    """Why a member of an archive is not unpacked, whose writer is named; empty where it is."""
    if member.compress_type not in _PACKINGS:
        return f"is packed in a way that {writer} not use"
    if member.flag_bits & (_ENCRYPTED | _PATCHED | _STRONG):
        return "is encrypted or patched"
    if member.file_size > _GREATEST_RATIO * (member.compress_size + 1):
        return f"announces {member.file_size} bytes in {member.compress_size} packed ones"
    return ""


def array_in(stream: Any, size: int) -> np.ndarray:
    """Read the array of a .npy file of so many bytes, once its header agrees with them."""
    version = npy.read_magic(stream)
    read_header = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    if version not in read_header:
        raise InputError(f"version {version} of its header is not known")
    shape, fortran, kind = read_header[version](stream)
    if kind.kind not in _KINDS:
        what = "pickled objects" if kind.kind == "O" else str(kind)
        raise InputError(f"it holds {what}, which are neither numbers nor text")
    if any(type(length) is not int or length < 0 for length in shape):
        raise InputError(f"its shape is {shape}")
    count = 1
    for length in shape:
        count *= length
    announced = count * kind.itemsize
    if announced > size:
        raise InputError(f"it announces {announced} bytes and holds less than {size}")
    flat = np.empty(count, dtype=kind)
    filled = _filled(flat.view(np.uint8), stream) if announced else 0
    if filled < announced or stream.read(1):  # at the end of the member its checksum is compared
        raise InputError(f"it announces {announced} bytes and holds {filled} or more")
    return flat.reshape(shape, order="F" if fortran else "C")


def _filled(content: np.ndarray, stream: Any) -> int:
    """Read bytes into an array, and return how many there were."""
    view, filled = memoryview(content), 0  # type: ignore[arg-type]
    while filled < len(view):
        count = stream.readinto(view[filled : filled + _CHUNK])
        if not count:
            break
        filled += count
    return filled


MOST_ROWS = 20_000_000
"""Most rows of a matrix: a larger number in a file is a damaged one."""


def sparse_matrix(archive: NpzArchive) -> sparray:
    """Return the matrix in an archive."""
    names = set(archive.names)
    form = _form(archive)
    build, needed = _FORMS[form]
    missing = {"shape", "data", *needed} - names
    if missing:
        raise UnreadableError(f"it has no array {sorted(missing)[0]}, which a {form} matrix has")
    shape = _shape(archive)
    arrays = {name: archive.array(name) for name in ("data", *needed)}
    for name in needed:
        if arrays[name].dtype.kind not in "iu":
            raise UnreadableError(f"{name} holds {arrays[name].dtype}, no whole numbers")
    if arrays["data"].dtype.kind not in "iufc":
        raise UnreadableError(f"data holds {arrays['data'].dtype}, no numbers")
    return build(shape, **arrays)


def _form(archive: NpzArchive) -> str:
    if "format" not in archive.names:
        raise UnreadableError("it has no array format")
    value = archive.array("format")
    text = value.item() if value.ndim == 0 else ""
    form = text.decode("ascii", "replace") if isinstance(text, bytes) else str(text)
    if form not in _FORMS:
        raise UnreadableError(f"its format is {form!r}, none of {', '.join(_FORMS)}")
    return form


def _shape(archive: NpzArchive) -> tuple[int, int]:
    values = archive.array("shape")
    is_shape = values.dtype.kind in "iu" and values.shape == (2,)
    if not is_shape or not np.all((values >= 1) & (values <= MOST_ROWS)):
        stated = values.tolist() if values.size <= 2 else f"an array of shape {values.shape}"
        raise UnreadableError(f"its shape is {stated}")
    return int(values[0]), int(values[1])


def _compressed(
    shape: tuple[int, int], data: np.ndarray, indices: np.ndarray, indptr: np.ndarray
) -> None:
    """Refuse the arrays of a compressed matrix whose rows do not follow each other."""
    lines, across = shape
    if indptr.shape != (lines + 1,) or indptr[0] != 0 or indptr[-1] != len(indices):
        raise UnreadableError(
            f"indptr of shape {indptr.shape} does not divide {len(indices)} indices"
        )
    if np.any(indptr[1:] < indptr[:-1]):
        raise UnreadableError("indptr falls")
    if indices.ndim != 1 or len(data) != len(indices):
        raise UnreadableError(f"{len(data)} values have {indices.shape} indices")
    _check_inside("indices", indices, across)


def _check_inside(name: str, indices: np.ndarray, size: int) -> None:
    if indices.size and not (indices.min() >= 0 and indices.max() < size):
        raise UnreadableError(
            f"{name} go from {indices.min()} to {indices.max()} in a size of {size}"
        )


def _csr(shape: tuple[int, int], data: np.ndarray, **places: np.ndarray) -> sparray:
    _check_flat(data)
    _compressed(shape, data, **places)
    return scipy.sparse.csr_array((data, places["indices"], places["indptr"]), shape=shape)


def _csc(shape: tuple[int, int], data: np.ndarray, **places: np.ndarray) -> sparray:
    """A matrix by columns, which is its transpose by rows."""
    return _csr(shape[::-1], data, **places).T


def _bsr(shape: tuple[int, int], data: np.ndarray, **places: np.ndarray) -> sparray:
    if data.ndim != 3 or 0 in data.shape[1:] or np.any(np.mod(shape, data.shape[1:])):
        raise UnreadableError(f"blocks of shape {data.shape} make no matrix of shape {shape}")
    blocks = (shape[0] // data.shape[1], shape[1] // data.shape[2])
    _compressed(blocks, data, **places)
    return scipy.sparse.bsr_array((data, places["indices"], places["indptr"]), shape=shape)


def _coo(shape: tuple[int, int], data: np.ndarray, row: np.ndarray, col: np.ndarray) -> sparray:
    _check_flat(data)
    if not row.shape == col.shape == data.shape:
        raise UnreadableError(f"{data.shape} values have {row.shape} rows and {col.shape} columns")
    _check_inside("row", row, shape[0])
    _check_inside("col", col, shape[1])
    return scipy.sparse.coo_array((data, (row, col)), shape=shape)


def _dia(shape: tuple[int, int], data: np.ndarray, offsets: np.ndarray) -> sparray:
    if data.ndim != 2 or offsets.shape != data.shape[:1] or len(set(offsets.tolist())) < len(data):
        raise UnreadableError(f"data of shape {data.shape} have {offsets.shape} offsets, each once")
    _check_inside("offsets", offsets + shape[0] - 1, shape[0] + shape[1] - 1)
    if data.shape[1] > shape[1]:
        raise UnreadableError(f"diagonals of {data.shape[1]} values in {shape[1]} columns")
    return scipy.sparse.dia_array((data, offsets), shape=shape)


def _check_flat(data: np.ndarray) -> None:
    if data.ndim != 1:
        raise UnreadableError(f"data have the shape {data.shape}, no list")


_FORMS: dict[str, tuple[Callable[..., sparray], tuple[str, ...]]] = {
    "csr": (_csr, ("indices", "indptr")),
    "csc": (_csc, ("indices", "indptr")),
    "bsr": (_bsr, ("indices", "indptr")),
    "coo": (_coo, ("row", "col")),
    "dia": (_dia, ("offsets",)),
}


_LONGEST_HEAD = 100_000  # bytes of comments before the sizes
_BANNER = "%%matrixmarket"
_NUMBERS = {"real": 1, "double": 1, "integer": 1, "complex": 2, "pattern": 0}
_SYMMETRIES = ("general", "symmetric")

NumberTable = Float[np.ndarray, "line column"]


class _Head(NamedTuple):
    """What a file announces: layout, numbers of a value, symmetry, sizes, start of its values."""

    layout: str
    numbers: int
    symmetry: str
    sizes: tuple[int, ...]
    values_from: int


def market_matrix(path: Path) -> scipy.sparse.sparray | np.ndarray:
    """Return the matrix in a file."""
    content = _content(path)
    head = _head(content)
    table = _table(content[head.values_from :], head)
    return _sparse(table, head) if head.layout == "coordinate" else _dense(table, head)


def _content(path: Path) -> bytes:
    if path.suffix != ".gz":
        return path.read_bytes()
    with gzip.open(path) as file:
        content = file.read(most("bytes") + 1)
    if len(content) > most("bytes"):
        raise UnreadableError(f"it unpacks to more than {most('bytes')} bytes")
    return content


def _head(content: bytes) -> _Head:
    first, *lines = content[:_LONGEST_HEAD].split(b"\n")
    words = first.decode("latin-1").lower().split()
    known = len(words) == 5 and words[:2] == [_BANNER, "matrix"]
    layout, kind, symmetry = words[2:] if known else ("", "", "")
    if layout not in ("coordinate", "array") or kind not in _NUMBERS:
        raise UnreadableError(f"it begins with {content[:30]!r}")
    if symmetry not in _SYMMETRIES:
        raise UnreadableError(f"it is {symmetry}, and general or symmetric is needed")
    place = len(first) + 1
    for line in lines:
        place += len(line) + 1
        if line.strip() and not line.lstrip().startswith(b"%"):
            sizes = _sizes(line, 3 if layout == "coordinate" else 2)
            return _Head(layout, _NUMBERS[kind], symmetry, sizes, place)
    raise UnreadableError("it has no line of sizes")


def _sizes(line: bytes, count: int) -> tuple[int, ...]:
    words = line.split()
    if len(words) != count or not all(word.isdigit() and len(word) < 19 for word in words):
        raise UnreadableError(f"the line of its sizes is {line[:40]!r}")
    rows, columns, *_ = sizes = tuple(map(int, words))
    if not (1 <= rows <= MOST_ROWS and 1 <= columns <= MOST_ROWS):
        raise UnreadableError(f"its size is {rows} x {columns}")
    return sizes


def _table(values: bytes, head: _Head) -> NumberTable:
    """Values of the file, a row for each; refused where they are not those announced."""
    rows, columns, *stored = head.sizes
    full = rows * columns if head.symmetry == "general" else rows * (rows + 1) // 2
    count = stored[0] if stored else full
    if not 0 < 2 * count <= len(values) + 1:  # a digit and the end of a line for each
        raise UnreadableError(f"it announces {count} values in {len(values)} bytes")
    table = np.loadtxt(io.BytesIO(values), dtype=float, comments="%", ndmin=2, encoding="latin-1")
    width = head.numbers + (2 if head.layout == "coordinate" else 0)
    if table.shape != (count, width):
        size = " x ".join(map(str, table.shape))
        raise UnreadableError(f"it announces {count} lines of {width} numbers and holds {size}")
    return table


def _sparse(table: NumberTable, head: _Head) -> scipy.sparse.sparray:
    rows, columns, _ = head.sizes
    places = table[:, :2]
    integral = np.array_equal(places, np.round(places))
    if not (integral and np.all(places >= 1) and np.all(places <= (rows, columns))):
        raise UnreadableError(f"an index is none of 1 to {rows} and 1 to {columns}")
    row, column = places.T.astype(np.int64) - 1
    values = _values(table[:, 2:])
    if head.symmetry == "symmetric":
        off_diagonal = row != column
        row, column = np.append(row, column[off_diagonal]), np.append(column, row[off_diagonal])
        values = np.append(values, values[off_diagonal])
    return scipy.sparse.coo_array((values, (row, column)), shape=(rows, columns))


def _dense(table: NumberTable, head: _Head) -> np.ndarray:
    rows, columns = head.sizes
    values = _values(table)
    if head.symmetry == "general":
        return values.reshape(columns, rows).T
    square = np.zeros((rows, rows), values.dtype)
    upper = np.triu_indices(rows)  # the lower triangle, column by column
    square[upper[::-1]] = square[upper] = values
    return square


def _values(numbers: NumberTable) -> np.ndarray:
    if numbers.shape[1] == 0:
        return np.ones(len(numbers))
    return numbers[:, 0] if numbers.shape[1] == 1 else numbers[:, 0] + 1j * numbers[:, 1]
