"""Elements of networks: spring, lossy spring, springpot, dashpot and mass."""

from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp

from .._shared.dimensions import Parameter
from .._shared.ranges import ORDER, POSITIVE
from .._shared.sites import unit
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
