"""What a reader of time records returns: arrays by name, their units, and their sampling rates."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np


class Sampled(NamedTuple):
    """Channels of a file, in its units.

    Parameters
    ----------
    arrays
        Samples by name.
    units
        Units that the file states, by name.
    rates
        Sampling rates [Hz] that the file states, by name.
    """

    arrays: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    rates: Mapping[str, float]
