"""Matrices in files of Matrix Market (.mtx, .mtx.gz), read by columns once they are counted.

SciPy's reader ends the interpreter on some damaged files. The format: https://math.nist.gov/MatrixMarket
"""

import gzip
import io
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy.sparse
from jaxtyping import Float

from ._gate import most
from ._npz_archive import MOST_ROWS, no_sparse_matrix

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


def matrix(path: Path) -> scipy.sparse.sparray | np.ndarray:
    """Return the matrix in a file."""
    content = _content(path)
    head = _head(path, content)
    table = _table(path, content[head.values_from :], head)
    return _sparse(path, table, head) if head.layout == "coordinate" else _dense(table, head)


def _content(path: Path) -> bytes:
    if path.suffix != ".gz":
        return path.read_bytes()
    with gzip.open(path) as file:
        content = file.read(most("bytes") + 1)
    if len(content) > most("bytes"):
        raise no_sparse_matrix(path, f"it unpacks to more than {most('bytes')} bytes")
    return content


def _head(path: Path, content: bytes) -> _Head:
    first, *lines = content[:_LONGEST_HEAD].split(b"\n")
    words = first.decode("latin-1").lower().split()
    known = len(words) == 5 and words[:2] == [_BANNER, "matrix"]
    layout, kind, symmetry = words[2:] if known else ("", "", "")
    if layout not in ("coordinate", "array") or kind not in _NUMBERS:
        raise no_sparse_matrix(path, f"it begins with {content[:30]!r}")
    if symmetry not in _SYMMETRIES:
        raise no_sparse_matrix(path, f"it is {symmetry}, and general or symmetric is needed")
    place = len(first) + 1
    for line in lines:
        place += len(line) + 1
        if line.strip() and not line.lstrip().startswith(b"%"):
            sizes = _sizes(path, line, 3 if layout == "coordinate" else 2)
            return _Head(layout, _NUMBERS[kind], symmetry, sizes, place)
    raise no_sparse_matrix(path, "it has no line of sizes")


def _sizes(path: Path, line: bytes, count: int) -> tuple[int, ...]:
    words = line.split()
    if len(words) != count or not all(word.isdigit() and len(word) < 19 for word in words):
        raise no_sparse_matrix(path, f"the line of its sizes is {line[:40]!r}")
    rows, columns, *_ = sizes = tuple(map(int, words))
    if not (1 <= rows <= MOST_ROWS and 1 <= columns <= MOST_ROWS):
        raise no_sparse_matrix(path, f"its size is {rows} x {columns}")
    return sizes


def _table(path: Path, values: bytes, head: _Head) -> NumberTable:
    """Values of the file, a row for each; refused where they are not those announced."""
    rows, columns, *stored = head.sizes
    full = rows * columns if head.symmetry == "general" else rows * (rows + 1) // 2
    count = stored[0] if stored else full
    if not 0 < 2 * count <= len(values) + 1:  # a digit and the end of a line for each
        raise no_sparse_matrix(path, f"it announces {count} values in {len(values)} bytes")
    table = np.loadtxt(io.BytesIO(values), dtype=float, comments="%", ndmin=2, encoding="latin-1")
    width = head.numbers + (2 if head.layout == "coordinate" else 0)
    if table.shape != (count, width):
        size = " x ".join(map(str, table.shape))
        raise no_sparse_matrix(
            path, f"it announces {count} lines of {width} numbers and holds {size}"
        )
    return table


def _sparse(path: Path, table: NumberTable, head: _Head) -> scipy.sparse.sparray:
    rows, columns, _ = head.sizes
    places = table[:, :2]
    integral = np.array_equal(places, np.round(places))
    if not (integral and np.all(places >= 1) and np.all(places <= (rows, columns))):
        raise no_sparse_matrix(path, f"an index is none of 1 to {rows} and 1 to {columns}")
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
