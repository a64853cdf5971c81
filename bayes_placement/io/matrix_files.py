"""Stiffness and mass in files of matrices: SciPy (.npz), Matrix Market (.mtx), MATLAB (.mat)."""

import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy.io
import scipy.sparse
from jaxtyping import Int

from .._shared.arguments import arguments_checked, finite_number
from .._shared.errors import InputError
from .._shared.reprs import with_short_repr
from . import _contents as content
from . import arrays
from ._contents import content_of
from ._gate import check_plausible, existing, reading
from ._npz_archive import NpzArchive, market_matrix, sparse_matrix
from .arrays._mat_gate import SPARSE

_FORMS = "a sparse matrix (.npz by SciPy, .mtx, or .mat)"
_ROUND_OFF = 1e-8  # of the largest entry: asymmetry that the order of assembly leaves
_OF_DIGITS = 1e-4  # of an entry: what a file of five digits leaves


@with_short_repr
class SystemMatrices(NamedTuple):
    """Stiffness and mass matrices of the same degrees of freedom.

    Parameters
    ----------
    stiffness
        Stiffness [N/m], csc.
    mass
        Mass [kg], csc.
    regions
        Stiffness of each region by name, csc.
    dof
        Node number and direction (1 to 6 for x, y, z, rx, ry, rz) of each row, where the file
        states them.

    Examples
    --------
    >>> system = bp.io.matrix_files.SystemMatrices(matrices.stiffness, matrices.mass, {})
    >>> system.stiffness.shape
    (10, 10)
    """

    stiffness: scipy.sparse.csc_array
    mass: scipy.sparse.csc_array
    regions: dict[str, scipy.sparse.csc_array]
    dof: Int[np.ndarray, "dof 2"] | None = None


@arguments_checked
def read(
    stiffness: str | Path,
    mass: str | Path | None = None,
    *,
    regions: Mapping[str, str | Path] | None = None,
) -> SystemMatrices:
    """Read stiffness, mass and the stiffness of regions from .npz (SciPy), .mtx or .mat files.

    A file of MATLAB may hold both, full or sparse, as `K` and `M`, `K0` and `M0`, `stiffness` and
    `mass` or the like, and no other square matrix of such a name. Symmetric matrices of which only
    one triangle is stored are completed, whether the file says so (Matrix Market) or not.

    Parameters
    ----------
    stiffness, mass
        Files of the matrices in SI, on all degrees of freedom; without that of the mass, both are
        in one.
    regions
        File of the stiffness of each region, by its name.

    Returns
    -------
    SystemMatrices
        `stiffness`, `mass` and `regions`.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    ValueError
        If a file does not hold such a matrix, or the sizes differ.

    Examples
    --------
    >>> import scipy.sparse
    >>> for name, matrix in (("K.npz", matrices.stiffness), ("M.npz", matrices.mass)):
    ...     scipy.sparse.save_npz(name, matrix)
    >>> bp.io.matrix_files.read("K.npz", "M.npz").mass.shape
    (10, 10)
    """
    files = {"stiffness": stiffness, "mass": stiffness if mass is None else mass} | {
        f"region {name}": path for name, path in (regions or {}).items()
    }
    if mass is None and content_of(existing(Path(stiffness), _FORMS)) not in _MATLAB:
        raise InputError(
            f"{stiffness} was given alone, and is no file of MATLAB, which may hold both matrices; "
            "that of the mass is needed, since modes follow from both: "
            'io.read_matrices("K.mtx", "M.mtx").'
        )
    matrices = {name: _read_matrix(Path(path), name) for name, path in files.items()}
    return system_matrices(matrices, {name: str(path) for name, path in files.items()})


