"""Ports of a structure, and what hangs on them."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Inexact

from ..modes.points import Points


class PortLaw(NamedTuple):
    """Ports, and the dynamic stiffness N / D on each of them.

    As a pair, so that a strength of zero is N = 0 and changes nothing, bit for bit, and a pole,
    D = 0, holds the port.

    Parameters
    ----------
    points
        The ports.
    numerator, denominator
        N and D at each line, the same of all ports or of each one; of a displacement N / D is in
        N/m, of a rotation in N m/rad, of a cut less its compliance.
    """

    points: Points
    numerator: Inexact[Array, "*port frequency"]
    denominator: Any = 1.0

    def of_each(self) -> tuple[Inexact[Array, "port frequency"], Inexact[Array, "port frequency"]]:
        """Numerator and denominator of each port, at each line."""
        shape = (self.points.count, jnp.shape(self.numerator)[-1])
        parts = (self.numerator, self.denominator)
        numerator, denominator = (jnp.broadcast_to(jnp.asarray(part), shape) for part in parts)
        return numerator, denominator
