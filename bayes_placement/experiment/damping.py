"""damping: in, natural and excitation angular frequencies; out, the loss in each modal stiffness.

Not known here: mode shapes, sensors, probability.
"""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float, Inexact

from .._sites import unit
from .._types import InputError, Parameter

Loss = Complex[Array, "mode frequency"]
Natural = Float[Array, "mode"]
Omega = Inexact[Array, "frequency"]


class Damping(eqx.Module):
    """What a damping law adds to omega_n^2 - omega^2 in every mode."""

    @abc.abstractmethod
    def loss(self, natural: Natural, omega: Omega, rigid_body_modes: int) -> Loss:
        """Modal loss [(rad/s)^2] at natural frequencies and frequencies [rad/s]."""

    @abc.abstractmethod
    def static_loss(self, omega: Omega) -> Inexact[Array, "frequency"]:
        """Loss over omega_n^2 [1] in modes far above the frequencies [rad/s]: those left out."""


class Modal(Damping):
    """Viscous modal damping with a ratio for each mode, 2 i ratio omega_n omega.

    Parameters
    ----------
    ratio
        Damping ratios [1] of the elastic modes in order; the last one holds for all further
        modes. One number serves every mode. Rigid-body modes are not damped and not counted.
    """

    ratio: tuple[Parameter, ...] | Parameter = eqx.field(metadata=unit("1"))

    def __init__(self, ratio: list[Parameter] | tuple[Parameter, ...] | Parameter):
        self.ratio = tuple(ratio) if isinstance(ratio, list) else ratio
        if isinstance(ratio, list | tuple) and not ratio:
            raise InputError(
                "damping.Modal got no ratio. At least one is needed, and the last one holds for "
                "all further modes: damping.Modal([0.04])."
            )

    def ratios(self, modes: int, rigid_body_modes: int) -> Float[Array, "mode"]:
        """Damping ratio of each mode [1], rigid-body modes included."""
        given = jnp.atleast_1d(jnp.asarray(self.ratio, dtype=float))
        elastic = jnp.clip(jnp.arange(modes) - rigid_body_modes, 0, given.size - 1)
        return given[elastic]

    def loss(self, natural: Natural, omega: Omega, rigid_body_modes: int) -> Loss:
        """Modal loss 2 i ratio omega_n omega [(rad/s)^2]."""
        ratio = self.ratios(natural.size, rigid_body_modes)
        return 2j * (ratio * natural)[:, None] * omega

    def static_loss(self, omega: Omega) -> Inexact[Array, "frequency"]:
        """None: 2 ratio omega / omega_n vanishes."""
        return jnp.zeros(omega.shape)


class Rayleigh(Damping):
    """Damping proportional to mass and stiffness, i omega (mass + stiffness omega_n^2).

    Parameters
    ----------
    mass
        Share of the mass matrix [1/s].
    stiffness
        Share of the stiffness matrix [s].
    """

    mass: Parameter = eqx.field(metadata=unit("1/s"))
    stiffness: Parameter = eqx.field(metadata=unit("s"))

    def loss(self, natural: Natural, omega: Omega, rigid_body_modes: int) -> Loss:
        """Modal loss i omega (mass + stiffness omega_n^2) [(rad/s)^2]."""
        return 1j * (self.mass + self.stiffness * natural**2)[:, None] * omega

    def static_loss(self, omega: Omega) -> Inexact[Array, "frequency"]:
        """Loss i omega stiffness [1], in any mode."""
        return 1j * self.stiffness * omega


class Structural(Damping):
    """Structural damping, a complex stiffness K (1 + i loss_factor).

    Parameters
    ----------
    loss_factor
        Loss factor [1].
    """

    loss_factor: Parameter = eqx.field(metadata=unit("1"))

    def loss(self, natural: Natural, omega: Omega, rigid_body_modes: int) -> Loss:
        """Modal loss i loss_factor omega_n^2 [(rad/s)^2], conjugate at negative frequencies."""
        return (natural**2)[:, None] * self.static_loss(omega)

    def static_loss(self, omega: Omega) -> Inexact[Array, "frequency"]:
        """Loss i loss_factor [1], in any mode, conjugate at negative frequencies."""
        return 1j * self.loss_factor * jnp.sign(jnp.real(omega))
