"""Stiffness and mass of Ansys (`.full`), and its modes (`.rst`), by ansys-mapdl-reader.

That library reads some files of Ansys 2021 and later wrongly without a word (its issues 110, 235,
402 and 409), and ends the interpreter on others: it runs in a separate process, and what it
reads is checked against the matrices.
"""

from pathlib import Path

import numpy as np
import scipy.sparse

from .._shared.arguments import check_positive
from .._shared.errors import InputError
from ..modes.finite_elements.modal_model import ModalModel
from ._gate import check_plausible, existing, path_of, reading
from ._reader_process import run_library
from .matrix_files import SystemMatrices, _in_si, _without_rows

_FORM = "a file of Ansys (.full, .rst)"
_REMEDY = "Write it again in a modal analysis, uncompressed: /FCOMP,RST,0."
_IN_SI = ("", "SI", "MKS", "User Defined")
_DIRECTIONS = {"UX": 1, "UY": 2, "UZ": 3, "ROTX": 4, "ROTY": 5, "ROTZ": 6}
_ORTHONORMAL, _SAME_FREQUENCY = 1e-4, 1e-4  # result files may be in single precision


def read_matrices(
    path: str | Path, *, length_unit: float | None = None, mass_unit: float | None = None
) -> SystemMatrices:
    """Read stiffness and mass of a `.full` file, without the degrees of freedom that are held.

    The result states node and direction of each row in `dof`.

    Parameters
    ----------
    path
        The file, of a modal analysis with a consistent mass.
    length_unit, mass_unit
        What one unit of the model is in m and in kg: 1e-3 and 1e3 for mm, t, s. Where the file
        does not say that it is in other units, 1.

    Returns
    -------
    SystemMatrices
        `stiffness`, `mass` in SI, and `dof`.

    Raises
    ------
    MissingExtraError
        If ansys-mapdl-reader is not installed.
    FileNotFoundError
        If there is no such file.
    InputError
        If it cannot be read, states other units than SI and none is given, or does not hold the
        matrices of an undamped structure.

    Examples
    --------
    >>> matrices = bp.io.ansys.read_matrices("file.full", length_unit=1e-3)  # doctest: +SKIP
    """
    file = path_of(path)
    _check_units(length_unit, mass_unit)
    with reading(file, "matrices of Ansys", _REMEDY):
        result = run_library(existing(file, _FORM), "ansys")
        if "stiffness value" not in result.arrays:
            raise InputError("it holds results and no matrices; the .full file is needed")
        units = _units(file, result.metadata["units"], length_unit, mass_unit)
        dof = result.arrays["dof"]
        matrices = {name: _matrix(result.arrays, name, len(dof)) for name in ("stiffness", "mass")}
        is_held = (matrices["stiffness"].diagonal() == 0) & (matrices["mass"].diagonal() == 0)
        free_matrices, rows = _without_rows(matrices, dof, is_held)
        return _in_si(file, free_matrices, rows, length_unit=units[0], mass_unit=units[1])


def read_modes(
    path: str | Path,
    matrices: str | Path,
    *,
    length_unit: float | None = None,
    mass_unit: float | None = None,
) -> ModalModel:
    """Read nodes and modes of a `.rst` file, confirmed by the matrices of a `.full` file.

    Parameters
    ----------
    path
        The file of results of a modal analysis, with shapes normalised to the mass.
    matrices
        The `.full` file of the same analysis.
    length_unit, mass_unit
        As in `read_matrices`.

    Returns
    -------
    ModalModel
        Nodes and modes in SI.

    Raises
    ------
    MissingExtraError
        If ansys-mapdl-reader is not installed.
    FileNotFoundError
        If a file is missing.
    InputError
        If a file cannot be read, or the modes are not those of the matrices.

    Examples
    --------
    >>> model = bp.io.ansys.read_modes("file.rst", "file.full")  # doctest: +SKIP
    """
    file = path_of(path)
    _check_units(length_unit, mass_unit)
    # In the units of the files, in which the shapes are orthonormal.
    system = read_matrices(matrices, length_unit=1.0, mass_unit=1.0)
    with reading(file, "modes of Ansys", _REMEDY):
        result = run_library(existing(file, _FORM), "ansys")
        if "shape" not in result.arrays:
            raise InputError("it holds matrices and no results; the .rst file is needed")
        units = _units(file, result.metadata["units"], length_unit, mass_unit)
        check_plausible(file, shapes=result.arrays["shape"], nodes=result.arrays["position"])
        directions = [_DIRECTIONS.get(name, 0) for name in result.metadata["directions"]]
        shape = np.zeros((*result.arrays["shape"].shape[:2], 6))
        for column, direction in enumerate(directions):
            if direction:
                shape[:, :, direction - 1] = result.arrays["shape"][:, :, column]
        frequency = result.arrays["frequency"]
        _check_modes(system, result.arrays["node"], shape, frequency)
        return ModalModel.from_arrays(
            node=result.arrays["node"],
            position=result.arrays["position"],
            shape=np.moveaxis(shape, 0, -1),
            natural_frequency=frequency,
            modal_mass=1.0,
            length_unit=units[0],
            mass_unit=units[1],
        ).without_unused_directions()


