"""Reach within a part of the band: of the one that was chosen last, one after the other."""

from collections.abc import Callable

import numpy as np

from .._shared.errors import InputError
from ..experiment.experiment import Experiment

Band = tuple[float, float]
"""Least and greatest frequency [Hz]."""


class ChosenBand:
    """The band that a page has chosen, while reach within it is looked for.

    Parameters
    ----------
    begin
        Called with a band to look at.
    """

    def __init__(self, begin: Callable[[Band], None]):
        self._begin = begin
        self._chosen: Band | None = None
        self._looked: Band | None = None

    def choose(self, band: Band) -> None:
        """Look at a band once the one before has been looked at."""
        self._chosen = band
        if self._looked is None:
            self._look()

    def ended(self) -> Band | None:
        """Return the band that was looked at; None where another one was chosen meanwhile."""
        looked, self._looked = self._looked, None
        if looked == self._chosen:
            return looked
        self._look()
        return None

    def _look(self) -> None:
        assert self._chosen is not None
        self._looked = self._chosen
        try:
            self._begin(self._chosen)
        except InputError:
            self._looked = None
            raise


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
