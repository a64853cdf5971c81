"""Between what numbers quantities can be: a field states its own by `unit(word, within=...)`."""

from typing import NamedTuple

import numpy as np


class Range(NamedTuple):
    """Between what numbers a quantity can be, and what is meant where it is not.

    Parameters
    ----------
    least, most
        The least and the greatest number that it can be.
    reason
        What is needed, for the error.
    """

    least: float
    most: float
    reason: str


POSITIVE = Range(0.0, np.inf, "it must be above zero")
NOT_NEGATIVE = Range(0.0, np.inf, "it must not be negative")
SHARE_OF_CRITICAL = Range(
    0.0, 1.0, "a damping ratio is a share of critical damping between 0 and 1, not percent: 0.05"
)
_SHARE_OF_STIFFNESS = "a loss factor is a share between 0 and 1 of the stiffness, not percent: 0.05"
LOSS_FACTOR = Range(0.0, 1.0, _SHARE_OF_STIFFNESS)
SIGNED_LOSS_FACTOR = Range(-1.0, 1.0, _SHARE_OF_STIFFNESS)
SHARE_OF_AMPLITUDE = Range(0.0, 1.0, "a ratio of noise is a share of the amplitude: 0.05 for 5 %")
SHARE_LOST = Range(-np.inf, 1.0, "no more than all is lost, a share and not percent: 0.2")
RELATIVE = Range(-0.9, 1.0, "a drift is a relative change, not percent: 0.05")
DELAY = Range(-1.0, 1.0, "a delay is in seconds, not ms: 1e-3")
ANGLE = Range(-np.pi, np.pi, "angles are in rad, not degrees: numpy.deg2rad(5.0)")
RATE = Range(-0.9, 1.0, "an error of a sampling rate is a relative one, not percent: 0.05")
ORDER = Range(0.0, 1.0, "an order is between that of a spring, 0, and that of a dashpot, 1")
SIZE = Range(-0.5, 1.0, "an error of a dimension is a relative one, not percent: 0.05")
