"""gain_error: in, a sensor and a relative error; out, the FRF as it was recorded.

Not known here: the structure, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import numpy as np
from numpyro.distributions import Uniform

from .._sites import unit
from .._types import InputError, Parameter, Receptance
from ..positions.channel import Channel
from . import _words
from ._effect import InstrumentEffect, Numbered, Omega, numbered, of_sensor, sensor_names


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
    sensor: Numbered
    error: Parameter = eqx.field(metadata=unit("1"))
    direction: Numbered | None = eqx.field(default=None, kw_only=True)
    name: str = eqx.field(static=True, default="gain_error", kw_only=True)

    def among(self, channels: Sequence[Channel]) -> "GainError":
        """Return it with the number of its sensor, and the direction as a number.

        Raises
        ------
        ValueError
            If the experiment has no such sensor, or this has no such channel.
        """
        sensor = numbered(self.sensor, channels)
        if self.direction is None:
            return GainError(sensor, self.error, name=self.name)
        own = [one for one in channels if one.name == sensor_names(channels)[int(sensor)]]
        if self.direction not in [one.direction for one in own]:
            raise InputError(
                f'Effect "{self.name}": the direction {self.direction} was given, but the sensor '
                f"has the channels {', '.join(one.label for one in own)}. Give one of their "
                f"directions: direction={own[0].direction}."
            )
        return GainError(sensor, self.error, direction=np.asarray(self.direction), name=self.name)

    def recorded(self, frf: Receptance, omega: Omega, channels: Sequence[Channel]) -> Receptance:
        """FRF whose wrong channels are multiplied by 1 + error."""
        wrong = of_sensor(self.sensor, channels)
        if self.direction is not None:
            wrong *= np.array([one.direction for one in channels]) == self.direction
        return frf * (1 + wrong * self.error)[:, None, None]

    def setting(self, experiment: Any) -> str:
        """Which sensor it is about, and which of its channels."""
        sensor = f"sensor {_words.sensor(self.sensor, experiment)}"
        return _words.together(sensor, _words.channel(self.direction))

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["GainError"]:
        """From a tenth to twice the sensitivity of each channel."""
        law = Uniform(-0.9, 1.0)
        return [
            cls(name, law, direction=direction if len(one.directions) > 1 else None)
            for name, one in experiment.sensor.items()
            for direction in one.directions
        ]


gain_error = GainError
