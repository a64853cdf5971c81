"""Continuous excitation by a shaker: overlapping segments of long records, as Welch averages."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Complex
from scipy import signal

from ..._shared.arguments import finite_number, shown
from ..._shared.errors import InputError
from ..._shared.reprs import with_short_repr
from ..._shared.sites import unit
from .estimate import Excitation, Spectra, lines
from .recording import overload
from .records import FEWEST_SAMPLES, Records, Samples, positive

FEWEST_AVERAGES = 1.5
"""Fewest independent averages by whose scatter a variance is estimated."""


@with_short_repr
@dataclass(frozen=True)
class Continuous(Excitation):
    """Random or other continuous excitation, whose records are cut into segments.

    Segments, windows and the removal of the mean of each segment are those of `scipy.signal.csd`
    (Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70).

    Parameters
    ----------
    segment
        Length [s] of a segment; its inverse is the spacing of the lines [Hz].
    overlap
        Share of a segment that it has in common with the next one.
    window
        Window of each segment, as `scipy.signal.get_window` takes it.

    Raises
    ------
    InputError
        If the segment is not positive, or the overlap not between 0 and 0.95.

    Examples
    --------
    >>> bp.time_records.Continuous(segment=1.0, overlap=0.5)
    Continuous(segment=1 s)
    """

    segment: float | int = field(metadata=unit("s"))
    overlap: float | int = 0.5
    window: object = "hann"

    def __post_init__(self) -> None:
        """Check the numbers."""
        positive("segment", self.segment, "time_records.Continuous(segment=1.0)")
        _check_window(self.window)
        share = finite_number("overlap", self.overlap, "time_records.Continuous(1.0, overlap=0.5)")
        if not 0 <= share <= 0.95:
            raise InputError(
                f"Continuous(overlap={share:g}) was given; a share from 0 to 0.95 is needed, since "
                "segments that overlap more tell nothing new: overlap=0.5."
            )

    def spectra(self, records: Records) -> Spectra:
        """Spectra of all segments of all records."""
        for number in range(len(records.force)):
            fault = overload(records, number)
            if fault is not None:
                raise InputError(
                    f"In record {number + 1} {fault}; records in range are needed, since each "
                    "segment has a share in every line. Measure again, or cut that part out."
                )
        length = round(self.segment * records.rate)
        shift = length - int(self.overlap * length)
        counts = [max(0, 1 + (force.size - length) // shift) for force in records.force]
        _check_count(sum(counts), length, records)
        window = signal.get_window(self.window, length)
        averages = sum(_independent(count, window, shift) for count in counts if count)
        _check_averages(averages, self.overlap)
        frequency = lines(length, records.rate)

        def segments(rows: Iterable[Samples]) -> Complex[np.ndarray, "repeat frequency"]:
            used = slice(1, 1 + frequency.size)
            spectra = [_segments(row, window, shift) for row in rows if row.size >= length]
            return np.concatenate(spectra)[:, used]

        return Spectra(
            frequency=frequency,
            force=segments(records.force),
            response=np.array([segments(rows) for rows in records.response]),
            averages=averages,
            segment_window=window,
            correlated_lines=_correlated_lines(window),
            done=(
                f"segments of {self.segment:g} s, {self.window} window, overlap {self.overlap:g}",
            ),
        )


def _check_window(window: object) -> None:
    """Refuse what is no window of SciPy."""
    try:
        signal.get_window(window, 8)
    except (TypeError, ValueError) as error:
        raise InputError(
            f"window={shown(window)} was given; a window that scipy.signal.get_window knows is "
            "needed, since each segment is multiplied by it: window='hann'."
        ) from error


def _segments(row: Samples, window: Samples, shift: int) -> Complex[np.ndarray, "repeat frequency"]:
    _, _, spectra = signal.spectrogram(
        row, window=window, noverlap=window.size - shift, detrend="constant", mode="complex"
    )
    return np.asarray(spectra.T)


def _independent(count: int, window: Samples, shift: int) -> float:
    """Number of independent averages that overlapping segments are worth, by Welch.

    Force and error are both random, so that their product has the square of the correlation that
    the window gives either of them.
    """
    steps = np.arange(1, min(count, -(-window.size // shift)))
    common = np.array([np.sum(window[step * shift :] * window[: -step * shift]) for step in steps])
    square = (common / np.sum(window**2)) ** 2
    return count / (1 + 2 * float(np.sum((1 - steps / count) * square)))


def _correlated_lines(window: Samples) -> float:
    """Number of lines that count as one independent line.

    The window correlates both the force and the error.
    """
    correlation = np.abs(np.fft.fft(window**2)) / np.sum(window**2)
    return float(np.sum(correlation**4))


def _check_count(count: int, length: int, records: Records) -> None:
    if length < FEWEST_SAMPLES:
        raise InputError(
            f"A segment has {length} samples at {records.rate:g} Hz; at least {FEWEST_SAMPLES} are "
            "needed, to be transformed to lines: Continuous(segment=1.0)."
        )
    if count < 2:
        raise InputError(
            f"The records hold {count} segment{'' if count == 1 else 's'} of {length} samples; at "
            "least two are needed, since the coherence of a single one is 1 whatever the noise is, "
            "and its error unknown. Take shorter segments, or record longer."
        )


def _check_averages(averages: float, overlap: float) -> None:
    if averages < FEWEST_AVERAGES:
        raise InputError(
            f"Segments that overlap by {overlap:g} are worth {averages:.2g} independent averages; "
            f"at least {FEWEST_AVERAGES} are needed, since their scatter tells the error. Take "
            "shorter segments, or record longer."
        )
