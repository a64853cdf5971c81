"""Reading of shapes at nodes without elements: nearest node, moving least squares."""

from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from scipy.spatial import KDTree

from ...._shared.arguments import arguments_checked
from ...._shared.errors import InputError
from ._elements import all_exponents, monomials
from ._interpolation import Interpolation, NodalModel, Reading, part_at, reachable, rows_of

Terms = Float[Array, "term"]
Moments = Float[Array, "term term"]
Point = Float[Array, "3"]

Cloud = TypeVar("Cloud", bound="_Nodes")
_TERMS = all_exponents(3, 2, simplex=True)
_ORDER = np.sum(_TERMS, axis=1)
_TERMS_AT_ORIGIN = (_ORDER == 0).astype(float)
# Relative to moments of order one. It decides only what the nodes do not: slopes off their
# surface, and curvatures between too few of them. Mixed curvatures count half, so that the sum of
# squares is the same in all coordinate systems.
_RIDGE = np.array([0.0, 1e-9, 1e-4])[_ORDER] * np.where(np.max(_TERMS, axis=1) < _ORDER, 0.5, 1.0)
# Squared share of a radius within which the nearest node outweighs all others.
_CLOSE = 0.01
_RADIUS = 1.5
_REACH = 0.75
_NEIGHBOURS = {1: 4, 2: 8, 3: 18}
"""Neighbours that a node's weight reaches, by the dimension of the cloud of nodes."""

_BLOCK = 1024
"""Nodes whose neighbours are looked for together: lists of numbers take five times as much memory
as arrays do."""


class _Nodes(Interpolation):
    """Nodes without elements; a position is read at, or around, the nearest one."""

    centre: eqx.AbstractVar[Float[Array, "node 3"]]

    def near(self: Cloud, position: Float[np.ndarray, "place 3"], radius: float) -> Cloud:
        """Only those nodes that can be nearest within a radius [m] of some positions [m]."""
        centre = np.asarray(self.centre)
        nearby = np.flatnonzero(reachable(centre, np.zeros(len(centre)), position, radius))
        return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)[nearby]), self)

    def nearest(self, position: Point) -> Int[Array, ""]:
        """Number of the nearest node."""
        # Axis by axis: of many nodes the compiler takes ten times as long for sums of rows.
        at = jax.lax.stop_gradient(position)
        x, y, z = (self.centre[:, axis] - at[axis] for axis in range(3))
        square = x**2 + y**2 + z**2
        # The first that is as near as any: the compiler takes three times as long for an argmin.
        order = jnp.arange(len(square))
        return jnp.min(jnp.where(square <= jnp.min(square), order, len(square) - 1))


class Nearest(_Nodes):
    """Reads the node nearest to a position: Eqs. (13) and (16) of the paper.

    Piecewise constant: it has no derivative in position.

    Parameters
    ----------
    centre
        Positions of the nodes [m].

    Examples
    --------
    >>> nearest = bp.finite_elements.interpolation.nearest(plane, axes=(3,))
    >>> np.asarray(nearest.at(jnp.array([0.45, 0.1, 0.0])).rows)  # z of the second node
    array([5])
    """

    axes: tuple[int, ...] = eqx.field(static=True)
    centre: Float[Array, "node 3"]
    rows: Int[Array, "node axis"]

    def at(self, position: Point) -> Reading:
        """Rows of the nearest node, each with weight one."""
        rows = part_at(self.rows, self.nearest(position))
        return Reading(rows, jnp.eye(len(self.axes)))

    def closest(self, position: Point) -> Point:
        """Position of the nearest node [m]."""
        return part_at(self.centre, self.nearest(position))


