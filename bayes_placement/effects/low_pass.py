"""A low-pass filter in one channel, or in those of all sensors."""

import math
from typing import Any

import jax.numpy as jnp

from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .instruments import Instruments, Number
from .prelude import POSITIVE, Factor, LogUniform, Omega, OnTransducer, Scales, field, unit


class LowPass(OnTransducer):
    """A Butterworth low-pass whose effect on the record was not taken out again.

    Its transmission is 1 / (1 + i r), or 1 / (1 - r^2 + sqrt(2) i r), with r = f / frequency.
    FRFs of a sensor are multiplied by it, those of a force divided. McConnell and Varoto, Vibration
    Testing (2008), ch. 5..

    Parameters
    ----------
    transducer
        Name of the sensor or actuator; None for all sensors.
    frequency
        Corner frequency [Hz]; infinite for no filter.
    order
        1 or 2.
    side
        `sensor` or `actuator`; by default it follows from the name.
    direction
        Recorded direction of the only channel that is filtered; None for all of the transducer.

    Examples
    --------
    >>> filtered = experiment + bp.effects.low_pass("s1", frequency=2000.0, order=2)
    >>> [effect.name for effect in filtered.effects]
    ['low_pass']
    """

    absent = ("frequency", math.inf)
    transducer: Number | None
    frequency: Parameter = field(metadata=unit("Hz", within=POSITIVE))
    order: int = field(static=True, default=1)
    name: str = field(static=True, default="low_pass", kw_only=True)

    def __check_init__(self) -> None:
        if self.order not in (1, 2):
            raise InputError(
                f'Effect "{self.name}": order={self.order} was given; 1 or 2 is needed, since '
                "filters of these orders are known here: order=2."
            )

    def channel_factor(self, omega: Omega, instruments: Instruments) -> Factor:
        """Return the transmission on sensors, and its inverse on actuators."""
        inverse = loss_of_order(omega / (2 * jnp.pi * self.frequency), self.order)
        factor = 1 / inverse if self.side == "sensor" else inverse
        return 1 + self.affected(instruments) * (factor - 1)

    @classmethod
    def suggest(cls, scales: Scales) -> list["LowPass"]:
        """All sensors together and each transducer, from the least line to 100 times the last."""
        low, high = scales.band
        sensors, actuators = scales.instruments.sensors, scales.instruments.actuators
        each = [(name, "sensor") for name in sensors if len(sensors) > 1]
        each += [(name, "actuator") for name in actuators]
        return [
            cls(name, LogUniform(low, 100 * high), order, side=side)
            for name, side in [(None, "sensor"), *each]
            for order in (1, 2)
        ]


def loss_of_order(ratio: Any, order: int) -> Any:
    """Inverse of the transmission of a low-pass at frequencies over its corner [1]."""
    return 1 + 1j * ratio if order == 1 else 1 - ratio**2 + math.sqrt(2) * 1j * ratio
