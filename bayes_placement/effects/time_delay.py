"""A delay of all sensor channels against the force."""

from collections.abc import Sequence
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from numpyro.distributions import Uniform

from .._sites import unit
from .._types import Parameter, Receptance
from .effect import Omega
from .instrument_effect import InstrumentEffect
from .instruments import Instruments
from .scales import Scales


class TimeDelay(InstrumentEffect):
    """A delay of every sensor channel against the force, a factor exp(-i omega tau).

    Parameters
    ----------
    delay
        Delay tau [s].

    Examples
    --------
    >>> late = experiment + bp.effects.time_delay(dist.Uniform(0.0, 1e-4))
    >>> list(late.unknown)
    ['structure.damping.ratio', 'sensor.s1.position', 'instrument_effects.time_delay.delay']
    """

    changes_modes: ClassVar[bool] = False
    absent: ClassVar[tuple[str, float]] = ("delay", 0.0)
    delay: Parameter = eqx.field(metadata=unit("s"))
    name: str = eqx.field(static=True, default="time_delay", kw_only=True)

    def recorded(self, frf: Receptance, omega: Omega, instruments: Instruments) -> Receptance:
        """FRF times exp(-i omega tau)."""
        return frf * jnp.exp(-1j * omega * self.delay)

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence["TimeDelay"]:
        """Up to half a period at the top of the band, either way."""
        longest = 0.5 / scales.band[1]
        return [cls(Uniform(-longest, longest))]


time_delay = TimeDelay
