"""A wrong sensitivity of a sensor or an actuator."""

import math
from collections.abc import Mapping

from numpyro.distributions import TransformedDistribution
from numpyro.distributions.transforms import AffineTransform, ExpTransform

from .instruments import Instruments, Number
from .on_transducer import OnTransducer, on_each_channel
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
        return on_each_channel(cls, scales, relative_error)


KNOWN = {
    "9.81, as of m/s² for g": 9.81,
    "1/9.81, as of g for m/s²": 1 / 9.81,
    "sqrt 2, as of a peak for a root mean square": math.sqrt(2),
    "1/sqrt 2, as of a root mean square for a peak": 1 / math.sqrt(2),
    "2 pi, as of rad/s for Hz": 2 * math.pi,
    "1/(2 pi), as of Hz for rad/s": 1 / (2 * math.pi),
    "1000, as of a unit for its thousandfold": 1e3,
    "1/1000, as of a unit for its thousandth": 1e-3,
    "-1, as of reversed polarity": -1.0,
}
"""Factors by their names."""

WIDTH = 2.5758
"""Standard deviations between which 99 % of a normal distribution lie."""

SHARPEST = 0.1
"""Greatest relative uncertainty of a factor that tells these apart."""


def known_factor(mean: float, standard_deviation: float) -> str:
    """Name of the known wrong factor that an estimate may be; empty where there is none."""
    if not 0 <= standard_deviation <= SHARPEST * abs(mean):
        return ""
    if abs(mean - 1.0) <= WIDTH * standard_deviation:
        return ""  # it may be none at all
    distance = {name: abs(mean - factor) for name, factor in KNOWN.items()}
    nearest = min(distance, key=lambda name: distance[name])
    return nearest if distance[nearest] <= WIDTH * standard_deviation else ""
