"""A stinger that holds the structure where an exciter drives it."""

import jax.numpy as jnp

from .._shared.ranges import POSITIVE, SHARE_OF_CRITICAL
from .prelude import InstrumentEffect, LogUniform, Omega, Parameter, Scales, Stiffness, field, unit


class Stinger(InstrumentEffect):
    """Spring, dashpot and mass between an exciter at rest and the point of drive.

    The structure feels k + i omega c - omega^2 m there, as of a stinger and the armature of a
    shaker whose force is not measured at the structure; each exciter is mounted in its own runs
    only. Varoto and de Oliveira, Sound and Vibration 36, October 2002, 20.

    Parameters
    ----------
    stiffness
        Stiffness k [N/m].
    frequency, damping_ratio
        Of the mass on the spring, sqrt(k / m) / (2 pi) [Hz] and c / (2 sqrt(k m)) [1].

    Examples
    --------
    >>> shaker = bp.effects.stinger(stiffness=1e4, frequency=300.0, damping_ratio=0.1)
    >>> shaker.load("actuator", 0, jnp.array([0.0]))  # N/m at rest
    Array([10000.+0.j], dtype=complex128)
    """

    changes_modes = False
    absent = ("stiffness", 0.0)
    loads = ("actuator",)
    stiffness: Parameter = field(metadata=unit("N/m"))
    frequency: Parameter = field(metadata=unit("Hz", within=POSITIVE))
    damping_ratio: Parameter = field(metadata=unit("1", within=SHARE_OF_CRITICAL))
    name: str = field(static=True, default="stinger", kw_only=True)

    def load(self, side: str, number: int, omega: Omega) -> Stiffness:
        """Dynamic stiffness k + i omega c - omega^2 m [N/m], the same for every exciter."""
        ratio = omega / (2 * jnp.pi * jnp.asarray(self.frequency))
        return self.stiffness * (1 + 2j * self.damping_ratio * ratio - ratio**2)

    @classmethod
    def suggest(cls, scales: Scales) -> list["Stinger"]:
        """A spring of 1e-5 to 10 times the modal stiffness, resonant in the band or above.

        Below the band it would act as its mass alone, which is `actuator_mass`.
        """
        if not scales.exciters_may_be_mounted:
            return []
        stiffness = LogUniform(1e-5 * scales.stiffness, 10 * scales.stiffness)
        frequency = LogUniform(scales.middle, 10 * scales.band[1])
        return [cls(stiffness, frequency, LogUniform(0.003, 0.5))]
