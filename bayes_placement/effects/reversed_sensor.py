"""A sensor whose axis points the other way."""

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