@arguments_checked
def system_matrices(
    matrices: Mapping[str, scipy.sparse.csc_array], places: Mapping[str, str]
) -> SystemMatrices:
    """Check and complete matrices that belong together; readers of all formats end here.

    Parameters
    ----------
    matrices
        The matrices `stiffness`, `mass`, and any `region NAME`.
    places
        Where each comes from, for messages.

    Raises
    ------
    ValueError
        If a matrix is not real, finite, square and symmetric, gives two rows a negative energy,
        or is of another size than the stiffness.

    Examples
    --------
    >>> both = {"stiffness": matrices.stiffness, "mass": matrices.mass}
    >>> places = {"stiffness": "K of frame.h5", "mass": "M of frame.h5"}
    >>> bp.io.matrix_files.system_matrices(both, places).mass.shape
    (10, 10)
    """
    complete = {name: _symmetric(matrix, places[name]) for name, matrix in matrices.items()}
    size = complete["stiffness"].shape
    for name, matrix in complete.items():
        if matrix.shape != size:
            raise InputError(
                f"{places[name]} ({name}) has the size {_size(matrix)}, but "
                f"{places['stiffness']} (stiffness) {_size(complete['stiffness'])}; one size is "
                "needed, since rows are the same degrees of freedom. Export all matrices on the "
                "same set, with the fixed degrees of freedom in all or in none."
            )
    regions = {
        name.removeprefix("region "): matrix
        for name, matrix in complete.items()
        if name.startswith("region ")
    }
    return SystemMatrices(complete["stiffness"], complete["mass"], regions)


def _read_matrix(path: Path, role: str) -> scipy.sparse.csc_array:
    existing(path, _FORMS)
    remedy = "Write it with scipy.sparse.save_npz (.npz) or scipy.io.mmwrite (.mtx, .mtx.gz)."
    with reading(path, "a sparse matrix", remedy):
        if content_of(path) in _MATLAB:
            stored = _of_matlab(path, role)
        elif path.suffix == ".npz":
            stored = sparse_matrix(NpzArchive(path, "a matrix"))
        else:
            stored = market_matrix(path)
        matrix = scipy.sparse.csc_array(stored)
        check_plausible(path, values=matrix.data)
    return matrix


def _symmetric(matrix: scipy.sparse.csc_array, place: str) -> scipy.sparse.csc_array:
    """Complete a triangular matrix, and refuse what is not real and symmetric."""
    if np.iscomplexobj(matrix) or matrix.shape[0] != matrix.shape[1] or not matrix.shape[0]:
        raise _refused(place, f"a {_size(matrix)} matrix of {matrix.dtype.name}")
    if not np.isfinite(matrix.data).all():
        raise _refused(place, "values that are not finite")
    if (matrix.diagonal() < 0).any():
        raise _refused(place, "a negative value on its diagonal")
    complete = _completed(matrix.astype(float))
    largest = abs(complete).max()
    if largest == 0:
        raise _refused(place, "zeros only")
    if abs(complete - complete.T).max() > _ROUND_OFF * largest:
        raise _refused(place, "a matrix that is not symmetric")
    _check_couplings(complete, largest, place)
    return complete


def _check_couplings(matrix: scipy.sparse.csc_array, largest: float, place: str) -> None:
    """Refuse an entry that would give a motion of its two rows a negative energy."""
    entries, root = scipy.sparse.coo_array(matrix), np.sqrt(matrix.diagonal())
    allowed = root[entries.row] * root[entries.col] * (1 + _OF_DIGITS)
    excess = np.abs(entries.data) - allowed
    worst = int(np.argmax(excess))
    if excess[worst] > _ROUND_OFF * largest:
        row, column = sorted((int(entries.row[worst]), int(entries.col[worst])))
        raise _refused(
            place,
            f"{entries.data[worst]:g} in row {row}, column {column}, more than its diagonal of "
            f"{root[row] ** 2:g} and {root[column] ** 2:g} allows",
        )


def _completed(matrix: scipy.sparse.csc_array) -> scipy.sparse.csc_array:
    below, above = scipy.sparse.tril(matrix, -1), scipy.sparse.triu(matrix, 1)
    triangular = (below.nnz == 0) != (above.nnz == 0)
    if not triangular:
        return matrix
    return scipy.sparse.csc_array(matrix + below.T + above.T)


def _refused(place: str, contents: str) -> InputError:
    return InputError(
        f"{place} holds {contents}; a real, finite, square and symmetric matrix with a "
        "diagonal that is not negative is needed, since stiffness and mass of an undamped "
        "structure are such: no motion has a negative energy. Export it without damping, "
        "follower loads and rotor terms, as a full matrix or as a triangle."
    )


def _size(matrix: scipy.sparse.csc_array) -> str:
    return f"{matrix.shape[0]} x {matrix.shape[1]}"


