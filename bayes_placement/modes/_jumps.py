"""_jumps: in, a uniform line and cuts; out, the static shapes of unit jumps there, and their mass.

Not known here: what opens the cuts, damping, data. A jump of order q is conjugate to the internal
force that is the q-th derivative of the shape: axial force of a bar (1), bending moment (2) and
shear force (3) of a beam.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._types import Parameter
from .beams.uniform_line import UniformLine
from .changed import bent_shapes
from .modes import Modes

_HAIR = 1e-12  # of the length

Square = Float[Array, "jump jump"]


class Jumps(NamedTuple):
    """Cuts [m], and the order of the internal force at each, those of one order side by side."""

    places: Float[Array, "jump"]
    orders: tuple[int, ...]

    def by_order(self) -> list[tuple[int, Float[Array, "some"]]]:
        """Places of each order."""
        several = np.array(self.orders)
        return [(int(order), self.places[several == order]) for order in np.unique(several)]


def jumps(line: UniformLine, places: Sequence[Parameter], orders: Sequence[int]) -> Jumps:
    """Cut a line; a cut at an end lies between the structure and its support."""
    at = jnp.stack([jnp.asarray(place, dtype=float) for place in places])
    # A hair outwards: the structure is all on its inner side.
    hair = _HAIR * line.length
    outside = jnp.where(at < hair, -hair, line.length + hair)
    return Jumps(jnp.where((at < hair) | (at > line.length - hair), outside, at), tuple(orders))


def shapes(
    line: UniformLine, cuts: Jumps, position: Float[Array, ""], derivative: int = 0
) -> Float[Array, "jump"]:
    """Static shape of each unit jump, by reciprocity the internal force under a unit force.

    Deflection or slope right of the cut less that left of it is 1.
    """
    found = [
        _sign(line, order)
        * jax.vmap(lambda at, order=order: line.green(position, at, (derivative, order)))(places)
        for order, places in cuts.by_order()
    ]
    return jnp.concatenate(found)


def mass(line: UniformLine, cuts: Jumps) -> Square:
    """Mass inner products of the shapes of jumps."""
    return line.density * line.area * _pairs(line, cuts, 2)


def stress(line: UniformLine, cuts: Jumps) -> Square:
    """Internal force at each cut that resists a unit jump at each.

    It is zero where the structure is statically determinate.
    """
    return -line.stiffness * _pairs(line, cuts, 1)


def _pairs(line: UniformLine, cuts: Jumps, power: int) -> Square:
    def block(one: tuple[int, Any], other: tuple[int, Any]) -> Any:
        orders = (one[0], other[0])
        sign = _sign(line, one[0]) * _sign(line, other[0])
        green = jax.vmap(lambda y, x: line.green(x, y, orders, power), in_axes=(0, None))
        return sign * jax.vmap(green, in_axes=(None, 0))(other[1], one[1])

    rows = [
        jnp.concatenate([block(one, other) for other in cuts.by_order()], axis=1)
        for one in cuts.by_order()
    ]
    return jnp.concatenate(rows)


def participation(modes: Modes, line: UniformLine, cuts: Jumps) -> Float[Array, "elastic jump"]:
    """Mass inner product of each elastic mode with the shape of each jump.

    The internal force in the mode over omega_n^2.
    """
    elastic = slice(modes.rigid_body_modes, None)
    forces = [
        _sign(line, order)
        * line.stiffness
        * jax.vmap(lambda at, order=order: bent_shapes(modes, at, order))(places)[:, elastic]
        for order, places in cuts.by_order()
    ]
    return jnp.concatenate(forces).T / modes.angular_frequency()[elastic, None] ** 2


def _sign(line: UniformLine, order: int) -> int:
    return (-1) ** (order - line.half_order)
