"""Sparse matrices as `scipy.sparse.save_npz` writes them, built once their indices are checked."""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse

from .._shared.errors import InputError
from ._npz_archive import NpzArchive

MOST_ROWS = 20_000_000
"""Most rows of a matrix: a larger number in a file is a damaged one."""


def matrix(archive: NpzArchive) -> Any:
    """Return the matrix in an archive."""
    names = set(archive.names)
    form = _form(archive)
    build, needed = _FORMS[form]
    missing = {"shape", "data", *needed} - names
    if missing:
        raise _refused(archive, f"it has no array {sorted(missing)[0]}, which a {form} matrix has")
    shape = _shape(archive)
    arrays = {name: archive.array(name) for name in ("data", *needed)}
    for name in needed:
        if arrays[name].dtype.kind not in "iu":
            raise _refused(archive, f"{name} holds {arrays[name].dtype}, no whole numbers")
    if arrays["data"].dtype.kind not in "iufc":
        raise _refused(archive, f"data holds {arrays['data'].dtype}, no numbers")
    try:
        return build(shape, **arrays)
    except ValueError as error:
        raise _refused(archive, str(error)) from error


def _form(archive: NpzArchive) -> str:
    if "format" not in archive.names:
        raise _refused(archive, "it has no array format")
    value = archive.array("format")
    text = value.item() if value.ndim == 0 else ""
    form = text.decode("ascii", "replace") if isinstance(text, bytes) else str(text)
    if form not in _FORMS:
        raise _refused(archive, f"its format is {form!r}, none of {', '.join(_FORMS)}")
    return form


def _shape(archive: NpzArchive) -> tuple[int, int]:
    values = archive.array("shape")
    is_shape = values.dtype.kind in "iu" and values.shape == (2,)
    if not is_shape or not np.all((values >= 1) & (values <= MOST_ROWS)):
        stated = values.tolist() if values.size <= 2 else f"an array of shape {values.shape}"
        raise _refused(archive, f"its shape is {stated}")
    return int(values[0]), int(values[1])


def _compressed(
    shape: tuple[int, int], data: np.ndarray, indices: np.ndarray, indptr: np.ndarray, axis: int
) -> None:
    """Refuse the arrays of a compressed matrix whose rows, or columns, do not follow each other."""
    lines, across = shape[axis], shape[1 - axis]
    if indptr.shape != (lines + 1,) or indptr[0] != 0 or indptr[-1] != len(indices):
        raise InputError(f"indptr of shape {indptr.shape} does not divide {len(indices)} indices")
    if np.any(indptr[1:] < indptr[:-1]):
        raise InputError("indptr falls")
    if indices.ndim != 1 or len(data) != len(indices):
        raise InputError(f"{len(data)} values have {indices.shape} indices")
    _check_inside("indices", indices, across)


def _check_inside(name: str, indices: np.ndarray, size: int) -> None:
    if indices.size and not (indices.min() >= 0 and indices.max() < size):
        raise InputError(f"{name} go from {indices.min()} to {indices.max()} in a size of {size}")


def _csr(shape: tuple[int, int], data: np.ndarray, **places: np.ndarray) -> Any:
    _check_flat(data)
    _compressed(shape, data, axis=0, **places)
    return scipy.sparse.csr_array((data, places["indices"], places["indptr"]), shape=shape)


def _csc(shape: tuple[int, int], data: np.ndarray, **places: np.ndarray) -> Any:
    _check_flat(data)
    _compressed(shape, data, axis=1, **places)
    return scipy.sparse.csc_array((data, places["indices"], places["indptr"]), shape=shape)


def _bsr(shape: tuple[int, int], data: np.ndarray, **places: np.ndarray) -> Any:
    if data.ndim != 3 or 0 in data.shape[1:] or np.any(np.mod(shape, data.shape[1:])):
        raise InputError(f"blocks of shape {data.shape} do not make a matrix of shape {shape}")
    blocks = (shape[0] // data.shape[1], shape[1] // data.shape[2])
    _compressed(blocks, data, axis=0, **places)
    return scipy.sparse.bsr_array((data, places["indices"], places["indptr"]), shape=shape)


def _coo(shape: tuple[int, int], data: np.ndarray, row: np.ndarray, col: np.ndarray) -> Any:
    _check_flat(data)
    if not row.shape == col.shape == data.shape:
        raise InputError(f"{data.shape} values have {row.shape} rows and {col.shape} columns")
    _check_inside("row", row, shape[0])
    _check_inside("col", col, shape[1])
    return scipy.sparse.coo_array((data, (row, col)), shape=shape)


def _dia(shape: tuple[int, int], data: np.ndarray, offsets: np.ndarray) -> Any:
    if data.ndim != 2 or offsets.shape != data.shape[:1] or len(set(offsets.tolist())) < len(data):
        raise InputError(f"data of shape {data.shape} have {offsets.shape} offsets, each once")
    _check_inside("offsets", offsets + shape[0] - 1, shape[0] + shape[1] - 1)
    if data.shape[1] > shape[1]:
        raise InputError(f"diagonals of {data.shape[1]} values in {shape[1]} columns")
    return scipy.sparse.dia_array((data, offsets), shape=shape)


def _check_flat(data: np.ndarray) -> None:
    if data.ndim != 1:
        raise InputError(f"data have the shape {data.shape}, no list")


_FORMS: dict[str, tuple[Callable[..., Any], tuple[str, ...]]] = {
    "csr": (_csr, ("indices", "indptr")),
    "csc": (_csc, ("indices", "indptr")),
    "bsr": (_bsr, ("indices", "indptr")),
    "coo": (_coo, ("row", "col")),
    "dia": (_dia, ("offsets",)),
}


def _refused(archive: NpzArchive, reason: str) -> InputError:
    return InputError(
        f"{archive.path} cannot be read as a sparse matrix ({reason}); a file that "
        "scipy.sparse.save_npz (.npz) or scipy.io.mmwrite (.mtx, .mtx.gz) wrote is needed. "
        "Write the matrix with one of these."
    )
