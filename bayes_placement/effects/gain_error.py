"""gain_error: in, a sensor and a relative error; out, the FRF as it was recorded.

Not known here: the structure, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
from numpyro.distributions import Uniform

from .._channel import Channel
from .._sites import unit
from .._types import Parameter, Receptance
from ._effect import InstrumentEffect, Omega, of_sensor


class GainError(InstrumentEffect):
    """A wrong sensitivity of one sensor, a factor 1 + error on its channels.

    Parameters
    ----------
    sensor
        Name of the sensor.
    error
        Relative error of its sensitivity [1].
    """

    absent: ClassVar[tuple[str, float]] = ("error", 0.0)
    sensor: str = eqx.field(static=True)
    error: Parameter = eqx.field(metadata=unit("1"))
    name: str = eqx.field(static=True, default="gain_error", kw_only=True)

    def check(self, channels: Sequence[Channel]) -> None:
        """Refuse a sensor that the experiment does not have."""
        of_sensor(self.sensor, channels)

    def recorded(self, frf: Receptance, omega: Omega, channels: Sequence[Channel]) -> Receptance:
        """FRF whose channels of the sensor are multiplied by 1 + error."""
        return frf * (1 + of_sensor(self.sensor, channels) * self.error)[:, None, None]

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["GainError"]:
        """From a tenth to twice the sensitivity of each sensor."""
        return [cls(sensor, Uniform(-0.9, 1.0)) for sensor in experiment.sensor]


gain_error = GainError
