"""frf: in, a structure without distributions and an angular frequency; out, receptance [m/N].

Not known here: probability, decibels, where the sensors were recorded.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float, Inexact

from ._types import Receptance
from .structure import Structure


def receptance(
    structure: Structure,
    sensors: Float[Array, "sensor mode"],
    actuators: Float[Array, "actuator mode"],
    omega: Inexact[Array, "frequency"],
) -> Receptance:
    r"""Receptance between points whose mode shapes are given, Eqs. (6), (7) and (18).

    Parameters
    ----------
    structure
        Structure whose parameters are numbers.
    sensors, actuators
        Mass-normalised mode shapes [kg^-1/2] read by each sensor and driven by each actuator
        channel, the rows of [O][Phi] and of ([Phi]^T [C])^T.
    omega
        Angular frequency [rad/s], time convention exp(+i omega t).

    Returns
    -------
    Complex[Array, "sensor actuator frequency"]
        sum over modes of phi_s phi_a / (omega_n^2 - omega^2 + loss) [m/N].
    """
    natural = structure.modes.angular_frequency()
    loss = structure.damping.loss(natural, omega, structure.modes.rigid_body_modes)
    modal = 1 / ((natural**2)[:, None] - omega**2 + loss)
    return _modal_sum(sensors[:, None, :] * actuators[None, :, :], modal)


def _modal_sum(
    residues: Float[Array, "sensor actuator mode"], modal: Inexact[Array, "mode frequency"]
) -> Receptance:
    # Two real products cost half of one complex product with a real factor.
    return residues @ jnp.real(modal) + 1j * (residues @ jnp.imag(modal))
