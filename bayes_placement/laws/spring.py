"""A spring."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from .._sites import unit
from .._types import Parameter
from .law import Element, Omega, Stiffness


class Spring(Element):
    """A spring, the dynamic stiffness k at every frequency.

    Parameters
    ----------
    stiffness
        Stiffness k [N/m]; of a rotation [N m/rad].

    Examples
    --------
    >>> bp.effects.Spring(dist.LogUniform(1e3, 1e6))
    Spring(LogUniform(1000, 1e+06))
    """

    letter: ClassVar[str] = "k"
    symbols: ClassVar[tuple[str, ...]] = ("k",)
    formula: ClassVar[str] = r"{0}"
    stiffness: Parameter = eqx.field(metadata=unit("N/m"))

    def stiffness_at(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness k [N/m]."""
        return jnp.broadcast_to(jnp.asarray(self.stiffness, float), omega.shape)
