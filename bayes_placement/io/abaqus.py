"""Stiffness and mass that Abaqus writes by `*MATRIX GENERATE`: node, dof, node, dof, value.

Abaqus Keywords Guide, `*MATRIX INPUT` and `*MATRIX OUTPUT, FORMAT=MATRIX INPUT`.
"""

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy.sparse
from jaxtyping import Float

from .._shared.errors import InputError
from ._gate import existing, path_of, reading
from ._npz_archive import MOST_ROWS
from .matrix_files import SystemMatrices, _in_si, _Rows, _without_rows

_REMEDY = (
    "Write it by *MATRIX OUTPUT, STIFFNESS, MASS, FORMAT=MATRIX INPUT, as text, and give both "
    "files: read_matrices('job_STIF1.mtx', 'job_MASS1.mtx')."
)
_COLUMNS = 5
_HELD = 1e30  # Abaqus puts 1e36 on the diagonal where a boundary condition holds
_AGREEMENT = 1e-9  # of the largest value: digits of the text


class _Entries(NamedTuple):
    """Entries of a matrix: row, column, each a node and a direction, and value."""

    row: _Rows
    column: _Rows
    value: Float[np.ndarray, "entry"]


def read_matrices(
    stiffness: str | Path, mass: str | Path, *, length_unit: float = 1.0, mass_unit: float = 1.0
) -> SystemMatrices:
    """Read stiffness and mass from two files of entries; one triangle or both.

    Degrees of freedom that a boundary condition holds (1e36 on the diagonal of the stiffness) are
    left out. The result states node and direction of each row in `dof`.

    Parameters
    ----------
    stiffness, mass
        The files, usually `.mtx`.
    length_unit, mass_unit
        What one unit of the model is in m and in kg: 1e-3 and 1e3 for mm, t, s.

    Returns
    -------
    SystemMatrices
        `stiffness`, `mass` in SI, and `dof`.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    InputError
        If a file holds something else, or the matrices are not those of an undamped structure.

    Examples
    --------
    >>> from pathlib import Path
    >>> for name, entry in (("K.mtx", "1,1,1,1,2000."), ("M.mtx", "1,1,1,1,3.")):
    ...     characters = Path(name).write_text(entry)
    >>> bp.io.abaqus.read_matrices("K.mtx", "M.mtx", mass_unit=1e3).mass.toarray()
    array([[3000.]])
    """
    first = path_of(stiffness)
    entries = {"stiffness": _entries(first), "mass": _entries(path_of(mass))}
    labels = [label for of_file in entries.values() for label in (of_file.row, of_file.column)]
    dof = np.unique(np.concatenate(labels), axis=0)
    matrices = {name: _matrix(of_file, dof) for name, of_file in entries.items()}
    is_held = matrices["stiffness"].diagonal() >= _HELD
    free_matrices, rows = _without_rows(matrices, dof, is_held)
    with reading(first, "matrices of Abaqus", _REMEDY):
        return _in_si(first, free_matrices, rows, length_unit=length_unit, mass_unit=mass_unit)


def _entries(path: Path) -> _Entries:
    """Entries of a file, each of which stands once."""
    with reading(existing(path, "a matrix of Abaqus"), "a matrix of Abaqus", _REMEDY):
        table = _table(path)
        places = table[:, :4]
        if not np.array_equal(places, np.round(places)) or np.abs(places).max() > MOST_ROWS:
            raise InputError("a node or a degree of freedom is no whole number")
        if not np.isfinite(table[:, 4]).all():
            raise InputError("a value is not finite")
        numbers = places.astype(np.int64)
        entries = _Entries(numbers[:, :2], numbers[:, 2:], table[:, 4])
        if len(np.unique(numbers, axis=0)) < len(numbers):
            raise InputError("an entry occurs twice, and either could be meant")
        return _mirrored(entries)


def _table(path: Path) -> Float[np.ndarray, "entry 5"]:
    """Numbers of the lines that are neither comments nor the keyword of a matrix."""
    lines = []
    for number, line in enumerate(path.read_bytes().decode("latin-1").splitlines(), start=1):
        text = line.strip()
        if text.startswith("*"):
            _check_keyword(number, text)
        elif text:
            lines.append(text.rstrip(","))
    if not lines:
        raise InputError("it has no entry")
    table = np.loadtxt(lines, delimiter=",", ndmin=2)
    if table.shape[1] != _COLUMNS:
        raise InputError(f"its lines have {table.shape[1]} numbers, and five are needed")
    return table


def _check_keyword(number: int, text: str) -> None:
    """Refuse keywords of other data, and matrices that are not symmetric."""
    if text.startswith("**"):
        return
    words = re.sub(r"\s", "", text).upper()
    if not words.startswith(("*MATRIXINPUT", "*MATRIXGENERATE", "*MATRIXOUTPUT")):
        raise InputError(f"line {number} is {text[:40]!r}, no entry of a matrix")
    if "UNSYMMETRIC" in words:
        raise InputError(f"line {number} says that it is unsymmetric")


def _mirrored(entries: _Entries) -> _Entries:
    """Complete a triangle; where both triangles are there they must agree."""
    row, column, value = entries
    swapped = (row[:, 0] > column[:, 0]) | (
        (row[:, 0] == column[:, 0]) & (row[:, 1] > column[:, 1])
    )
    low, high = np.where(swapped[:, None], column, row), np.where(swapped[:, None], row, column)
    pairs, first, inverse = np.unique(
        np.hstack([low, high]), axis=0, return_index=True, return_inverse=True
    )
    error = np.abs(value - value[first][inverse.ravel()]).max()
    if error > _AGREEMENT * np.abs(value[np.abs(value) < _HELD]).max(initial=0.0):
        raise InputError("its triangles differ; a symmetric matrix is needed")
    return _Entries(pairs[:, :2], pairs[:, 2:], value[first])


def _matrix(entries: _Entries, dof: _Rows) -> scipy.sparse.csc_array:
    """Upper triangle of a matrix, on given degrees of freedom."""
    places = _place(entries.row, dof), _place(entries.column, dof)
    return scipy.sparse.csc_array((entries.value, places), shape=(len(dof), len(dof)))


def _place(wanted: _Rows, dof: _Rows) -> np.ndarray:
    """Row of each degree of freedom among sorted ones."""
    span = np.int64(max(dof[:, 1].max(), wanted[:, 1].max()) + 1)
    return np.searchsorted(dof[:, 0] * span + dof[:, 1], wanted[:, 0] * span + wanted[:, 1])
