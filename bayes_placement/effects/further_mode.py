"""A mode in the band that the model of the structure cannot have."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex
from numpyro.distributions import Normal

from .._shared.dimensions import Parameter
from .._shared.ranges import POSITIVE, SHARE_OF_CRITICAL
from .._shared.sites import unit
from .prelude import OF_CHANNELS, InstrumentEffect, Instruments, LogUniform, Omega, Scales, field
from .residual_modes import check_one_each


class FurtherMode(InstrumentEffect):
    """A mode that the model cannot have, such as torsion beside bending, or of what it stands on.

    Its receptance is r / (w0^2 - w^2 + 2 i z w0 w), with a residue r for each sensor and actuator
    channel: the product of its mass-normalised shape at both (Ewins, Modal Testing, section 2.4).
    Nothing is assumed of the shape.

    Parameters
    ----------
    residue
        Residue of each sensor and actuator channel, [sensor, actuator] [1/kg].
    frequency
        Natural frequency w0 / (2 pi) [Hz].
    damping_ratio
        Damping ratio z [1].

    Examples
    --------
    >>> twisting = bp.effects.further_mode(np.array([[0.2]]), frequency=430.0, damping_ratio=0.01)
    >>> [effect.name for effect in (experiment + twisting).effects]
    ['further_mode']
    """

    acts_on = "structure"
    changes_modes = False
    tried_last = True
    may_be_new = False
    may_coincide = True
    absent = ("residue", 0.0)
    residue: Parameter = field(metadata=unit("1/kg") | {OF_CHANNELS: True})
    frequency: Parameter = field(metadata=unit("Hz", within=POSITIVE))
    damping_ratio: Parameter = field(metadata=unit("1", within=SHARE_OF_CRITICAL))
    name: str = field(static=True, default="further_mode", kw_only=True)

    def numbered(self, instruments: Instruments) -> "FurtherMode":
        """Return the effect as it is."""
        check_one_each(self.name, "residue", self.residue, instruments)
        return self

    def added(self, omega: Omega) -> Complex[Array, "#sensor #actuator #frequency"]:
        """Receptance that it adds [m/N]."""
        natural = 2 * jnp.pi * self.frequency
        oscillator = 1 / (natural**2 - omega**2 + 2j * self.damping_ratio * natural * omega)
        return jnp.atleast_2d(jnp.asarray(self.residue))[..., None] * oscillator

    def remark(self, estimates: Mapping[str, tuple[float, float]]) -> str:
        """Say what may have such a mode."""
        return "as of torsion or of what it stands on"

    @classmethod
    def suggest(cls, scales: Scales) -> list["FurtherMode"]:
        """Anywhere in the band; residues as of a mode in which a tenth of the structure moves.

        None without phases, where residues are not found one by one.
        """
        if not scales.phase_observed:
            return []
        shape = tuple(len(scales.instruments.channels(side)) for side in ("sensor", "actuator"))
        residue = Normal(np.zeros(shape), 10 / scales.mass).to_event(2)
        return [cls(residue, LogUniform(*scales.band), LogUniform(0.001, 0.1))]
