"""Lines of a measurement by their frequencies."""

import numpy as np
from jaxtyping import Float, Int

from .._shared.errors import InputError
from ._measurement_checks import not_measured

# Universal files carry 6 significant digits of the first line and of the spacing, so a line is
# known to 5e-6 of its frequency; twice that still tells apart the lines of any such file.
LINE_TOLERANCE = 1e-5


def measured_lines(
    frequency: Float[np.ndarray, "frequency"], requested: Float[np.ndarray, "requested"]
) -> Int[np.ndarray, "requested"]:
    """Index of the measured line at each requested frequency [Hz]."""
    nearest = np.rint(np.interp(requested, frequency, np.arange(frequency.size))).astype(int)
    close = np.isclose(frequency[nearest], requested, rtol=LINE_TOLERANCE, atol=0.0)
    if not close.all():
        raise not_measured(requested, frequency, np.where(close, -1, nearest))
    if np.any(np.diff(nearest) <= 0):
        raise InputError(
            "The frequencies given do not increase from one measured line to the next; each "
            "line is needed once, since a line that counts twice makes the answer too certain: "
            "measurement.lines(np.unique(frequency))."
        )
    return nearest
