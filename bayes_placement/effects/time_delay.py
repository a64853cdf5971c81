"""A delay of all sensor channels against the force."""

import jax.numpy as jnp
from numpyro.distributions import Distribution

from .._shared.ranges import DELAY
from .instrument_effect import Factor, InstrumentEffect
from .prelude import Instruments, Omega, Parameter, Scales, field, log_uniform_of_either_sign, unit


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

    changes_modes = False
    absent = ("delay", 0.0)
    acts_on = "all_channels"
    delay: Parameter = field(metadata=unit("s", within=DELAY))
    name: str = field(static=True, default="time_delay", kw_only=True)

    def channel_factor(self, omega: Omega, instruments: Instruments) -> Factor:
        """Return exp(-i omega tau)."""
        return jnp.exp(-1j * omega * self.delay)[None, None]

    @classmethod
    def suggest(cls, scales: Scales) -> list["TimeDelay"]:
        """Up to half a period at the top of the band, either way: log-uniform from 1e-4 of it."""
        return [cls(delay_prior(scales))]


def delay_prior(scales: Scales) -> Distribution:
    """Prior of a delay [s] that a channel may have against another one."""
    longest = 0.5 / scales.band[1]
    return log_uniform_of_either_sign(1e-4 * longest, -longest, longest)
