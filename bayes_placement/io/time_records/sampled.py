"""What a reader of time records returns."""

from collections.abc import Mapping
from types import MappingProxyType
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
    left_out
        What was not read, by name, and why.
    """

    arrays: Mapping[str, np.ndarray]
    units: Mapping[str, str]
    rates: Mapping[str, float]
    left_out: Mapping[str, str] = MappingProxyType({})
