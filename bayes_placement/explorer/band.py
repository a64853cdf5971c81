"""Lines of a part of the band."""

import numpy as np

from .._shared.errors import InputError
from ..experiment.experiment import Experiment

Band = tuple[float, float]
"""Least and greatest frequency [Hz]."""


def lines_within(experiment: Experiment, band: Band) -> np.ndarray:
    """Return the numbers of the lines of a band, which must be more than the unknowns."""
    frequency = np.asarray(experiment.frequency, dtype=float)
    (lines,) = np.nonzero((frequency >= band[0]) & (frequency <= band[1]))
    if lines.size <= len(experiment.unknowns):
        raise InputError(
            f"The band from {band[0]:.4g} to {band[1]:.4g} Hz was chosen, which has {lines.size} "
            f"lines; more than {len(experiment.unknowns)} are needed, since the model has so many "
            "unknowns: choose a wider one."
        )
    return lines
