"""Timoshenko's beam in the place of Euler's and Bernoulli's."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from ..modes.beams import UniformBeam
from ..modes.changed import ChangedModes, changed, over_changed_modes
from .axial_preload import OfBeam
from .prelude import POSITIVE, LogUniform, Modes, Parameter, Scales, field, unit


class ShearAndRotaryInertia(OfBeam):
    """Timoshenko's beam in the place of Euler's and Bernoulli's.

    Cowper, J. Appl. Mech. 33 (1966) 335. A ratio E / (k G) of Young's modulus and shear modulus
    times shear coefficient is 3.1 for a rectangular section of Poisson's ratio 0.3.

    Parameters
    ----------
    modulus_ratio
        E / (k G) [1].
    share
        1 for the beam of Timoshenko, 0 for that of Euler and Bernoulli.

    Examples
    --------
    >>> sizes = {"length": 1.0, "area": 1e-4, "second_moment": 1e-9}
    >>> beam = bp.beams.beam(3, **sizes, youngs_modulus=7e10, density=2700.0, ends="clamped-free")
    >>> thick = bp.Structure(beam, damping=bp.damping.Modal(0.01))
    >>> thick + bp.effects.shear_and_rotary_inertia(modulus_ratio=3.12)
    Structure: UniformBeam, Modal damping, with shear_and_rotary_inertia
    """

    absent = ("share", 0.0)
    of_a_bar = "which moves along its axis and neither shears nor rotates"
    instead = "Assemble the model with elements that shear."
    in_every_structure = True
    may_be_new = False
    modulus_ratio: Parameter = field(metadata=unit("1", within=POSITIVE), default=3.12)
    share: Parameter = field(metadata=unit("1"), default=1.0)
    name: str = field(static=True, default="shear_and_rotary_inertia", kw_only=True)

    def changed(self, modes: Modes) -> ChangedModes:
        """Modes with the flexibility of shear and the inertia of rotation.

        Sections rotate by the bending part of the slope, without shear. Natural frequencies are
        then those of Timoshenko's equation but for terms of the order (k r)^6, k the wave number
        and r the radius of gyration.
        """
        beam = self.beam(modes)
        square = self.share * beam.stiffness / beam.youngs_modulus / beam.area  # gyration [m2]
        shear = over_changed_modes(modes, beam.shear_matrix())
        force = square * self.modulus_ratio * beam.stiffness * shear
        bent = _bent(modes, force)
        rotation = bent.T @ over_changed_modes(modes, beam.slope_matrix()) @ bent
        softening = -force @ bent
        rotary = square * beam.density * beam.area * rotation
        return changed(modes, (softening + softening.T) / 2, rotary, bent)

    @classmethod
    def suggest(cls, scales: Scales) -> list["ShearAndRotaryInertia"]:
        """Modulus ratios of common sections and Poisson's ratios; none for a bar."""
        if not isinstance(scales.modes, UniformBeam):
            return []
        return [cls(LogUniform(2.0, 6.0))]


def _bent(modes: Modes, force: Float[Array, "mode mode"]) -> Float[Array, "mode mode"]:
    """Bending in a motion, (1 + L^-1 P)^-1: flexibility L^-1 grows by L^-1 P L^-1 with shear."""
    rigid = modes.rigid_body_modes
    over_squares = jnp.concatenate([jnp.zeros(rigid), 1 / modes.angular_frequency()[rigid:] ** 2])
    return jnp.linalg.inv(jnp.eye(over_squares.size) + over_squares[:, None] * force)
