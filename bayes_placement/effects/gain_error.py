"""A wrong sensitivity of a sensor or an actuator."""

import math
from collections.abc import Mapping

from numpyro.distributions import TransformedDistribution
from numpyro.distributions.transforms import AffineTransform, ExpTransform

from .instruments import Instruments, Number
from .known_factors import known_factor
from .on_transducer import OnTransducer, channels, sides_that_differ
from .prelude import Factor, Omega, Parameter, Scales, field, log_uniform_of_either_sign, unit

GREATEST = 2000.0
"""Greatest factor of a default prior: beyond 1000, as of a unit for its thousandfold."""


class GainError(OnTransducer):
    """A wrong sensitivity of one sensor or actuator, a factor 1 + error on its FRFs.

    Parameters
    ----------
    transducer, side
        Name of the sensor or actuator, and `sensor` or `actuator` where that leaves it open.
    error
        Relative error of its sensitivity [1].
    direction
        Recorded direction of the only channel that is wrong; None for all of the transducer.

    Examples
    --------
    >>> wrong = experiment + bp.effects.gain_error("s1", error=dist.Normal(0.0, 0.1))
    >>> list(wrong.unknown)
    ['structure.damping.ratio', 'sensor.s1.position', 'instrument_effects.gain_error.error']
    """

    absent = ("error", 0.0)
    transducer: Number
    error: Parameter = field(metadata=unit("1"))
    name: str = field(static=True, default="gain_error", kw_only=True)

    def channel_factor(self, omega: Omega, instruments: Instruments) -> Factor:
        """Return 1 + error on the wrong channels."""
        return 1 + self.affected(instruments) * self.error

    def remark(self, estimates: Mapping[str, tuple[float, float]]) -> str:
        """Name the wrong factor, where the estimate is a known one within its uncertainty."""
        if "error" not in estimates:
            return ""
        error, deviation = estimates["error"]
        known = known_factor(1 + error, deviation)
        return f"a factor of {known}" if known else ""

    @classmethod
    def suggest(cls, scales: Scales) -> list["GainError"]:
        """Each channel with a factor up to 2000, either way.

        The order of its logarithm is not known: from 0.001, as of a sensitivity, to wrong units,
        9.81 or 1000.
        """
        farthest = math.log(GREATEST)
        logarithm = log_uniform_of_either_sign(1e-3, -farthest, farthest)
        relative_error = TransformedDistribution(
            logarithm, [ExpTransform(), AffineTransform(-1.0, 1.0)]
        )
        return [
            cls(name, relative_error, side=side, direction=direction)
            for side in sides_that_differ(scales.instruments)
            for name, direction in channels(scales.instruments, side)
        ]
