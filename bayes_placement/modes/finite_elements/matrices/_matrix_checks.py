"""Checks of the arrays of a finite element model; errors say what is needed."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, diags_array, issparse
from scipy.sparse.linalg import ArpackNoConvergence, eigsh

from ...._shared.arguments import check_annotated
from ...._shared.errors import InputError
from .._modal_model_checks import checked_dof, checked_node, checked_position
from ..modal_model import DIRECTIONS
from ._reduced_basis import Affine

Dof = Int[np.ndarray, "dof 2"]
Sparse = Any
"""A SciPy sparse matrix or array of any format, or a dense array."""

SMALL = 300
"""Rows up to which eigenvalues are computed densely."""

SYMMETRY = 1e-8
"""Share of the geometric mean of two diagonal entries that may be lost to rounding."""


def sparse(name: str, matrix: Sparse, size: int) -> csc_array:
    """Sparse matrix of finite numbers over all degrees of freedom."""
    if not issparse(matrix):
        check_annotated(name, matrix, ArrayLike)
    shape = np.shape(matrix)
    if len(shape) != 2 or shape[0] != shape[1]:
        raise InputError(
            f"{name} has shape {shape}; a square matrix over all degrees of freedom is needed, "
            "one row and one column for each. Pass the assembled matrix, held rows included."
        )
    if shape[0] != size:
        raise InputError(
            f"{name} has {shape[0]} rows, but dof names {size} degrees of freedom; one row of dof "
            "(node, direction) is needed for each row of the matrix, held ones included. Give dof "
            "in the order of the matrix."
        )
    columns = csc_array(matrix, dtype=float)
    if not np.isfinite(columns.data).all():
        entry = int(np.flatnonzero(~np.isfinite(columns.data))[0])
        column = int(np.searchsorted(columns.indptr, entry, side="right")) - 1
        raise InputError(
            f"{name} is {columns.data[entry]:g} in row {columns.indices[entry]}, column {column}; "
            "every entry must be finite. Look at how it was assembled or read."
        )
    return columns


def symmetric(name: str, matrix: csc_array, dof: Dof) -> csc_array:
    """Refuse a matrix that differs from its transpose by more than rounding; remove the rest."""
    difference = abs(matrix - matrix.T).tocoo()
    root = np.sqrt(np.abs(matrix.diagonal()))
    scale = root[difference.row] * root[difference.col]
    share = difference.data / np.maximum(scale, 1e-16 * root.max(initial=0.0) ** 2 + 1e-300)
    if share.size and share.max() > SYMMETRY:
        worst = int(np.argmax(share))
        row, column = int(difference.row[worst]), int(difference.col[worst])
        raise InputError(
            f"{name} is not symmetric: between {label(dof, row)} (row {row}) and "
            f"{label(dof, column)} (row {column}) its two entries are {matrix[row, column]:g} and "
            f"{matrix[column, row]:g}, {share[worst]:.1e} of the diagonal apart. Natural modes "
            "need symmetry (no follower forces, no gyroscopic terms). If one triangle was stored, "
            "add the other: triangle + triangle.T - diags(triangle.diagonal())."
        )
    return csc_array((matrix + matrix.T) / 2) if share.size else matrix


def nodes(
    position: ArrayLike, node: ArrayLike | None, dof: ArrayLike
) -> tuple[Float[np.ndarray, "node 3"], Int[np.ndarray, "node"], Dof]:
    """Coordinates, node numbers and degrees of freedom that fit each other."""
    rows = np.asarray(dof)
    if rows.ndim != 2 or rows.shape[1] != 2 or not np.issubdtype(rows.dtype, np.integer):
        raise InputError(
            f"dof has shape {rows.shape} and type {rows.dtype}; whole numbers [dof, 2] are needed, "
            "the node and the direction (1 to 7 for x y z rx ry rz w_xy) of each row, since "
            "rigid-body motions and sensors refer to them. Give one pair for each row of stiffness."
        )
    coordinates = checked_position(position)
    numbers = checked_node(node, len(coordinates))
    return coordinates, numbers, checked_dof(rows.astype(np.int64), numbers, len(rows))


def fixed_rows(fixed: ArrayLike | None, size: int) -> Int[np.ndarray, "fixed"]:
    """Rows that are held, each once."""
    fixed = np.empty(0, dtype=np.int64) if fixed is None or not np.size(fixed) else fixed
    rows = np.unique(known_rows("fixed", fixed, size))
    if rows.size == size:
        raise InputError(
            "fixed holds every row, so that nothing can move; at least one free row is needed. "
            "Leave out the rows that are free: fixed=np.flatnonzero(mask)."
        )
    return rows


def mass(matrix: csc_array, stiffness: csc_array, dof: Dof, free: Int[np.ndarray, "free"]) -> None:
    """Refuse a row of negative mass, and a free one with neither mass nor stiffness."""
    inertia, diagonal = matrix.diagonal(), stiffness.diagonal()
    if (inertia < 0).any():
        row = int(np.argmin(inertia))
        raise InputError(
            f"mass is {inertia[row]:g} on its diagonal for {label(dof, row)} (row {row}); kinetic "
            "energy cannot be negative. Look at its sign and units."
        )
    undetermined = free[(inertia[free] == 0) & (diagonal[free] == 0)]
    if undetermined.size:
        raise InputError(
            f"{label(dof, int(undetermined[0]))} (row {undetermined[0]}) has neither stiffness nor "
            f"mass, one of {undetermined.size} such rows, so that their motion is not known. Hold "
            f"them: fixed=[*fixed, {undetermined[0]}, ...], or leave them out of the matrices."
        )


def kinetic_energy(matrix: csc_array, free: Int[np.ndarray, "free"]) -> None:
    """Refuse a mass for which some motion of the free rows has negative kinetic energy."""
    inertia = matrix.diagonal()
    rows = free[inertia[free] > 0]
    scale = diags_array(inertia[rows] ** -0.5)
    least = _least_eigenvalue(csc_array(scale @ matrix[rows][:, rows] @ scale))
    if least < -SYMMETRY:
        raise InputError(
            f"mass is not positive: a motion has the kinetic energy {least:.2g} times that of its "
            "rows without coupling; kinetic energy cannot be negative. Look at how mass was "
            "assembled, or lump it."
        )


def _least_eigenvalue(matrix: csc_array) -> float:
    """Least eigenvalue, roughly; where Lanczos does not converge none is negative."""
    if not matrix.shape[0]:
        return 0.0
    if matrix.shape[0] <= SMALL:
        return float(np.linalg.eigvalsh(matrix.toarray())[0])
    start = np.random.default_rng(0).standard_normal(matrix.shape[0])
    policy = dict(which="SA", tol=1e-2, maxiter=30, return_eigenvectors=False)
    try:
        return float(eigsh(matrix, k=1, v0=start, **policy)[0])
    except ArpackNoConvergence:
        return 0.0


def asked(count: int | None, up_to: float | None) -> None:
    """Refuse modes(...) without, or with both of, its arguments, and less than one mode."""
    if (count is None) == (up_to is None):
        raise InputError(
            f"modes(count={count}, up_to={up_to}) was given; one of both is needed, how many "
            "modes or up to which frequency [Hz]: modes(up_to=500.0)."
        )
    if count is not None and count < 1:
        raise InputError(
            f"modes(count={count}) keeps no mode; at least one is needed, since a structure "
            "without modes does not move. Ask for more: modes(count=20)."
        )


def any_below(count: int, up_to: float) -> None:
    """Refuse a band without modes."""
    if not count:
        raise InputError(
            f"modes(up_to={up_to:g}) keeps no mode; at least one is needed, since a structure "
            "without modes does not move. Give a higher frequency, in Hz, or modes(count=1)."
        )


def regions(parts: Mapping[str, object], stiffness: csc_array, dof: Dof) -> dict[str, csc_array]:
    """Stiffness of each region; together not more than that of the structure."""
    regions = {name: sparse(f'regions["{name}"]', part, len(dof)) for name, part in parts.items()}
    if not regions:
        return regions
    total = stiffness.diagonal()
    excess = sum(region.diagonal() for region in regions.values()) - total
    worst = int(np.argmax(excess - SYMMETRY * total))
    if excess[worst] > SYMMETRY * total[worst]:
        raise InputError(
            f"regions add up to {total[worst] + excess[worst]:g} on the diagonal of "
            f"{label(dof, worst)} (row {worst}), but stiffness is {total[worst]:g} there; regions "
            "are parts of the stiffness, so that their sum cannot exceed it. Count each element "
            "in one region only, in the units of stiffness."
        )
    return regions


def known_rows(name: str, rows: ArrayLike, size: int) -> Int[np.ndarray, "chosen"]:
    """Rows of dof, in any order."""
    numbers = np.atleast_1d(np.asarray(rows))
    if numbers.ndim != 1 or not np.issubdtype(numbers.dtype, np.integer):
        raise InputError(
            f"{name} has shape {numbers.shape} and type {numbers.dtype}; a list of rows of dof, "
            f"counted from 0, is needed. From a mask: {name}=np.flatnonzero(mask)."
        )
    outside = numbers[(numbers < 0) | (numbers >= size)]
    if outside.size:
        raise InputError(
            f"{name} names row {outside[0]}, but rows go from 0 to {size - 1}; rows of dof counted "
            "from 0 are needed, not node numbers. Look them up: "
            "np.flatnonzero(np.isin(dof[:, 0], nodes))."
        )
    return numbers.astype(np.int64)


def releasable(
    rows: Int[np.ndarray, "released"],
    fixed: Int[np.ndarray, "fixed"],
    rigid_body_modes: int,
    dof: Dof,
) -> None:
    """Refuse to release a row that is free, or twice, and any row of a structure that floats."""
    free = np.setdiff1d(rows, fixed)
    if free.size or np.unique(rows).size != rows.size:
        refused = "a row twice"
        if free.size:
            refused = f"{label(dof, int(free[0]))} (row {free[0]}), which is free"
        raise InputError(
            f"release was asked for {refused}; rows that are held, each once, are needed, since "
            "only what a support holds can become soft. Take rows from fixed."
        )
    if rigid_body_modes:
        raise InputError(
            f"release was asked of a structure with {rigid_body_modes} rigid-body modes; all must "
            "be held, since a displaced support would move the structure without strain. "
            "Hold what moves freely: Matrices(..., fixed=[...])."
        )


def affine(parts: Affine, dof: Dof) -> Affine:
    """Parts over all degrees of freedom, with a box for each of their names."""
    names = {**parts.stiffness, **parts.mass}
    if set(names) != set(parts.box) or not names:
        unmatched = sorted(set(names) ^ set(parts.box))
        raise InputError(
            f"Affine has parts {sorted(names)} and a box for {sorted(parts.box)}; each name needs "
            f"a part and a box, at least one name in all, but {unmatched} has not both. Give "
            'box={"' + (unmatched or ["name"])[0] + '": (0.8, 1.25)}.'
        )
    for name, (low, high) in parts.box.items():
        if not 0 < low < high < np.inf:
            raise InputError(
                f'box["{name}"] is ({low:g}, {high:g}); a least and a greater positive factor are '
                "needed, 1 being nominal, since at 0 the part is gone. Give them as shares: "
                f'box={{"{name}": (0.8, 1.25)}}.'
            )
    stiffness, mass = (
        {name: symmetric(name, sparse(name, part, len(dof)), dof) for name, part in named.items()}
        for named in (parts.stiffness, parts.mass)
    )
    return Affine(stiffness, mass, parts.box)


def label(dof: Dof, row: int) -> str:
    """Name a row by its node and direction."""
    node, direction = dof[row].tolist()
    return f"node {node} {DIRECTIONS[direction - 1]}"
