"""A spring that loses the same share of its energy at every frequency."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from .._sites import unit
from .._types import Parameter
from .law import Element, Omega, Stiffness


class LossySpring(Element):
    """A spring with a loss factor, the dynamic stiffness k (1 + i eta sign omega).

    Parameters
    ----------
    stiffness
        Stiffness k [N/m]; of a rotation [N m/rad].
    loss_factor
        Loss factor eta [1].

    Examples
    --------
    >>> complex(bp.effects.LossySpring(1e4, 0.25).dynamic_stiffness(jnp.array([-3.0]))[0])
    (10000-2500j)
    """

    letter: ClassVar[str] = "h"
    symbols: ClassVar[tuple[str, ...]] = ("k", "eta")
    formula: ClassVar[str] = r"{0} (1 + i {1})"
    stiffness: Parameter = eqx.field(metadata=unit("N/m"))
    loss_factor: Parameter = eqx.field(metadata=unit("1"))

    def stiffness_at(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness k (1 + i eta sign omega) [N/m]."""
        return self.stiffness * (1 + 1j * self.loss_factor * jnp.sign(jnp.real(omega)))
