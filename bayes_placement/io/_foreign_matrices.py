"""Matrices with a node and a direction for each row, in units of a program, as matrices in SI."""

from pathlib import Path

import numpy as np
import scipy.sparse
from jaxtyping import Int

from .._shared.arguments import finite_number
from .._shared.errors import InputError
from .matrix_files import SystemMatrices, system_matrices

DIRECTIONS = 6
Rows = Int[np.ndarray, "_ 2"]


def in_si(
    path: Path,
    matrices: dict[str, scipy.sparse.csc_array],
    dof: Rows,
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


def without_rows(
    matrices: dict[str, scipy.sparse.csc_array], dof: Rows, is_held: np.ndarray
) -> tuple[dict[str, scipy.sparse.csc_array], Rows]:
    """Leave out the rows that are held."""
    free = np.flatnonzero(~is_held)
    return {name: matrix[free][:, free] for name, matrix in matrices.items()}, dof[free]


def _check_rows(path: Path, dof: Rows) -> None:
    wrong = np.flatnonzero((dof[:, 0] < 1) | (dof[:, 1] < 1) | (dof[:, 1] > DIRECTIONS))
    if wrong.size:
        node, direction = dof[wrong[0]].tolist()
        raise InputError(
            f"{path} holds degree of freedom {direction} of node {node}; 1 to {DIRECTIONS} of "
            "nodes from 1 are needed (x, y, z, rx, ry, rz), since the structure moves and turns "
            "only. Leave internal nodes, pressures and temperatures out of the matrices."
        )
