"""A delay of one sensor or actuator against all others."""

import jax.numpy as jnp

from .._shared.dimensions import Parameter
from .prelude import DELAY, Factor, Instruments, Number, Omega, OnTransducer, Scales, field, unit
from .time_delay import delay_prior


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
