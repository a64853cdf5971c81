"""Models of scikit-fem: shape functions of its basis, and the matrices assembled on it."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import ArrayLike

from ...._shared.arguments import arguments_checked
from ...._shared.errors import InputError, MissingExtraError
from ..matrices import Matrices, Sparse
from ._elements import Elements, all_exponents, build_elements, reference_corners
from ._interpolation import Interpolation

if TYPE_CHECKING:
    from skfem import CellBasis


Points = Float[np.ndarray, "point local"]

_BOXES = {"RefLine": False, "RefQuad": False, "RefHex": False, "RefTri": True, "RefTet": True}
_REMEDY = "read the nodes alone: interpolation.scattered(model)."


@arguments_checked
def scikit_fem(
    basis: Any,
    *,
    axes: tuple[int, ...],
    origin: Float[np.ndarray, "3"] | None = None,
    directions: Float[np.ndarray, "3 local"] | None = None,
) -> Elements:
    """Shape functions of a scikit-fem basis; rows are its degrees of freedom.

    Any element with polynomial shape functions on cells mapped affinely: Lagrange elements,
    `ElementVector` of them, Morley, Argyris, Hermite and BFS elements.

    Parameters
    ----------
    basis
        A `skfem.CellBasis`.
    axes
        Axes of the components of the field: (3,) for the deflection of a plate, (1, 2, 3) for
        the displacement of a solid.
    origin
        Position of the origin of the mesh in space [m]; by default (0, 0, 0).
    directions
        Unit vectors of the coordinates of the mesh, as columns; by default the first axes of
        space, so that the mesh of a plate lies at z = 0.

    Returns
    -------
    Elements
        Shapes between nodes along `axes`.

    Raises
    ------
    InputError
        If `basis` is no `skfem.CellBasis`, a cell is curved or not affine, a shape function is no
        polynomial, or the field has another number of components than `axes`.
    MissingExtraError
        If scikit-fem is not installed.

    Examples
    --------
    >>> import skfem
    >>> basis = skfem.Basis(skfem.MeshQuad().refined(1), skfem.ElementQuad1())
    >>> bp.finite_elements.interpolation.scikit_fem(basis, axes=(3,)).rows.shape
    (4, 4)
    """
    _check_basis(basis)
    simplex = _simplex(basis)
    corner, edges = _cells(basis, simplex)
    origin = np.zeros(3) if origin is None else origin
    directions = np.eye(3)[:, : basis.mesh.dim()] if directions is None else directions
    exponents = all_exponents(basis.mesh.dim(), _degree(basis.elem, simplex), simplex)
    uniform = _same_everywhere(basis.elem)
    coefficients = _coefficients(basis, exponents, uniform, simplex)
    _check_components(coefficients, axes)
    return build_elements(
        axes,
        origin + corner @ directions.T,
        directions @ edges,
        np.asarray(basis.element_dofs.T, dtype=np.int64),
        coefficients,
        exponents,
        simplex=simplex,
        kind=np.zeros(len(corner), dtype=np.int64) if uniform else None,
    )


def _check_basis(basis: object) -> None:
    try:
        from skfem import CellBasis
    except ImportError as error:
        raise MissingExtraError(
            "interpolation.scikit_fem was called, but scikit-fem is not installed; it knows how "
            'shape functions are mapped. pip install "bayes_placement[scikit-fem]"'
        ) from error
    if not isinstance(basis, CellBasis):
        raise InputError(
            f"A {type(basis).__name__} was given; a skfem.CellBasis is needed, which has shape "
            "functions within cells: interpolation.scikit_fem(skfem.Basis(mesh, element), ...)."
        )


def _simplex(basis: "CellBasis") -> bool:
    name = basis.elem.refdom.__name__
    if name not in _BOXES:
        raise InputError(
            f"A basis on the cell {name} was given; lines, triangles, quadrilaterals, tetrahedra "
            f"and hexahedra can be read. For other cells {_REMEDY}"
        )
    return _BOXES[name]


def _cells(
    basis: "CellBasis", simplex: bool
) -> tuple[Float[np.ndarray, "element local"], Float[np.ndarray, "element local local"]]:
    """Corner and edges of each cell, in the coordinates of the mesh [m]."""
    dimension = basis.mesh.dim()
    lattice = np.array(all_exponents(dimension, 2, simplex)) / 2
    # The order of axes of scikit-fem: coordinate, element, point.
    position = np.moveaxis(basis.mapping.F(lattice.T, tind=_all(basis)), 0, -1)
    ends = np.vstack([np.zeros(dimension), np.eye(dimension)])
    at_ends = np.moveaxis(basis.mapping.F(ends.T, tind=_all(basis)), 0, -1)
    corner, edges = at_ends[:, 0], (at_ends[:, 1:] - at_ends[:, :1]).mT
    deviation = np.abs(position - corner[:, None] - lattice @ edges.mT).max(axis=(1, 2))
    worst = int(np.argmax(deviation / np.abs(edges).max(axis=(1, 2))))
    if deviation[worst] > 1e-9 * np.abs(edges[worst]).max():
        raise InputError(
            f"Cell {worst} of the mesh is curved or no parallelogram: its map from the reference "
            "cell is not affine, so that its shape functions are no polynomials of the position. "
            f"Use straight triangles or tetrahedra (mesh.to_meshtri()), or {_REMEDY}"
        )
    return corner, edges


def _all(basis: "CellBasis") -> np.ndarray:
    return np.arange(basis.mesh.nelements) if basis.tind is None else basis.tind


def _degree(element: Any, simplex: bool) -> int:
    """Greatest power of the shape functions: of all coordinates on a simplex, of each on a box."""
    if simplex:
        return element.maxdeg
    if getattr(element, "tensorial_basis", False):
        return element.maxdeg // 2  # scikit-fem states twice the degree, also in three dimensions
    return -(-element.maxdeg // element.refdom.dim())


def _same_everywhere(element: object) -> bool:
    """Tell whether all cells have the same shape functions in reference coordinates."""
    from skfem.element import ElementVector
    from skfem.element.element_h1 import ElementH1

    inner = element.elem if isinstance(element, ElementVector) else element
    return isinstance(inner, ElementH1)


def _coefficients(
    basis: "CellBasis", exponents: tuple[tuple[int, ...], ...], uniform: bool, simplex: bool
) -> Float[np.ndarray, "kind term axis entry"]:
    """Polynomials through the values at as many points as there are terms."""
    powers = np.array(exponents)
    lattice = powers / max(powers.max(), 1)
    cells = _all(basis)[:1] if uniform else _all(basis)
    values = _values(basis, lattice, cells)
    coefficients = np.einsum("tp,epai->etai", np.linalg.inv(_terms(lattice, powers)), values)
    check = lattice / 2 + reference_corners(powers.shape[1], simplex).mean(axis=0) / 3
    polynomial = np.einsum("pt,etai->epai", _terms(check, powers), coefficients)
    if np.abs(polynomial - _values(basis, check, cells)).max() > 1e-6 * np.abs(values).max():
        raise InputError(
            f"The shape functions of {type(basis.elem).__name__} are no polynomials of the degree "
            f"that it states, {basis.elem.maxdeg}; a polynomial is needed to read them at any "
            f"position. Use a Lagrange, Morley, Argyris, BFS or Hermite element, or {_REMEDY}"
        )
    return coefficients


def _terms(point: Points, powers: np.ndarray) -> Float[np.ndarray, "point term"]:
    return np.prod(point[:, None, :] ** powers, axis=2)


def _values(
    basis: "CellBasis", point: Points, cells: np.ndarray
) -> Float[np.ndarray, "element point axis entry"]:
    """Shape functions of cells at points of the reference cell."""
    functions = [
        basis.elem.gbasis(basis.mapping, point.T, number, tind=cells)
        for number in range(basis.Nbfun)
    ]
    if len(functions[0]) > 1:
        raise InputError(
            f"A basis of {type(basis.elem).__name__} was given, which has {len(functions[0])} "
            "fields; one field of displacements is needed. Use the basis of one of its parts, or "
            "ElementVector for a vector field."
        )
    values = np.stack([np.asarray(function[0]) for function in functions], axis=-1)
    if values.ndim == 3:
        return values[:, :, None, :]
    return np.moveaxis(values, 0, 2)


def _check_components(
    coefficients: Float[np.ndarray, "kind term axis entry"], axes: tuple[int, ...]
) -> None:
    if coefficients.shape[2] != len(axes):
        raise InputError(
            f"axes={axes} was given, but the basis has a field of {coefficients.shape[2]} "
            "components; each needs its axis of 1, 2, 3 for x, y, z: axes=(3,) for the deflection "
            "of a plate, axes=(1, 2, 3) for a solid."
        )


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
    reading = scikit_fem(basis, axes=axes, origin=origin, directions=directions)
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
    direction = _directions_of(basis, axes)
    point = _point_number(position)
    key = np.column_stack([point, _repetition(point, direction)])
    _, first, node = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return NodesOfRows(position[first], np.column_stack([node.ravel() + 1, direction]))


def _directions_of(basis: "CellBasis", axes: tuple[int, ...]) -> Int[np.ndarray, "dof"]:
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
