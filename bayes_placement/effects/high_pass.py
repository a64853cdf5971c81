"""A high-pass filter in one channel, or in those of all sensors: coupling by a capacitor."""

from typing import Any

from .._shared.dimensions import Parameter
from .butterworth import Butterworth, loss_of_order
from .instruments import Number
from .prelude import NOT_NEGATIVE, LogUniform, field, unit


class HighPass(Butterworth):
    """A Butterworth high-pass: AC coupling, or a charge amplifier that discharges too soon.

    Its transmission is 1 / (1 - i / r), or 1 / (1 - 1 / r^2 - sqrt(2) i / r), with
    r = f / frequency. FRFs of a sensor are multiplied by it, those of a force divided. McConnell
    and Varoto, Vibration Testing (2008), ch. 5.

    Parameters
    ----------
    transducer
        Name of the sensor or actuator; None for all sensors.
    frequency
        Corner frequency [Hz]; 0 for no filter.
    order
        1 or 2.
    side
        `sensor` or `actuator`; by default it follows from the name.
    direction
        Recorded direction of the only channel that is filtered; None for all of the transducer.

    Examples
    --------
    >>> filtered = experiment + bp.effects.high_pass("s1", frequency=5.0, order=2)
    >>> [effect.name for effect in filtered.effects]
    ['high_pass']
    """

    absent = ("frequency", 0.0)
    transducer: Number | None
    frequency: Parameter = field(metadata=unit("Hz", within=NOT_NEGATIVE))
    order: int = field(static=True, default=1)
    name: str = field(static=True, default="high_pass", kw_only=True)

    def loss(self, lines: Any) -> Any:
        """Inverse of the transmission at lines [Hz]: that of a low-pass at -1 / r."""
        return loss_of_order(-self.frequency / lines, self.order)

    @classmethod
    def corners(cls, band: tuple[float, float]) -> LogUniform:
        """From a hundredth of the least line to the last."""
        return LogUniform(band[0] / 100, band[1])
