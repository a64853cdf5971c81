"""time_delay: in, a delay; out, the FRF as it was recorded.

Not known here: the structure, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from numpyro.distributions import Uniform

from .._sites import unit
from .._types import Parameter, Receptance
from ..positions.channel import Channel
from . import _scales
from ._effect import InstrumentEffect, Omega


class TimeDelay(InstrumentEffect):
    """A delay of every sensor channel against the force, a factor exp(-i omega tau).

    Parameters
    ----------
    delay
        Delay tau [s].
    """

    absent: ClassVar[tuple[str, float]] = ("delay", 0.0)
    delay: Parameter = eqx.field(metadata=unit("s"))
    name: str = eqx.field(static=True, default="time_delay", kw_only=True)

    def recorded(self, frf: Receptance, omega: Omega, channels: Sequence[Channel]) -> Receptance:
        """FRF times exp(-i omega tau)."""
        return frf * jnp.exp(-1j * omega * self.delay)

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["TimeDelay"]:
        """Up to half a period at the top of the band, either way."""
        longest = 0.5 / _scales.band(experiment)[1]
        return [cls(Uniform(-longest, longest))]


time_delay = TimeDelay
