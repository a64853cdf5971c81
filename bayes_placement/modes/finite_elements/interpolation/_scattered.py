"""_scattered: in, nodes without elements; out, weights of the nodes around any place.

Not known here: elements, mode shapes, sensors, probability.
"""

from typing import TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import solve
from jaxtyping import Array, Float, Int
from scipy.spatial import KDTree

from ...._types import InputError
from ._elements import all_exponents, monomials
from ._interpolation import Interpolation, Nodes, Reading, reachable, rows_of, taken

Cloud = TypeVar("Cloud", "Nearest", "Scattered")
_TERMS = all_exponents(3, 2, simplex=True)
_ORDER = np.sum(_TERMS, axis=1)
_TERMS_AT_ORIGIN = (_ORDER == 0).astype(float)
# Relative to moments of order one. It decides only what the nodes around do not: slopes off their
# surface, and curvatures between too few of them. Mixed curvatures count half, so that the sum of
# squares is the same in all coordinate systems.
_RIDGE = np.array([0.0, 1e-9, 1e-4])[_ORDER] * np.where(np.max(_TERMS, axis=1) < _ORDER, 0.5, 1.0)
# Squared share of a radius within which one node outweighs all others.
_CLOSE = 0.01
_RADIUS = 1.5
_REACH = 0.75
_NEIGHBOURS = {1: 4, 2: 8, 3: 18}
"""Neighbours that a node's weight reaches, by the dimension of the cloud of nodes."""


class Nearest(Interpolation):
    """The nearest node in the place of the position: Eqs. (13) and (16) of the paper.

    Piecewise constant: it has no derivative in position.

    Parameters
    ----------
    centre
        Places of the nodes [m].
    """

    axes: tuple[int, ...] = eqx.field(static=True)
    centre: Float[Array, "node 3"]
    rows: Int[Array, "node axis"]

    def at(self, position: Float[Array, "3"]) -> Reading:
        """Rows of the nearest node, each with weight one."""
        rows = taken(self.rows, _nearest(self.centre, position))
        return Reading(rows, jnp.eye(len(self.axes)))

    def closest(self, position: Float[Array, "3"]) -> Float[Array, "3"]:
        """Place of the nearest node [m]."""
        return taken(self.centre, _nearest(self.centre, position))

    def near(self, position: Float[np.ndarray, "place 3"], radius: float) -> "Nearest":
        """Only those nodes that can be the nearest within a radius [m] of places [m]."""
        return _near(self, position, radius)


class Scattered(Interpolation):
    """Moving least squares: at each place the best quadratic through the nodes around it.

    Twice differentiable in position; exact for linear fields (to 1e-6), nearly so for quadratic
    ones and at the nodes. Lancaster and Salkauskas 1981, DOI 10.1090/S0025-5718-1981-0616367-1,
    with compactly supported weights.

    Parameters
    ----------
    centre
        Places of the nodes [m].
    reach
        How far from a node a place is still read; farther away, at that distance [m].
    around
        Places of all nodes whose weight is not zero within reach of a node [m].
    radius
        How far their weights reach [m].
    """

    axes: tuple[int, ...] = eqx.field(static=True)
    centre: Float[Array, "node 3"]
    reach: Float[Array, "node"]
    around: Float[Array, "node neighbour 3"]
    radius: Float[Array, "node neighbour"]
    rows: Int[Array, "node neighbour axis"]

    def at(self, position: Float[Array, "3"]) -> Reading:
        """Rows and weights of the nodes around a place [m]."""
        node = _nearest(self.centre, position)
        apart = taken(self.around, node) - self._within(position, node)
        weight = _least_squares(apart, taken(self.radius, node))
        count = len(self.axes)
        along = (weight[:, None] * np.eye(count)[:, None, :]).reshape(count, -1)
        return Reading(taken(self.rows, node).reshape(-1), along)

    def closest(self, position: Float[Array, "3"]) -> Float[Array, "3"]:
        """The place itself [m], drawn to within the reach of its nearest node."""
        return self._within(position, _nearest(self.centre, position))

    def near(self, position: Float[np.ndarray, "place 3"], radius: float) -> "Scattered":
        """Only those nodes that can be the nearest within a radius [m] of places [m]."""
        return _near(self, position, radius)

    def _within(self, position: Float[Array, "3"], node: Int[Array, ""]) -> Float[Array, "3"]:
        apart, reach = position - taken(self.centre, node), taken(self.reach, node)
        scale = reach / jnp.sqrt(jnp.maximum(jnp.sum(apart**2), reach**2))
        return taken(self.centre, node) + scale * apart


def nearest_node(nodes: Nodes, axes: tuple[int, ...] | None) -> Nearest:
    """The nearest of the nodes that have all the axes."""
    axes, position, rows = _read_nodes(nodes, axes)
    return Nearest(axes, jnp.asarray(position), jnp.asarray(rows))


