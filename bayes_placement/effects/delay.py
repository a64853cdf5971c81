"""A delay of all sensor channels against the force, or of one channel against all others."""

import jax.numpy as jnp
from numpyro.distributions import Distribution

from .._shared.ranges import DELAY, log_uniform_of_either_sign
from .instruments import Instruments, Number
from .prelude import Factor, InstrumentEffect, Omega, OnTransducer, Parameter, Scales, field, unit


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


class ChannelDelay(OnTransducer):
    """A delay of one sensor or actuator, a factor exp(-i omega tau) on its FRFs.

    Of multiplexed sampling and of filters that differ: Ewins, Modal Testing (2000), ch. 3.

    Parameters
    ----------
    transducer, side
        Name of the sensor or actuator, and `sensor` or `actuator` where that leaves it open.
    delay
        Delay tau of its FRFs [s].
    direction
        Recorded direction of the only channel that is delayed; None for all of the transducer.

    Examples
    --------
    >>> late = bp.effects.channel_delay("s1", delay=2e-5)
    >>> [effect.name for effect in (experiment + late).effects]
    ['channel_delay']
    """

    changes_modes = False
    absent = ("delay", 0.0)
    transducer: Number
    delay: Parameter = field(metadata=unit("s", within=DELAY))
    name: str = field(static=True, default="channel_delay", kw_only=True)

    def channel_factor(self, omega: Omega, instruments: Instruments) -> Factor:
        """Return exp(-i omega tau) on the delayed channels."""
        return jnp.exp(-1j * omega * (self.affected(instruments) * self.delay))

    @classmethod
    def suggest(cls, scales: Scales) -> list["ChannelDelay"]:
        """As `time_delay`, for each sensor and each actuator where there are others.

        A delay of the only sensor is `time_delay`.
        """
        return [
            cls(name, delay_prior(scales), side=side)
            for side in ("sensor", "actuator")
            for name in scales.instruments.side(side)
            if len(scales.instruments.side(side)) > 1
        ]
