"""How a structure was excited: what turns its records into spectra of repeats."""

import abc
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from .estimate import Processing
from .records import Records, Samples


@dataclass(frozen=True, eq=False)
class Spectra(Processing):
    """Spectra of force and responses in every repeat.

    Parameters
    ----------
    frequency
        Lines [Hz].
    force, response
        Spectra of each repeat, all in one unit of theirs.
    averages
        Number of independent repeats that they are worth: fewer where repeats overlap.
    correlated_lines
        Number of neighbouring lines that count as one independent line, since a window correlates
        their errors.
    segment_window
        Window of segments that are cut out of a longer record, or None.
    done, left_out, warnings, time_constant
        See `Processing`.
    """

    frequency: Float[np.ndarray, "frequency"]
    force: Complex[np.ndarray, "repeat frequency"]
    response: Complex[np.ndarray, "sensor repeat frequency"]
    averages: float
    correlated_lines: float
    segment_window: Samples | None = None


class Excitation(abc.ABC):
    """A kind of excitation, and how its records are cut and windowed."""

    @abc.abstractmethod
    def spectra(self, records: Records) -> Spectra:
        """Spectra of the repeats that the records hold.

        Raises
        ------
        InputError
            If fewer than two repeats are left.
        """


def lines(count: int, rate: float) -> Float[np.ndarray, "frequency"]:
    """Lines [Hz] of a transform of that many samples, without 0 Hz and the Nyquist frequency."""
    frequency = np.fft.rfftfreq(count, 1 / rate)
    return frequency[1 : (count + 1) // 2]