def scattered_nodes(nodes: Nodes, axes: tuple[int, ...] | None) -> Scattered:
    """Moving least squares over the nodes that have all the axes."""
    axes, position, rows = _read_nodes(nodes, axes)
    tree = KDTree(position)
    radius = _radii(tree)
    reach = _REACH * radius
    found = _neighbours(tree, radius, reach)
    size = max(len(one) for one in found)
    padded = np.array([one + [node] * (size - len(one)) for node, one in enumerate(found)])
    filler = np.arange(size) >= np.array([len(one) for one in found])[:, None]
    around = position[padded]
    around[filler] += (10 * radius[padded[filler]])[:, None]  # out of reach: its weight is zero
    return Scattered(
        axes,
        jnp.asarray(position),
        jnp.asarray(reach),
        jnp.asarray(around),
        jnp.asarray(radius[padded]),
        jnp.asarray(rows[padded]),
    )


def _read_nodes(
    nodes: Nodes, axes: tuple[int, ...] | None
) -> tuple[tuple[int, ...], Float[np.ndarray, "node 3"], Int[np.ndarray, "node axis"]]:
    """Axes, places and rows of the nodes that have all the axes."""
    if axes is None:
        axes = tuple(int(one) for one in np.unique(nodes.dof[:, 1]) if one <= 3)
    if not axes or not set(axes) <= {1, 2, 3}:
        raise InputError(
            f"axes={axes}: the motion is read along at least one of 1, 2, 3 for x, y, z, and the "
            f"degrees of freedom have the directions {np.unique(nodes.dof[:, 1]).tolist()}. "
            "For example axes=(3,)."
        )
    rows = rows_of(nodes, axes)
    whole = (rows >= 0).all(axis=1)
    if not whole.any():
        raise InputError(
            f"No node has degrees of freedom along all of the axes {axes}; a place is read from "
            "nodes that have them all. Name fewer axes: axes=(3,)."
        )
    return tuple(axes), nodes.position[whole], rows[whole]


def _radii(tree: KDTree) -> Float[np.ndarray, "node"]:
    """How far the weight of each node reaches [m], by the distance of its neighbours."""
    spread = np.linalg.svd(tree.data - tree.data.mean(axis=0), compute_uv=False)
    dimension = max(int(np.sum(spread > 1e-6 * max(spread[0], 1e-300))), 1)
    count = min(_NEIGHBOURS[dimension], tree.n - 1)
    distance = tree.query(tree.data, [count + 1])[0][:, 0]
    if tree.n == 1 or not (distance > 0).all():
        raise InputError(
            f"{tree.n} nodes were given, {np.sum(distance == 0)} of them with no other node apart "
            "from them; nodes at several places are needed to read between them. "
            "Take the nearest node: interpolation.nearest(model)."
        )
    return _RADIUS * distance


def _neighbours(
    tree: KDTree, radius: Float[np.ndarray, "node"], reach: Float[np.ndarray, "node"]
) -> list[list[int]]:
    """For each node, all nodes with a weight that is not zero within its reach."""
    wide = tree.query_ball_point(tree.data, reach + radius.max())
    near = []
    for node, some in enumerate(wide):
        distance = np.linalg.norm(tree.data[some] - tree.data[node], axis=1)
        near.append(np.array(some)[distance < reach[node] + radius[some]].tolist())
    return near


def _nearest(centre: Float[Array, "node 3"], position: Float[Array, "3"]) -> Int[Array, ""]:
    return jnp.argmin(jnp.sum((centre - jax.lax.stop_gradient(position)) ** 2, axis=1))


def _near(cloud: Cloud, position: Float[np.ndarray, "place 3"], radius: float) -> Cloud:
    """Those nodes that can be the nearest within a radius of places."""
    centre = np.asarray(cloud.centre)
    kept = np.flatnonzero(reachable(centre, np.zeros(len(centre)), position, radius))
    return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)[kept]), cloud)


def _least_squares(
    apart: Float[Array, "node 3"], radius: Float[Array, "node"]
) -> Float[Array, "node"]:
    """Weight of each node in the value at the origin of the best quadratic."""
    share = jnp.sum(apart**2, axis=1) / radius**2
    bump = jnp.maximum(1 - share, 0.0) ** 3
    scale = jnp.sqrt(jnp.sum(bump * radius**2) / jnp.sum(bump))
    pull = bump / (share + _CLOSE)
    pull = pull / jnp.sum(pull)
    basis = monomials(apart.T[:, :, None] / scale, _TERMS)
    moment = jnp.sum((pull[:, None] * basis)[:, :, None] * basis[:, None, :], axis=0)
    chosen = solve(moment + np.diag(_RIDGE), _TERMS_AT_ORIGIN, assume_a="pos")
    return pull * jnp.sum(basis * chosen, axis=1)
