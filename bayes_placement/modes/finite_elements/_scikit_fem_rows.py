"""_scikit_fem_rows: in, a basis of scikit-fem; out, the node and the direction of each of its rows.

Not known here: matrices, shape functions, probability.
"""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float, Int

OTHER = 7
"""Direction of a slope, a twist or the like: it takes no part in a translation."""


class Rows(NamedTuple):
    """Nodes and degrees of freedom."""

    position: Float[np.ndarray, "node 3"]
    dof: Int[np.ndarray, "dof 2"]


def table(
    basis: Any,
    axes: tuple[int, ...],
    origin: Float[np.ndarray, "3"] | None,
    directions: Float[np.ndarray, "3 local"] | None,
) -> Rows:
    """Nodes where the degrees of freedom of a basis lie, vertices or not.

    A place with several slopes has as many nodes, since a node has each direction once.
    """
    origin = np.zeros(3) if origin is None else origin
    directions = np.eye(3)[:, : basis.mesh.dim()] if directions is None else directions
    position = origin + basis.doflocs.T @ directions.T
    direction = _direction(basis, axes)
    key = np.column_stack([_place(position), _copy(_place(position), direction)])
    _, first, node = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return Rows(position[first], np.column_stack([node.ravel() + 1, direction]))


def _direction(basis: Any, axes: tuple[int, ...]) -> Int[np.ndarray, "dof"]:
    every = basis.get_dofs(elements=True)
    found = np.full(basis.N, OTHER)
    for component, axis in enumerate(axes, start=1):
        named = {f"u^{component}", "u"} if len(axes) == 1 else {f"u^{component}"}
        known = named.intersection(basis.elem.dofnames)
        if known:
            found[every.all(sorted(known))] = axis
    return found


def _place(position: Float[np.ndarray, "dof 3"]) -> Int[np.ndarray, "dof"]:
    """Number of the place of each row; places that differ by rounding are one."""
    size = np.ptp(position, axis=0).max()
    return np.unique(np.round(position / size, 10), axis=0, return_inverse=True)[1].ravel()


def _copy(
    place: Int[np.ndarray, "dof"], direction: Int[np.ndarray, "dof"]
) -> Int[np.ndarray, "dof"]:
    """How many rows of the same place and direction came before each row."""
    key = 8 * place + direction
    order = np.argsort(key, kind="stable")
    beginning = np.searchsorted(key[order], key[order])
    found = np.empty(place.size, dtype=np.int64)
    found[order] = np.arange(place.size) - beginning
    return found
