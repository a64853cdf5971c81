"""A sensor, an actuator or a single channel whose axis points the other way."""

from .on_transducer import OnTransducer, on_each_channel
from .prelude import Factor, Instruments, Number, OfSide, Omega, Parameter, Scales, field, unit


class ReversedSensor(OfSide):
    """A sensor of reversed polarity, a factor 1 - 2 share on its channels.

    Parameters
    ----------
    sensor
        Name of the sensor.
    share
        1 where its axis points the other way, 0 where it points as recorded; between, a mixture.

    Examples
    --------
    >>> turned = experiment + bp.effects.reversed_sensor("s1")
    >>> [effect.name for effect in turned.effects]
    ['reversed_sensor']
    """

    absent = ("share", 0.0)
    side = "sensor"
    sensor: Number
    share: Parameter = field(metadata=unit("1"), default=1.0)
    name: str = field(static=True, default="reversed_sensor", kw_only=True)

    def channel_factor(self, omega: Omega, instruments: Instruments) -> Factor:
        """Return the sign of the sensor's channels."""
        sign = 1 - 2 * instruments.of(self.sensor) * self.share
        return sign[:, None, None]

    @classmethod
    def suggest(cls, scales: Scales) -> list["ReversedSensor"]:
        """Each sensor reversed."""
        return [cls(sensor) for sensor in scales.instruments.sensors]


class ReversedChannel(OnTransducer):
    """A sensor or actuator of reversed polarity, a factor 1 - 2 share on its FRFs.

    Parameters
    ----------
    transducer, side
        Name of the sensor or actuator, and `sensor` or `actuator` where that leaves it open.
    share
        1 where its axis points the other way, 0 where it points as recorded; between, a mixture.
    direction
        Recorded direction of the only channel that is reversed; None for all of the transducer.

    Examples
    --------
    >>> [effect.name for effect in (experiment + bp.effects.reversed_channel("a1")).effects]
    ['reversed_channel']
    """

    absent = ("share", 0.0)
    transducer: Number
    share: Parameter = field(metadata=unit("1"), default=1.0)
    name: str = field(static=True, default="reversed_channel", kw_only=True)

    def channel_factor(self, omega: Omega, instruments: Instruments) -> Factor:
        """Return the sign of the reversed channels."""
        return 1 - 2 * self.affected(instruments) * self.share

    @classmethod
    def suggest(cls, scales: Scales) -> list["ReversedChannel"]:
        """Each channel of an actuator, and of a sensor with several: `reversed_sensor` has all."""
        each = on_each_channel(cls, scales)
        return [one for one in each if one.side == "actuator" or one.direction is not None]
