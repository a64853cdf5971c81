"""Arrays of a measurement: frozen, and in rows of sensors and columns of actuators."""

from typing import Any

import numpy as np


def frozen(values: Any, dtype: type) -> np.ndarray:
    """Return a copy that cannot be written to."""
    array: np.ndarray = np.array(values, dtype=dtype)
    if dtype is complex:
        # NumPy gives a real NaN the imaginary part 0.
        array[np.isnan(array)] = complex(np.nan, np.nan)
    array.setflags(write=False)
    return array


def as_pairs(values: Any, single: bool) -> np.ndarray:
    """Return an array (sensor, actuator, frequency), also of the lines of a single pair."""
    array = np.asarray(values)
    return array[None, None] if single and array.ndim == 1 else array
