"""Ports of a structure: linear functionals of its displacement, and the mode shapes there.

A port is read, and by reciprocity driven, through the same functional: the displacement along a
direction at a place, a derivative of it (the slope of a beam), or a combination of such readings
(the difference of two places, the displacement beside the axis of a beam). The internal force at a
cut is a derivative as well, times the stiffness of the section.
"""

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from .modes import Coordinates, Flexibility, Modes, Orders

Between = Float[Array, "port other"] | None
Places = Float[Array, "place *coordinate"]
Others = Float[Array, "other *coordinate"]
OfOrders = Callable[[Orders], Callable[[Coordinates, Coordinates], Flexibility]]


class Points(eqx.Module):
    """Points where a structure is read, driven or held, each along one direction."""

    position: Float[Array, "point *coordinate"]
    """Positions [m]."""
    direction: Float[Array | np.ndarray, "point axis"]
    """Unit vectors, in the axes of the structure [1]; of a cut, times the stiffness of the
    section."""
    shape_error: Float[Array, "point erroneous"] | None = None
    """What is added to the shapes of the first modes there [kg^-1/2]; None where they are exact."""
    orders: tuple[int, ...] | None = eqx.field(static=True, default=None)
    """Order of the derivative in position that is read at each point: 0 displacement, of a beam 1
    slope, 2 bending moment and 3 shear force over its stiffness. None where all are 0."""
    combination: Float[Array, "port point"] | None = None
    """Weights of the points in each port; None where every point is a port."""
    widths: Float[Array, "point"] | None = None
    """Length about each point over which a static internal force is its mean [m], zero for that at
    the point: it jumps where an instrument sits. None where all are zero."""

    @property
    def count(self) -> int:
        """Number of ports."""
        return len(self.position if self.combination is None else self.combination)

    def shapes(self, modes: Modes) -> Float[Array, "port mode"]:
        """Mass-normalised mode shapes [kg^-1/2] along the directions."""
        return self.with_error(self.exact_shapes(modes))

    def exact_shapes(self, modes: Modes) -> Float[Array, "port mode"]:
        """Mass-normalised mode shapes [kg^-1/2] of the model, without error."""
        read = [
            jnp.einsum("pa,pam->pm", self.direction[rows], _shapes(modes, order)(places))
            for order, rows, places in self._by_order()
        ]
        return self._combined(self._in_order(read))

    def with_error(self, exact: Float[Array, "port mode"]) -> Float[Array, "port mode"]:
        """Shapes with their error added."""
        if self.shape_error is None:
            return exact
        return exact.at[:, : self.shape_error.shape[1]].add(self.shape_error)

    def static_flexibility(self, modes: Modes, other: "Points") -> Between:
        """Static flexibility [m/N] between these and other points; None if not known."""
        return self._between(other, lambda orders: _flexibility(modes, orders))

    def second_flexibility_left_out(self, modes: Modes, other: "Points") -> Between:
        """Sum over the modes left out of phi phi / omega_n^4 [m s2/N]; None but of derivatives."""
        if self.orders is None or other.orders is None:
            return None
        second = modes.second_flexibility_left_out
        return self._between(other, lambda orders: lambda at, to: second(at, to, orders))

    def flexibility_left_out(self, modes: Modes, other: "Points") -> Float[Array, "port other"]:
        """Static flexibility [m/N] of the modes left out; zero where it is not known."""
        static = self.static_flexibility(modes, other)
        if static is None:
            return jnp.zeros((self.count, other.count))
        elastic = slice(modes.rigid_body_modes, None)
        scaled = self.exact_shapes(modes)[:, elastic] / modes.angular_frequency()[elastic] ** 2
        return static - scaled @ other.exact_shapes(modes)[:, elastic].T

    def _between(self, other: "Points", flexibility: OfOrders) -> Between:
        """Matrix between two lists of ports from a function of two places, order by order."""
        rows = []
        for order, these, places in self._by_order():
            row = []
            for other_order, those, other_places in other._by_order():
                orders = order, other_order
                block = _block(flexibility, orders, places, other_places)
                if block is None:
                    return None
                if other.widths is not None and order < other_order:
                    block = _means(flexibility, orders, places, other_places, other.widths[those])
                elif self.widths is not None and order > other_order:
                    turned = orders[::-1], other_places, places, self.widths[these]
                    block = _means(flexibility, *turned).transpose(1, 0, 3, 2)
                directions = self.direction[these], other.direction[those]
                row.append(jnp.einsum("pa,poab,ob->po", directions[0], block, directions[1]).T)
            rows.append(other._combined(other._in_order(row)).T)
        return self._combined(self._in_order(rows))

    def _by_order(self) -> list[tuple[int, slice | Int[np.ndarray, "place"], Places]]:
        """Order of derivatives, and the points of which it is read."""
        if self.orders is None:
            return [(0, slice(None), self.position)]
        orders = np.array(self.orders)
        rows = [(int(order), np.flatnonzero(orders == order)) for order in np.unique(orders)]
        return [(order, row, self.position[row]) for order, row in rows]

    def _in_order(
        self, blocks: list[Float[Array, "of_order column"]]
    ) -> Float[Array, "point column"]:
        """Rows of all orders as the points are listed."""
        if self.orders is None:
            return blocks[0]
        return jnp.concatenate(blocks)[np.argsort(np.argsort(self.orders, kind="stable"))]

    def _combined(self, read: Float[Array, "point column"]) -> Float[Array, "port column"]:
        return read if self.combination is None else self.combination @ read


