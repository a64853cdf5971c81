"""Constraint modes of cuts of a uniform waveguide, and their mass and stiffness.

They are the static shapes of unit relative displacements of both sides of a cut. That of order q is
conjugate to the internal force that is the q-th derivative of the shape: axial force of a bar (1),
bending moment (2) and shear force (3) of a beam.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._shared.dimensions import Parameter
from .beams.waveguide import Waveguide
from .changed import bending_shapes
from .modes import Modes

_ROUNDING = 1e-12  # of the length

Square = Float[Array, "cut cut"]
OfOrder = tuple[int, Float[Array, "_of_order"]]


class Cuts(NamedTuple):
    """Positions of cuts [m], and the order of the internal force at each, in ascending order."""

    positions: Float[Array, "cut"]
    orders: tuple[int, ...]

    def by_order(self) -> list[OfOrder]:
        """Positions of each order."""
        orders = np.array(self.orders)
        return [(int(order), self.positions[orders == order]) for order in np.unique(orders)]


def cut(waveguide: Waveguide, positions: Sequence[Parameter], orders: Sequence[int]) -> Cuts:
    """Cut a waveguide; a cut at an end lies between the structure and its support."""
    at = jnp.stack([jnp.asarray(position, dtype=float) for position in positions])
    # Just outside of an end, so that all of the structure is on the inner side.
    margin = _ROUNDING * waveguide.length
    outside = jnp.where(at < margin, -margin, waveguide.length + margin)
    at_end = (at < margin) | (at > waveguide.length - margin)
    return Cuts(jnp.where(at_end, outside, at), tuple(orders))


def shapes(
    waveguide: Waveguide, cuts: Cuts, position: Float[Array, ""], derivative: int = 0
) -> Float[Array, "cut"]:
    """Constraint mode of each cut, by reciprocity the internal force under a unit force.

    Deflection or slope right of the cut less that left of it is 1.
    """
    of_orders = [
        _sign(waveguide, order)
        * jax.vmap(lambda at, order=order: waveguide.green(position, at, (derivative, order)))(
            positions
        )
        for order, positions in cuts.by_order()
    ]
    return jnp.concatenate(of_orders)


def mass(waveguide: Waveguide, cuts: Cuts) -> Square:
    """Mass products of the constraint modes."""
    return waveguide.density * waveguide.area * _green_matrix(waveguide, cuts, 2)


def stiffness(waveguide: Waveguide, cuts: Cuts) -> Square:
    """Internal force at each cut that resists a unit relative displacement at each.

    It is zero where the structure is statically determinate.
    """
    return -waveguide.stiffness * _green_matrix(waveguide, cuts, 1)


def _green_matrix(waveguide: Waveguide, cuts: Cuts, power: int) -> Square:
    """Green's function between all cuts, differentiated by their orders."""

    def block(row: OfOrder, column: OfOrder) -> Float[Array, "cut other"]:
        orders = (row[0], column[0])
        sign = _sign(waveguide, row[0]) * _sign(waveguide, column[0])
        green = jax.vmap(lambda y, x: waveguide.green(x, y, orders, power), in_axes=(0, None))
        return sign * jax.vmap(green, in_axes=(None, 0))(column[1], row[1])

    rows = [
        jnp.concatenate([block(row, column) for column in cuts.by_order()], axis=1)
        for row in cuts.by_order()
    ]
    return jnp.concatenate(rows)


def participation(modes: Modes, waveguide: Waveguide, cuts: Cuts) -> Float[Array, "elastic cut"]:
    """Mass product of each elastic mode with each constraint mode.

    The internal force in the mode over omega_n^2.
    """
    elastic = slice(modes.rigid_body_modes, None)
    forces = [
        _sign(waveguide, order)
        * waveguide.stiffness
        * jax.vmap(lambda at, order=order: bending_shapes(modes, at, order))(positions)[:, elastic]
        for order, positions in cuts.by_order()
    ]
    return jnp.concatenate(forces).T / modes.angular_frequency()[elastic, None] ** 2


def _sign(waveguide: Waveguide, order: int) -> int:
    return (-1) ** (order - waveguide.half_order)