class Scattered(_Nodes):
    """Moving least squares: at each position the best quadratic through the nodes around it.

    Twice differentiable in position; exact for linear fields (to 1e-6), approximately so for
    quadratic ones and at the nodes. Lancaster and Salkauskas 1981, DOI
    10.1090/S0025-5718-1981-0616367-1, with compactly supported weights.

    Parameters
    ----------
    centre
        Positions of the nodes [m].
    reach
        Distance from a node up to which positions are read; farther ones are read there [m].
    around
        Positions of all nodes whose weight is not zero within reach of a node [m].
    radius
        Radius beyond which their weights are zero [m].

    Examples
    --------
    >>> across.centre.shape, across.axes
    ((9, 3), (3,))
    """

    axes: tuple[int, ...] = eqx.field(static=True)
    centre: Float[Array, "node 3"]
    reach: Float[Array, "node"]
    around: Float[Array, "node neighbour 3"]
    radius: Float[Array, "node neighbour"]
    rows: Int[Array, "node neighbour axis"]

    def at(self, position: Point) -> Reading:
        """Rows and weights of the nodes around a position [m]."""
        node = self.nearest(position)
        step = part_at(self.around, node) - self._within(position, node)
        weight = _least_squares(step, part_at(self.radius, node))
        count = len(self.axes)
        along = (weight[:, None] * np.eye(count)[:, None, :]).reshape(count, -1)
        return Reading(part_at(self.rows, node).reshape(-1), along)

    def closest(self, position: Point) -> Point:
        """The position itself [m], moved to within the reach of its nearest node."""
        return self._within(position, self.nearest(position))

    def _within(self, position: Point, node: Int[Array, ""]) -> Point:
        step, reach = position - part_at(self.centre, node), part_at(self.reach, node)
        scale = reach / jnp.sqrt(jnp.maximum(jnp.sum(step**2), reach**2))
        return part_at(self.centre, node) + scale * step


@arguments_checked
def nearest(model: NodalModel, *, axes: tuple[int, ...] | None = None) -> Nearest:
    """Read the node nearest to a position, Eqs. (13) and (16) of the paper.

    Needs only nodes; piecewise constant in position, so that it has no gradient.

    Parameters
    ----------
    model
        Nodes and degrees of freedom, for example a `ModalModel`.
    axes
        Axes along which the motion is read; nodes that lack one of them are not read. By
        default all translations that any node has.

    Raises
    ------
    InputError
        If no node has all the axes.

    Examples
    --------
    >>> nearest = bp.finite_elements.interpolation.nearest(plane, axes=(3,))
    >>> nearest.centre.shape, nearest.axes
    ((9, 3), (3,))
    """
    axes, position, rows = _read_nodes(model, axes)
    return Nearest(axes, jnp.asarray(position), jnp.asarray(rows))


@arguments_checked
def scattered(model: NodalModel, *, axes: tuple[int, ...] | None = None) -> Scattered:
    """Nodes without elements: moving least squares, smooth in position.

    Exact for fields that are linear in position. Nodes whose distance to each other is large
    against the wavelength of a mode smooth it out.

    Parameters
    ----------
    model
        Nodes and degrees of freedom, for example a `ModalModel` from a universal file.
    axes
        Axes along which the motion is read; nodes that lack one of them are not read. By
        default all translations that any node has.

    Raises
    ------
    InputError
        If no node has all the axes, or all nodes lie at one position.

    Examples
    --------
    >>> across = bp.finite_elements.interpolation.scattered(plane, axes=(3,))
    >>> across.axes, across.rows.shape[0]
    ((3,), 9)
    """
    axes, position, rows = _read_nodes(model, axes)
    tree = KDTree(position)
    radius = _radii(tree)
    reach = _REACH * radius
    padded, filler = _padded(_neighbours(tree, radius, reach))
    out_of_reach = np.where(filler, 10 * radius[padded], 0.0)  # so that their weight is zero
    return Scattered(
        axes,
        jnp.asarray(position),
        jnp.asarray(reach),
        jnp.asarray(position[padded] + out_of_reach[..., None]),
        jnp.asarray(radius[padded]),
        jnp.asarray(rows[padded]),
    )


def _read_nodes(
    model: NodalModel, axes: tuple[int, ...] | None
) -> tuple[tuple[int, ...], Float[np.ndarray, "node 3"], Int[np.ndarray, "node axis"]]:
    """Axes, positions and rows of the nodes that have all the axes."""
    if axes is None:
        axes = tuple(int(axis) for axis in np.unique(model.dof[:, 1]) if axis <= 3)
    if not axes or not set(axes) <= {1, 2, 3} or len(set(axes)) < len(axes):
        raise InputError(
            f"axes={axes}: the motion is read along at least one of 1, 2, 3 for x, y, z, and the "
            f"degrees of freedom have the directions {np.unique(model.dof[:, 1]).tolist()}. "
            "For example axes=(3,)."
        )
    rows = rows_of(model, axes)
    complete = (rows >= 0).all(axis=1)
    if not complete.any():
        raise InputError(
            f"No node has degrees of freedom along all of the axes {axes}; a position is read from "
            "nodes that have them all. Name fewer axes: axes=(3,)."
        )
    return tuple(axes), model.position[complete], rows[complete]