def _shapes(modes: Modes, order: int) -> Callable[[Places], Float[Array, "place axis mode"]]:
    return jax.vmap(modes.shapes if order == 0 else lambda place: modes.shapes(place, order))


def _block(flexibility: OfOrders, orders: Orders, places: Places, others: Others) -> Any:
    """Matrix between two lists of places [place, other, axis, axis]; None if not known."""
    over_others = jax.vmap(flexibility(orders), in_axes=(None, 0))
    return jax.vmap(over_others, in_axes=(0, None))(places, others)


def _means(
    flexibility: OfOrders, orders: Orders, places: Places, others: Others, widths: Others
) -> Float[Array, "place other axis axis"]:
    """The same with means over a width about the other places, where that is not zero."""
    about = jnp.where(widths > 0, widths, 1.0)
    lower = orders[0], orders[1] - 1
    ends = [_block(flexibility, lower, places, others + side * about / 2) for side in (1, -1)]
    means = (ends[0] - ends[1]) / about[:, None, None]
    at_place = _block(flexibility, orders, places, others)
    return jnp.where((widths > 0)[:, None, None], means, at_place)


def _flexibility(modes: Modes, orders: Orders) -> Callable[[Coordinates, Coordinates], Flexibility]:
    if orders == (0, 0):  # which alone all modes know
        return modes.static_flexibility
    return lambda place, other: modes.static_flexibility(place, other, orders)


def joined(groups: Sequence[Points]) -> Points:
    """Return all points in one list."""
    # Known directions become one constant, which needs no compilation.
    known = all(isinstance(points.direction, np.ndarray) for points in groups)
    concatenate = np.concatenate if known else jnp.concatenate
    widths = [points.shape_error.shape[1] for points in groups if points.shape_error is not None]
    errors = _of_each(groups, "shape_error", lambda points: jnp.zeros((points.count, widths[0])))
    orders = _of_each(groups, "orders", lambda points: (0,) * len(points.position))
    combinations = _of_each(groups, "combination", lambda points: np.eye(points.count))
    lengths = _of_each(groups, "widths", lambda points: jnp.zeros(len(points.position)))
    return Points(
        jnp.concatenate([points.position for points in groups]),
        concatenate([points.direction for points in groups]),
        None if errors is None else jnp.concatenate(errors),
        None if orders is None else tuple(itertools.chain(*orders)),
        None if combinations is None else jax.scipy.linalg.block_diag(*combinations),
        None if lengths is None else jnp.concatenate(lengths),
    )


def _of_each(
    groups: Sequence[Points], field: str, plain: Callable[[Points], object]
) -> list[Any] | None:
    """A field of all points, what it means where some have none; None where all have none."""
    values = [getattr(points, field) for points in groups]
    if all(value is None for value in values):
        return None
    pairs = zip(groups, values, strict=True)
    return [plain(points) if value is None else value for points, value in pairs]


def along_axes(position: Coordinates, modes: Modes) -> Points:
    """Return one position, once along each axis of the structure."""
    count = len(modes.axes)
    repeated = jnp.broadcast_to(position, (count, *jnp.shape(position)))
    return Points(repeated, np.eye(count))


def along(position: Coordinates, direction: Sequence[object] | None, modes: Modes) -> Points:
    """Return one position along one direction, or once along each axis where there is none."""
    if direction is None:
        return along_axes(position, modes)
    vector = jnp.stack([jnp.asarray(component, float) for component in direction])
    unit = (vector / jnp.linalg.norm(vector))[np.array(modes.axes) - 1]
    return Points(position[None], unit[None])
