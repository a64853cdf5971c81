"""Models of scikit-fem: its basis and the matrices assembled on it."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from ..._shared.arguments import arguments_checked
from . import interpolation
from .interpolation import Interpolation
from .matrices import Matrices, Sparse

if TYPE_CHECKING:
    from skfem import CellBasis

OTHER = 7
"""Direction of a slope, a twist or the like: it takes no part in a translation."""


class ReadableMatrices(NamedTuple):
    """Matrices and how to read them: `finite_elements.modes(*model, up_to=500.0)`."""

    matrices: Matrices
    interpolation: Interpolation


@arguments_checked
def from_scikit_fem(
    basis: object,
    stiffness: Sparse,
    mass: Sparse,
    *,
    axes: tuple[int, ...],
    fixed: ArrayLike | None = None,
    regions: Mapping[str, Sparse] | None = None,
    origin: Float[np.ndarray, "3"] | None = None,
    directions: Float[np.ndarray, "3 local"] | None = None,
) -> ReadableMatrices:
    """Take a scikit-fem model: a basis, and the matrices assembled on it.

    Parameters
    ----------
    basis
        A `skfem.CellBasis`, of any element that `interpolation.scikit_fem` reads.
    stiffness, mass
        Matrices on all its degrees of freedom [N/m, kg and so on].
    axes
        Axes of the components of the field: (3,) for the deflection of a plate, (1, 2, 3) for
        the displacement of a solid.
    fixed
        Degrees of freedom that are held: `basis.get_dofs("left")`, or their numbers.
    regions
        Stiffness of parts of the structure, by name; assembled on
        `skfem.Basis(mesh, element, elements=...)`.
    origin, directions
        Origin and axes of the mesh in space; see `interpolation.scikit_fem`.

    Returns
    -------
    ReadableMatrices
        Matrices and the interpolation of their shapes, the first arguments of `modes`.

    Raises
    ------
    InputError
        If `basis` is no `skfem.CellBasis` or cannot be read between nodes, or the matrices do not
        fit it.
    MissingExtraError
        If scikit-fem is not installed.

    Examples
    --------
    >>> import skfem
    >>> basis = skfem.Basis(skfem.MeshQuad().refined(1), skfem.ElementQuad1())
    >>> stiffness, mass = 1e6 * np.eye(9), np.eye(9)
    >>> model, reading = bp.finite_elements.from_scikit_fem(basis, stiffness, mass, axes=(3,))
    >>> model.modes(count=1).natural_frequency.round(1)
    array([159.2])
    """
    reading = interpolation.scikit_fem(basis, axes=axes, origin=origin, directions=directions)
    nodes = nodes_of_rows(basis, axes, origin, directions)
    fixed_rows = None if fixed is None else np.asarray(fixed)
    matrices = Matrices(
        stiffness, mass, nodes.position, nodes.dof, fixed=fixed_rows, regions=regions
    )
    return ReadableMatrices(matrices, reading)


class NodesOfRows(NamedTuple):
    """Nodes, and the node and direction of each degree of freedom."""

    position: Float[np.ndarray, "node 3"]
    dof: Int[np.ndarray, "dof 2"]


def nodes_of_rows(
    basis: "CellBasis",
    axes: tuple[int, ...],
    origin: Float[np.ndarray, "3"] | None,
    directions: Float[np.ndarray, "3 local"] | None,
) -> NodesOfRows:
    """Nodes where the degrees of freedom of a basis lie, vertices or not.

    A point with several slopes has as many nodes, since a node has each direction once.
    """
    origin = np.zeros(3) if origin is None else origin
    directions = np.eye(3)[:, : basis.mesh.dim()] if directions is None else directions
    position = origin + basis.doflocs.T @ directions.T
    direction = _direction(basis, axes)
    point = _point_number(position)
    key = np.column_stack([point, _repetition(point, direction)])
    _, first, node = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return NodesOfRows(position[first], np.column_stack([node.ravel() + 1, direction]))


def _direction(basis: "CellBasis", axes: tuple[int, ...]) -> Int[np.ndarray, "dof"]:
    dofs = basis.get_dofs(elements=True)
    direction = np.full(basis.N, OTHER)
    for component, axis in enumerate(axes, start=1):
        named = {f"u^{component}", "u"} if len(axes) == 1 else {f"u^{component}"}
        present = named.intersection(basis.elem.dofnames)
        if present:
            direction[dofs.all(sorted(present))] = axis
    return direction


def _point_number(position: Float[np.ndarray, "dof 3"]) -> Int[np.ndarray, "dof"]:
    """Number of the point of each row; points that differ by rounding are one."""
    size = np.ptp(position, axis=0).max()
    return np.unique(np.round(position / size, 10), axis=0, return_inverse=True)[1].ravel()


def _repetition(
    point: Int[np.ndarray, "dof"], direction: Int[np.ndarray, "dof"]
) -> Int[np.ndarray, "dof"]:
    """How many rows of the same point and direction come before each row."""
    key = 8 * point + direction
    order = np.argsort(key, kind="stable")
    beginning = np.searchsorted(key[order], key[order])
    repetition = np.empty(point.size, dtype=np.int64)
    repetition[order] = np.arange(point.size) - beginning
    return repetition