def _check_units(length_unit: float | None, mass_unit: float | None) -> None:
    """Refuse units that are no positive numbers before a file is read."""
    for name, unit in (("length_unit", length_unit), ("mass_unit", mass_unit)):
        if unit is not None:
            check_positive(name, unit, f"{name}=1e-3")


def _units(
    path: Path, stated: str, length_unit: float | None, mass_unit: float | None
) -> tuple[float, float]:
    """Units of the file; where it states others than SI, they must be given."""
    if stated not in _IN_SI and (length_unit is None or mass_unit is None):
        raise InputError(
            f"{path} states the units {stated}; what one unit of length and of mass is in SI is "
            "needed, since matrices are in kg, m, s here: length_unit=1e-3, mass_unit=1e3 for mm, "
            "t, s."
        )
    length, mass = (1.0 if unit is None else unit for unit in (length_unit, mass_unit))
    return length, mass


def _matrix(arrays: dict[str, np.ndarray], name: str, size: int) -> scipy.sparse.csc_array:
    """Upper triangle of a symmetric matrix."""
    row, column, value = (arrays[f"{name} {part}"] for part in ("row", "column", "value"))
    if row.size and not (min(row.min(), column.min()) >= 0 and max(row.max(), column.max()) < size):
        raise InputError(f"an index of its {name} lies outside of it")
    if (row > column).any():
        raise InputError(f"its {name} is not the upper triangle that was asked for")
    return scipy.sparse.csc_array((value, (row, column)), shape=(size, size))


def _check_modes(
    system: SystemMatrices, node: np.ndarray, shape: np.ndarray, frequency: np.ndarray
) -> None:
    """Refuse shapes that are not orthonormal in the mass, or have other frequencies."""
    dof = system.dof if system.dof is not None else np.zeros((0, 2), np.int64)
    missing = np.setdiff1d(dof[:, 0], node)
    if missing.size:
        raise InputError(f"node {missing[0]} of the matrices has no shape in it")
    order = np.argsort(node)
    place = order[np.searchsorted(node[order], dof[:, 0])]
    vectors = shape[:, place, dof[:, 1] - 1]
    masses = vectors @ (system.mass @ vectors.T)
    error = np.abs(masses - np.eye(len(vectors))).max()
    if not error < _ORTHONORMAL:
        raise InputError(
            f"its shapes are not orthonormal in the mass of the matrices (error {error:.2g}), so "
            "that they are of another analysis, or read wrongly, as compressed results of Ansys "
            "2021 and later are. Write them uncompressed, normalised to the mass"
        )
    stiffnesses = np.einsum("mi,im->m", vectors, system.stiffness @ vectors.T)
    computed = np.sqrt(np.abs(stiffnesses)) / (2 * np.pi)
    apart = np.abs(computed - frequency) > _SAME_FREQUENCY * frequency.max()
    if apart.any():
        mode = int(np.argmax(apart))
        raise InputError(
            f"its mode {mode + 1} is at {frequency[mode]:.6g} Hz, and its shape has "
            f"{computed[mode]:.6g} Hz in the matrices; both files must be of one analysis"
        )
