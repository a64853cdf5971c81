"""A wrong sensitivity of a sensor."""

from collections.abc import Sequence
from typing import ClassVar

import equinox as eqx
import numpy as np
from numpyro.distributions import Uniform

from .._sites import unit
from .._types import InputError, Parameter, Receptance
from ..modes.modes import Modes
from . import _setting_words
from .effect import Location, Omega
from .instrument_effect import InstrumentEffect
from .instruments import Instruments, Number
from .scales import Scales


class GainError(InstrumentEffect):
    """A wrong sensitivity of one sensor, a factor 1 + error on its channels or on one of them.

    Parameters
    ----------
    sensor
        Name of the sensor.
    error
        Relative error of its sensitivity [1].
    direction
        Recorded direction of the only channel that is wrong; None for all of the sensor.
    """

    absent: ClassVar[tuple[str, float]] = ("error", 0.0)
    sensor: Number
    error: Parameter = eqx.field(metadata=unit("1"))
    direction: Number | None = eqx.field(default=None, kw_only=True)
    name: str = eqx.field(static=True, default="gain_error", kw_only=True)

    def numbered(self, instruments: Instruments) -> "GainError":
        """Return the effect with its sensor by number, and the direction as an array.

        Raises
        ------
        InputError
            If the experiment has no such sensor, or the sensor no such channel.
        """
        sensor = instruments.number(self.sensor)
        if self.direction is None:
            return GainError(sensor, self.error, name=self.name)
        channels = instruments.sensors[instruments.name(sensor)].channels
        if self.direction not in [channel.direction for channel in channels]:
            raise InputError(
                f'Effect "{self.name}": the direction {self.direction} was given, but the sensor '
                f"has the channels {', '.join(channel.label for channel in channels)}. Give the "
                f"direction of one of them: direction={channels[0].direction}."
            )
        return GainError(sensor, self.error, direction=np.asarray(self.direction), name=self.name)

    def recorded(self, frf: Receptance, omega: Omega, instruments: Instruments) -> Receptance:
        """FRF whose wrong channels are multiplied by 1 + error."""
        wrong = instruments.of(self.sensor)
        if self.direction is not None:
            directions = [channel.direction for channel in instruments.channels("sensor")]
            wrong *= np.array(directions) == self.direction
        return frf * (1 + wrong * self.error)[:, None, None]

    def location(self, modes: Modes, instruments: Instruments) -> Location:
        """Where the sensor was recorded [m]."""
        return instruments.recorded(self.sensor)

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Name of the sensor, and its channel if only one is wrong."""
        sensor = f"sensor {instruments.name(self.sensor)}"
        return _setting_words.joined(sensor, _setting_words.channel(self.direction))

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence["GainError"]:
        """From a tenth to twice the sensitivity of each channel."""
        error = Uniform(-0.9, 1.0)
        return [
            cls(name, error, direction=direction if len(sensor.directions) > 1 else None)
            for name, sensor in scales.instruments.sensors.items()
            for direction in sensor.directions
        ]


gain_error = GainError
