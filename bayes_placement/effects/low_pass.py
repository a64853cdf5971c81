"""A low-pass filter in one channel, or in those of all sensors."""

import math
from typing import Any

from .._shared.dimensions import Parameter
from .butterworth import Butterworth, loss_of_order
from .instruments import Number
from .prelude import POSITIVE, LogUniform, field, unit


class LowPass(Butterworth):
    """A Butterworth low-pass whose effect on the record was not taken out again.

    Its transmission is 1 / (1 + i r), or 1 / (1 - r^2 + sqrt(2) i r), with r = f / frequency.
    FRFs of a sensor are multiplied by it, those of a force divided. McConnell and Varoto, Vibration
    Testing (2008), ch. 5.

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

    def loss(self, lines: Any) -> Any:
        """Inverse of the transmission at lines [Hz]."""
        return loss_of_order(lines / self.frequency, self.order)

    @classmethod
    def corners(cls, band: tuple[float, float]) -> LogUniform:
        """From the least line to 100 times the last."""
        return LogUniform(band[0], 100 * band[1])
