"""A viscous dashpot."""

from typing import ClassVar

import equinox as eqx

from .._sites import unit
from .._types import Parameter
from .law import Element, Omega, Stiffness


class Dashpot(Element):
    """A viscous dashpot, the dynamic stiffness i omega c.

    Parameters
    ----------
    viscosity
        Force per velocity c [N s/m]; of a rotation [N m s/rad].

    Examples
    --------
    >>> complex(bp.effects.Dashpot(40.0).dynamic_stiffness(jnp.array([500.0]))[0])
    20000j
    """

    letter: ClassVar[str] = "c"
    symbols: ClassVar[tuple[str, ...]] = ("c",)
    formula: ClassVar[str] = r"i\omega {0}"
    viscosity: Parameter = eqx.field(metadata=unit("N s/m"))

    def stiffness_at(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness i omega c [N/m]."""
        return 1j * omega * self.viscosity