_MATLAB = (content.MAT, content.MAT_HDF5)
NAMES = {"stiffness": r"k\d*|k_?[a-z]{1,3}|stiff\w*", "mass": r"m\d*|m_?[a-z]{1,3}|mass\w*"}
"""What the names of matrices look like, in lower case."""


def _of_matlab(path: Path, role: str) -> scipy.sparse.csc_array:
    """Return `stiffness` or `mass`: the only matrix in the file, or of such a name."""
    square = {n: m for n, m in _matrices(path).items() if m.ndim == 2 and m.shape[0] == m.shape[1]}
    square = {name: values for name, values in square.items() if values.shape[0] > 1}
    lasts = {name: name.rpartition(".")[2].lower() for name in square}  # of fields of structures
    named = [name for name, last in lasts.items() if re.fullmatch(NAMES.get(role, ""), last)]
    found = named if len(square) > 1 else [*square]
    if len(found) != 1:
        known = ", ".join(f"{name} ({'x'.join(map(str, m.shape))})" for name, m in square.items())
        raise InputError(
            f"it holds the square matrices {known or 'none'}, of which {', '.join(found) or 'none'}"
            f" may be the {role} by name; one is needed, since it is not guessed. Save it alone, "
            f"with the name {'K' if role == 'stiffness' else 'M'}: save('system.mat', 'K', 'M')."
        )
    return scipy.sparse.csc_array(square[found[0]])


def _matrices(path: Path) -> dict[str, np.ndarray | scipy.sparse.csc_array]:
    """Full matrices, and sparse ones, whose indices the gate has checked."""
    loaded = arrays.load(path)
    sparse = [name for name, reason in loaded.left_out.items() if reason == SPARSE]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        content = scipy.io.loadmat(path, variable_names=sparse) if sparse else {}
    return {
        **{name: values for name, values in loaded.arrays.items() if values.dtype.kind in "iufc"},
        **{name: scipy.sparse.csc_array(content[name]) for name in sparse},
    }


_DIRECTIONS = 6
_Rows = Int[np.ndarray, "_ 2"]


def _in_si(
    path: Path,
    matrices: dict[str, scipy.sparse.csc_array],
    dof: _Rows,
    *,
    length_unit: float,
    mass_unit: float,
) -> SystemMatrices:
    """Turn matrices, `stiffness` and `mass` on the same rows, into SI and check them.

    Units are what one of the file is in m and in kg; time is in s. An upper triangle is enough.
    """
    for name, unit in (("length_unit", length_unit), ("mass_unit", mass_unit)):
        if finite_number(name, unit, f"{name}=1e-3") <= 0:
            raise InputError(f"{name}={unit} was given; a positive number is needed: {name}=1e-3.")
    _check_rows(path, dof)
    scale = np.where(dof[:, 1] > 3, length_unit, 1.0)  # a rotation has no length
    spread = scipy.sparse.diags_array(scale)
    scaled = {
        name: scipy.sparse.csc_array(mass_unit * (spread @ matrix @ spread))
        for name, matrix in matrices.items()
    }
    system = system_matrices(scaled, {name: f"{path}, {name}" for name in matrices})
    return system._replace(dof=dof)


def _without_rows(
    matrices: dict[str, scipy.sparse.csc_array], dof: _Rows, is_held: np.ndarray
) -> tuple[dict[str, scipy.sparse.csc_array], _Rows]:
    """Leave out the rows that are held."""
    free = np.flatnonzero(~is_held)
    return {name: matrix[free][:, free] for name, matrix in matrices.items()}, dof[free]


def _check_rows(path: Path, dof: _Rows) -> None:
    wrong = np.flatnonzero((dof[:, 0] < 1) | (dof[:, 1] < 1) | (dof[:, 1] > _DIRECTIONS))
    if wrong.size:
        node, direction = dof[wrong[0]].tolist()
        raise InputError(
            f"{path} holds degree of freedom {direction} of node {node}; 1 to {_DIRECTIONS} of "
            "nodes from 1 are needed (x, y, z, rx, ry, rz), since the structure moves and turns "
            "only. Leave internal nodes, pressures and temperatures out of the matrices."
        )