def _radii(tree: KDTree) -> Float[np.ndarray, "node"]:
    """Radius beyond which the weight of each node is zero [m], by the distance of neighbours."""
    spread = np.linalg.svd(tree.data - tree.data.mean(axis=0), compute_uv=False)
    dimension = max(int(np.sum(spread > 1e-6 * max(spread[0], 1e-300))), 1)
    count = min(_NEIGHBOURS[dimension], tree.n - 1)
    distance = tree.query(tree.data, [count + 1])[0][:, 0]
    if tree.n == 1 or not (distance > 0).all():
        raise InputError(
            f"{tree.n} nodes were given, {np.sum(distance == 0)} of them with all others at the "
            "same position; nodes at several positions are needed to read between them. "
            "Take the nearest node: interpolation.nearest(model)."
        )
    return _RADIUS * distance


def _neighbours(
    tree: KDTree, radius: Float[np.ndarray, "node"], reach: Float[np.ndarray, "node"]
) -> list[Int[np.ndarray, "neighbour"]]:
    """For each node, all nodes with a weight that is not zero within its reach."""
    near = []
    for nodes in np.array_split(np.arange(tree.n), -(-tree.n // _BLOCK)):
        wide = tree.query_ball_point(tree.data[nodes], reach[nodes] + radius.max())
        for node, candidates in zip(nodes, map(np.array, wide), strict=True):
            distance = np.linalg.norm(tree.data[candidates] - tree.data[node], axis=1)
            near.append(candidates[distance < reach[node] + radius[candidates]])
    return near


def _padded(
    neighbours: list[Int[np.ndarray, "_"]],
) -> tuple[Int[np.ndarray, "node neighbour"], Bool[np.ndarray, "node neighbour"]]:
    """As many neighbours of each node, filled up with the node itself; and which are filled up."""
    count = np.array([len(near) for near in neighbours])
    filler = np.arange(count.max()) >= count[:, None]
    padded = np.repeat(np.arange(len(count))[:, None], count.max(), axis=1)
    padded[~filler] = np.concatenate(neighbours)
    return padded, filler


def _least_squares(
    step: Float[Array, "node 3"], radius: Float[Array, "node"]
) -> Float[Array, "node"]:
    """Weight of each node in the value at the origin of the best quadratic."""
    share = jnp.sum(step**2, axis=1) / radius**2
    bump = jnp.maximum(1 - share, 0.0) ** 3
    scale = jnp.sqrt(jnp.sum(bump * radius**2) / jnp.sum(bump))
    weight = bump / (share + _CLOSE)
    weight = weight / jnp.sum(weight)
    basis = monomials(step.T[:, :, None] / scale, _TERMS)
    moment = jnp.sum((weight[:, None] * basis)[:, :, None] * basis[:, None, :], axis=0)
    value_at_origin = _solution(moment + np.diag(_RIDGE), _TERMS_AT_ORIGIN)
    return weight * jnp.sum(basis * value_at_origin, axis=1)


def _solution(matrix: Moments, right: Float[np.ndarray, "term"]) -> Terms:
    """Solution of positive definite equations.

    Its derivative is a solution too: that of the elimination takes twice as long.
    """
    return jax.lax.custom_linear_solve(  # type: ignore[no-any-return]
        lambda solution: matrix @ solution,
        jnp.asarray(right),
        lambda _, right: _eliminated(matrix, right),
        symmetric=True,
    )


def _eliminated(matrix: Moments, right: Terms) -> Terms:
    """Solution by elimination without pivots.

    Not by LAPACK, whose calls for a batch of each of several transducers can wait for each other
    forever, see `_shared.precision`.
    """
    rows = jnp.concatenate([matrix, right[:, None]], axis=1)
    for pivot in range(len(right)):
        row = rows[pivot] / rows[pivot, pivot]
        rows = (rows - rows[:, pivot, None] * row).at[pivot].set(row)
    return rows[:, -1]
