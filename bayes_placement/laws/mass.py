"""A mass."""

from typing import ClassVar

import equinox as eqx

from .._sites import unit
from .._types import Parameter
from .law import Element, Omega, Stiffness


class Mass(Element):
    """A mass, the dynamic stiffness -omega^2 m; in series it is the end of the chain.

    Parameters
    ----------
    mass
        Mass m [kg]; of a rotation its moment of inertia [kg m2]. Negative if removed.

    Examples
    --------
    >>> float(bp.effects.Mass(0.1).dynamic_stiffness(jnp.array([100.0]))[0])
    -1000.0
    """

    letter: ClassVar[str] = "m"
    symbols: ClassVar[tuple[str, ...]] = ("m",)
    formula: ClassVar[str] = r"-\omega^2 {0}"
    mass: Parameter = eqx.field(metadata=unit("kg"))

    def stiffness_at(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness -omega^2 m [N/m]."""
        return -(omega**2) * self.mass
