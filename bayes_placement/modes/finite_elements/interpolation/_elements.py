"""Elements whose shape functions are polynomials: weights at any position, smooth in it."""

import functools
import itertools
import operator
from collections.abc import Iterable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ...._shared.arguments import arguments_checked
from ...._shared.errors import InputError
from ._interpolation import Interpolation, NodalModel, Reading, element_rows, part_at, reachable

Exponents = tuple[tuple[int, ...], ...]
Point = Float[Array, "3"]

HERMITE = np.array([[1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1]], dtype=float)
"""Cubics of value and slope at 0, value and slope at 1: a row each, powers ascending."""

# A position at a node may lie outside of its element by rounding. It is read slightly outside
# rather than clipped: clipping would take its gradient away.
_MARGIN = 1e-6


class Elements(Interpolation):
    """Elements whose shape functions are polynomials in affine local coordinates.

    A position is read in the element that is closest to it, outside of it at its closest point.
    As smooth in position as the elements: C1 for Hermite, BFS and Argyris elements, continuous
    for Lagrange elements.

    Parameters
    ----------
    origin
        Corner of each element, where its local coordinates are 0 [m].
    edges
        Derivatives of the position in the local coordinates [m].
    local
        Derivatives of the local coordinates in the position [1/m].
    kind
        Number of the polynomials of each element.
    coefficients
        Weight of each entry along each axis, a polynomial by its terms.
    exponents
        Powers of the local coordinates in each term.
    simplex
        Whether the cell is a simplex (line, triangle, tetrahedron) or a box of side 1.

    Examples
    --------
    >>> triangles = np.array([[0, 1, 3], [1, 3, 4]])
    >>> bp.finite_elements.interpolation.linear(plane, triangles, axes=(3,)).origin.shape
    (2, 3)
    """

    axes: tuple[int, ...] = eqx.field(static=True)
    origin: Float[Array, "element 3"]
    edges: Float[Array, "element 3 local"]
    local: Float[Array, "element local 3"]
    rows: Int[Array, "element entry"]
    kind: Int[Array, "element"]
    coefficients: Float[Array, "kind term axis entry"]
    exponents: Exponents = eqx.field(static=True)
    simplex: bool = eqx.field(static=True)

    def at(self, position: Point) -> Reading:
        """Rows and weights at a position [m]; outside the structure, those of its closest one."""
        element = self._element(position)
        inside = self._inside(self._coordinates(position, element), _MARGIN)
        term = monomials(inside, self.exponents)
        coefficients = part_at(self.coefficients, part_at(self.kind, element))
        return Reading(
            part_at(self.rows, element), jnp.sum(term[:, None, None] * coefficients, axis=0)
        )

    def closest(self, position: Point) -> Point:
        """Closest position [m] of the structure; in skewed cells, close to it."""
        element = self._element(position)
        inside = self._inside(self._coordinates(position, element), 0.0)
        return part_at(self.origin, element) + part_at(self.edges, element) @ jnp.stack(inside)

    def near(self, position: Float[np.ndarray, "place 3"], radius: float) -> "Elements":
        """Only those elements that can be read within a radius [m] of some positions [m]."""
        corners = reference_corners(self.edges.shape[2], self.simplex)
        corner = np.asarray(self.origin)[:, None] + corners @ np.asarray(self.edges).mT
        centre = corner.mean(axis=1)
        size = np.linalg.norm(corner - centre[:, None], axis=2).max(axis=1)
        nearby = np.flatnonzero(reachable(centre, size, position, radius))
        kinds, kind = np.unique(np.asarray(self.kind)[nearby], return_inverse=True)
        return build_elements(
            self.axes,
            np.asarray(self.origin)[nearby],
            np.asarray(self.edges)[nearby],
            np.asarray(self.rows)[nearby],
            np.asarray(self.coefficients)[kinds],
            self.exponents,
            kind=kind,
            simplex=self.simplex,
        )

    def _element(self, position: Point) -> Int[Array, ""]:
        """Closest element; its number has no derivative."""
        # Component by component, so that the processor takes several elements at once.
        here = jax.lax.stop_gradient(position)
        step = [x - origin for x, origin in zip(here, self.origin.T, strict=True)]
        local = [_dot(row, step) for row in jnp.moveaxis(self.local, 0, 2)]
        inside = self._inside(local, 0.0)
        nearest = [_dot(row, inside) for row in jnp.moveaxis(self.edges, 0, 2)]
        outside = [x - closest for x, closest in zip(step, nearest, strict=True)]
        square = _dot(outside, outside)
        order = jnp.arange(len(square))
        # The first that is as near as any: an argmin takes three times as long.
        return jnp.min(jnp.where(square <= jnp.min(square), order, len(square) - 1))

    def _coordinates(self, position: Point, element: Int[Array, ""]) -> Float[Array, "local"]:
        step = position - part_at(self.origin, element)
        return jnp.sum(part_at(self.local, element) * step, axis=1)

    def _inside(self, local: Iterable[Array], margin: float) -> list[Array]:
        """Local coordinates, each of one or more points, moved into the reference cell."""
        # No jnp.clip: it halves the gradient on the border.
        above = [jnp.where(x < -margin, -margin, x) for x in local]
        if not self.simplex:
            return [jnp.where(x > 1 + margin, 1 + margin, x) for x in above]
        total = functools.reduce(operator.add, above)
        return [x / jnp.where(total > 1 + margin, total, 1.0) for x in above]


