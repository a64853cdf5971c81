"""What reads a shape, known at nodes, at any position; common to all kinds of elements."""

import abc
from typing import NamedTuple, Protocol, TypeVar, runtime_checkable

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Shaped
from scipy.spatial import KDTree

from ...._shared import precision  # noqa: F401  double precision, before the first array is made
from ...._shared.errors import InputError
from ...._shared.reprs import with_short_repr

Point = Float[Array, "3"]
Corners = Int[np.ndarray, "element corner"]

Self = TypeVar("Self", bound="Interpolation")


@runtime_checkable
class NodalModel(Protocol):
    """What has nodes: a `ModalModel`, `Matrices`, or anything with these three arrays.

    Examples
    --------
    >>> isinstance(plane, bp.finite_elements.interpolation.NodalModel)
    True
    """

    @property
    def node(self) -> Int[np.ndarray, "node"]:
        """Node numbers."""

    @property
    def position(self) -> Float[np.ndarray, "node 3"]:
        """Positions of the nodes [m]."""

    @property
    def dof(self) -> Int[np.ndarray, "dof 2"]:
        """Node number and direction (1 to 6 for x, y, z, rx, ry, rz; 7 for w_xy) of each row."""


@with_short_repr
class Reading(NamedTuple):
    """How the shapes at one position follow from those at the degrees of freedom.

    A shape at the position is ``weight @ shape[rows]``: Eq. (12) of the paper for elements,
    Eq. (13) for the nearest node.

    Parameters
    ----------
    rows
        Rows of the table of degrees of freedom.
    weight
        Weight of each of them, along each of the axes [1, or m at rotations, m2 at twists].

    Examples
    --------
    >>> nearest = bp.finite_elements.interpolation.nearest(plane, axes=(3,))
    >>> np.asarray(nearest.at(jnp.array([0.45, 0.1, 0.0])).weight)
    array([[1.]])
    """

    rows: Int[Array, "entry"]
    weight: Float[Array, "axis entry"]


@with_short_repr
class Interpolation(eqx.Module):
    """Reads shapes given at degrees of freedom at any position of the structure.

    Parameters
    ----------
    axes
        Axes along which the motion is read, of 1, 2, 3 for x, y, z.
    rows
        Rows of the table of degrees of freedom, of each part of the structure.

    Examples
    --------
    >>> isinstance(across, bp.finite_elements.interpolation.Interpolation), across.axes
    (True, (3,))
    """

    axes: eqx.AbstractVar[tuple[int, ...]]
    rows: eqx.AbstractVar[Int[Array, "part *entry"]]

    @abc.abstractmethod
    def at(self, position: Point) -> Reading:
        """Rows and weights at a position [m]; outside the structure, those of its closest one."""

    @abc.abstractmethod
    def closest(self, position: Point) -> Point:
        """Closest position [m] at which the structure can be read."""

    @abc.abstractmethod
    def near(self: Self, position: Float[np.ndarray, "place 3"], radius: float) -> Self:
        """Only those parts that can be read within a radius [m] of some positions [m].

        It reads the same there, and costs less on a large model.
        """

    def used_rows(self) -> Int[np.ndarray, "row"]:
        """All rows that it reads, ascending."""
        return np.unique(np.asarray(self.rows))

    def renumbered(self: Self, rows: Int[np.ndarray, "row"]) -> Self:
        """Return the same for a table of which only some rows are kept, ascending.

        Raises
        ------
        InputError
            If a row that it reads is not kept.
        """
        missing = np.setdiff1d(self.used_rows(), rows)
        if len(missing):
            raise InputError(
                f"{len(rows)} rows were kept, but the interpolation reads {len(missing)} others, "
                f"among them row {missing[0]}. Keep all that it reads: interpolation.used_rows()."
            )
        numbers = jnp.asarray(np.searchsorted(rows, np.asarray(self.rows)))
        return eqx.tree_at(lambda interpolation: interpolation.rows, self, numbers)


def rows_of(model: NodalModel, directions: tuple[int, ...]) -> Int[np.ndarray, "node direction"]:
    """Row of each node and direction; -1 where it has none."""
    order = np.argsort(model.node)
    index = order[np.searchsorted(model.node[order], model.dof[:, 0])]
    table = np.full((len(model.node), 8), -1)
    table[index, model.dof[:, 1]] = np.arange(len(model.dof))
    return table[:, np.array(directions)]


def element_rows(
    model: NodalModel, elements: Corners, directions: tuple[int, ...]
) -> Int[np.ndarray, "element entry"]:
    """Rows of the corners of elements, corner by corner."""
    count = len(model.node)
    if len(elements) == 0 or elements.min() < 0 or elements.max() >= count:
        entries = f" with entries {elements.min()} to {elements.max()}" if len(elements) else ""
        raise InputError(
            f"elements of shape {elements.shape} was given{entries}; the corners of at least one "
            f"element are needed, as indices 0 to {count - 1} into `node`. Indices of node "
            "numbers: np.argsort(node)[np.searchsorted(np.sort(node), elements)]."
        )
    rows = rows_of(model, directions)[elements]
    if (rows < 0).any():
        element, corner, direction = np.argwhere(rows < 0)[0]
        raise InputError(
            f"Node {model.node[elements[element, corner]]} has no degree of freedom in direction "
            f"{directions[direction]}, but its element has shape functions of the directions "
            f"{directions} at each node. Give each of them a row, of zeros where it is held, or "
            "read the nodes alone: interpolation.scattered(model)."
        )
    return rows.reshape(len(elements), -1)


def reachable(
    centre: Float[np.ndarray, "part 3"],
    size: Float[np.ndarray, "part"],
    position: Float[np.ndarray, "place 3"],
    radius: float,
) -> Bool[np.ndarray, "part"]:
    """Parts, each within a ball, that may be closest to a point near some positions."""
    tree, largest, reach = KDTree(centre), size.max(), np.zeros(len(centre), dtype=bool)
    bound = 2 * radius + tree.query(position)[0] + 2 * largest
    for point, parts in zip(position, tree.query_ball_point(position, bound), strict=True):
        distance = np.linalg.norm(centre[parts] - point, axis=1)
        limit = 2 * radius + np.min(distance + size[parts])
        reach[parts] |= distance - size[parts] <= limit
    return reach


def part_at(array: Shaped[Array, "part *rest"], index: Int[Array, ""]) -> Shaped[Array, "*rest"]:
    """One part of an array, by an index that is in range, without the code that checks it."""
    return array.at[index].get(mode="promise_in_bounds", wrap_negative_indices=False)
