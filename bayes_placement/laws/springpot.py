"""A springpot, between a spring and a dashpot."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from .._ranges import ORDER, POSITIVE
from .._sites import unit
from .._types import Parameter
from .law import Element, Omega, Stiffness


class Springpot(Element):
    """A springpot, the dynamic stiffness k (i omega / omega_0)^order: rubber, soil, glue.

    Bagley and Torvik, AIAA Journal 21 (1983) 741, DOI 10.2514/3.8142.

    Parameters
    ----------
    stiffness
        Magnitude k of the dynamic stiffness at the reference frequency [N/m].
    order
        Order from 0, a spring, to 1, a dashpot [1].
    frequency
        Reference frequency omega_0 / (2 pi) [Hz].

    Examples
    --------
    >>> rubber = bp.effects.Springpot(1e4, order=0.5, frequency=50.0)
    >>> complex(rubber.dynamic_stiffness(jnp.array([2 * np.pi * 50.0]))[0] / 1e4)
    (0.7071067811865476+0.7071067811865475j)
    """

    letter: ClassVar[str] = "p"
    symbols: ClassVar[tuple[str, ...]] = ("k", "alpha", "f")
    formula: ClassVar[str] = r"{0} \left(\frac{{i\omega}}{{2\pi {2}}}\right)^{{{1}}}"
    stiffness: Parameter = eqx.field(metadata=unit("N/m"))
    order: Parameter = eqx.field(metadata=unit("1", within=ORDER))
    frequency: Parameter = eqx.field(metadata=unit("Hz", within=POSITIVE), default=1.0)

    def stiffness_at(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness k (i omega / omega_0)^order [N/m]."""
        ratio = 1j * omega / (2 * jnp.pi * jnp.asarray(self.frequency))
        # The principal branch is conjugate at -omega; at rest the derivative in order is finite.
        logarithm = jnp.log(jnp.where(ratio == 0, 1e-300, ratio))
        return self.stiffness * jnp.exp(self.order * logarithm)