def _dot(first: Iterable[Array], second: Iterable[Array]) -> Array:
    return functools.reduce(operator.add, map(operator.mul, first, second))


def build_elements(
    axes: tuple[int, ...],
    origin: Float[np.ndarray, "element 3"],
    edges: Float[np.ndarray, "element 3 local"],
    rows: Int[np.ndarray, "element entry"],
    coefficients: Float[np.ndarray, "kind term axis entry"],
    exponents: Exponents,
    *,
    simplex: bool,
    kind: Int[np.ndarray, "element"] | None = None,
) -> Elements:
    """Elements with their local coordinates; without `kind`, each has its own polynomials."""
    return Elements(
        axes=tuple(axes),
        origin=jax.device_put(origin),
        edges=jax.device_put(edges),
        local=jax.device_put(np.linalg.pinv(edges)),
        rows=jax.device_put(rows),
        kind=jax.device_put(np.arange(len(origin)) if kind is None else kind),
        coefficients=jax.device_put(coefficients),
        exponents=exponents,
        simplex=simplex,
    )


def monomials(
    coordinates: Iterable[Float[Array, "*point"]], exponents: Exponents
) -> Float[Array, "*term"]:
    """Products of powers of coordinates, one for each term."""
    powers = np.array(exponents).T

    def terms(x: Array, power: np.ndarray) -> Array:
        # Each power by itself: x to an array of powers has no second derivative at zero.
        return functools.reduce(operator.add, ((power == n) * x**n for n in range(power.max() + 1)))

    return functools.reduce(operator.mul, map(terms, coordinates, powers))


def all_exponents(dimension: int, degree: int, simplex: bool) -> Exponents:
    """Exponents up to a degree: their sum on a simplex, each of them on a box."""
    powers = itertools.product(range(degree + 1), repeat=dimension)
    return tuple(term for term in powers if not simplex or sum(term) <= degree)


@arguments_checked
def reference_corners(dimension: int, simplex: bool) -> Float[np.ndarray, "corner local"]:
    """Corners of the reference cell.

    Examples
    --------
    >>> bp.finite_elements.interpolation.reference_corners(2, simplex=True)
    array([[0., 0.],
           [0., 1.],
           [1., 0.]])
    """
    return np.array(all_exponents(dimension, 1, simplex), dtype=float)


@arguments_checked
def linear(
    model: NodalModel,
    elements: Int[np.ndarray, "element corner"],
    *,
    axes: tuple[int, ...] = (1, 2, 3),
) -> Elements:
    """Linear shape functions on lines, triangles or tetrahedra between nodes.

    For meshes of which only nodes and corners are known. Continuous, but with kinks: gradients
    in position jump from element to element.

    Parameters
    ----------
    model
        Nodes and degrees of freedom, for example a `ModalModel`.
    elements
        Indices into `model.node` of the two, three or four corners of each element.
    axes
        Axes along which the motion is read, of 1, 2, 3 for x, y, z.

    Returns
    -------
    Elements
        Shapes between nodes along `axes`.

    Raises
    ------
    InputError
        If an index is out of range or a degree of freedom is missing.

    Examples
    --------
    >>> triangles = np.array([[0, 1, 3], [1, 3, 4]])
    >>> np.asarray(bp.finite_elements.interpolation.linear(plane, triangles, axes=(3,)).rows)
    array([[ 2,  5, 11],
           [ 5, 11, 14]])
    """
    count = elements.shape[1]
    if count not in (2, 3, 4):
        raise InputError(
            f"Elements with {count} corners were given; linear shape functions are those of 2, 3 "
            "or 4 corners (lines, triangles, tetrahedra). Split others: "
            "elements[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3) for quadrilaterals."
        )
    if not axes or not set(axes) <= {1, 2, 3}:
        raise InputError(
            f"axes={axes} was given; at least one of 1, 2, 3 for x, y, z is needed, since the "
            "motion is read along them: axes=(3,)."
        )
    rows = element_rows(model, elements, axes)
    position = model.position[elements]
    term = np.hstack([np.eye(count)[:, :1], np.vstack([-np.ones(count - 1), np.eye(count - 1)])])
    coefficients = np.einsum("ct,ab->tacb", term, np.eye(len(axes)))
    exponents = np.vstack([np.zeros(count - 1, dtype=int), np.eye(count - 1, dtype=int)])
    return build_elements(
        axes,
        position[:, 0],
        (position[:, 1:] - position[:, :1]).mT,
        rows,
        coefficients.reshape(1, count, len(axes), -1),
        tuple(tuple(int(power) for power in powers) for powers in exponents),
        simplex=True,
        kind=np.zeros(len(elements), dtype=np.int64),
    )
