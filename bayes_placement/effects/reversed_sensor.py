"""A sensor whose axis points the other way."""

import equinox as eqx

from .instrument_effect import Factor, InstrumentEffect
from .prelude import Instruments, Location, Modes, Number, Omega, Parameter, Scales, unit


class ReversedSensor(InstrumentEffect):
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
    sensor: Number
    share: Parameter = eqx.field(metadata=unit("1"), default=1.0)
    name: str = eqx.field(static=True, default="reversed_sensor", kw_only=True)

    def numbered(self, instruments: Instruments) -> "ReversedSensor":
        """Return the effect with its sensor by number.

        Raises
        ------
        InputError
            If the experiment has no such sensor.
        """
        return eqx.tree_at(lambda tree: tree.sensor, self, instruments.number(self.sensor))

    def channel_factor(self, omega: Omega, instruments: Instruments) -> Factor:
        """Return the sign of the sensor's channels."""
        sign = 1 - 2 * instruments.of(self.sensor) * self.share
        return sign[:, None, None]

    def location(self, modes: Modes, instruments: Instruments) -> Location:
        """Where the sensor was recorded [m]."""
        return instruments.recorded(self.sensor)

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Name of the sensor."""
        return f"sensor {instruments.name(self.sensor)}"

    @classmethod
    def suggest(cls, scales: Scales) -> list["ReversedSensor"]:
        """Each sensor reversed."""
        return [cls(sensor) for sensor in scales.instruments.sensors]
