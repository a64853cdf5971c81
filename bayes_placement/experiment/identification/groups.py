"""Groups of close peaks of measured FRFs, and the poles that the data ask for in each."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..._shared.dimensions import Spectrum
from ..._shared.errors import InputError
from .._modal_checks import MOST_IMAGINARY
from ..line_choice import half_power_bandwidth, mode_indicator, resonances
from .band import ELSEWHERE, Band, PoleFit, fitted

if TYPE_CHECKING:
    from ..measurement import Measurement

BANDWIDTHS, LINES = 5.0, 12
"""Half-power bandwidths to either side of a peak that are fitted, and lines at least."""

FREE = ELSEWHERE + 3
"""Lines more than poles at least, so that some scatter is left of each pair."""

NEAR = 2.0
"""Half-power bandwidths of a peak within which two resonances make one peak."""

SAME = 0.9
"""Modal assurance criterion of residues from which two poles that overlap are one mode."""

Peaks = Float[np.ndarray, "peak"]


class PeakGroup(NamedTuple):
    """Peaks that are fitted together."""

    peaks: Peaks
    """Their frequencies [Hz]."""
    widths: Peaks
    """Their half-power bandwidths [Hz]."""
    inside: Bool[np.ndarray, "frequency"]
    """Which lines are fitted."""

    def holds(self, frequency: float) -> bool:
        """Whether a pole is one of the peaks, or so near one that both make one peak."""
        return bool(np.any(np.abs(self.peaks - frequency) <= NEAR * self.widths))

    def without(self, poles: Float[np.ndarray, "pole"]) -> Peaks:
        """Peaks near which there is none of these poles [Hz]."""
        apart = np.abs(self.peaks[:, None] - poles) > NEAR * self.widths[:, None]
        return np.asarray(self.peaks[apart.all(axis=1)])


def groups_of(measurement: "Measurement") -> Iterator[PeakGroup]:
    """Groups of peaks each of which lies on the lines that are fitted of another one."""
    frequency, indicator = measurement.frequency, mode_indicator([measurement])
    lines = resonances([measurement])
    peaks = frequency[lines]
    widths = np.array([half_power_bandwidth(frequency, indicator, int(line)) for line in lines])
    reach = np.maximum(BANDWIDTHS * widths, _reach_of_lines(frequency, lines))
    apart = np.diff(peaks) >= np.maximum(reach[1:], reach[:-1])
    for members in np.split(np.arange(peaks.size), np.flatnonzero(apart) + 1):
        if members.size:
            low, high = np.min((peaks - reach)[members]), np.max((peaks + reach)[members])
            inside = (frequency >= low) & (frequency <= high)
            yield PeakGroup(peaks[members], widths[members], inside)


def _reach_of_lines(frequency: Spectrum, peaks: Int[np.ndarray, "peak"]) -> Peaks:
    """Half of the width [Hz] of the fewest lines about each peak."""
    low, high = np.maximum(peaks - LINES, 0), np.minimum(peaks + LINES, frequency.size - 1)
    return np.asarray((frequency[high] - frequency[low]) / 2)


def best_fit(band: Band, group: PeakGroup) -> PoleFit:
    """Fit a pole to each peak, and more as long as the Bayes information criterion asks for them.

    Those at the peaks must remain modes: a resonance that drifts while it is measured, or depends
    on the amplitude, is fitted better by two poles, and is one mode.
    """
    most = band.frequency.size - FREE
    if group.peaks.size > most:
        raise InputError(
            f"{band.frequency.size} lines about the peak at {group.peaks[0]:.4g} Hz were given to "
            f"identify(); {group.peaks.size + FREE} or more are needed, to tell a resonance from "
            "what surrounds it. Give all lines of the record: bp.identify(measurement)."
        )
    best = fitted(band, group.peaks.size)
    while best.pole.size < most:
        more = fitted(band, best.pole.size + 1)
        modes = poles_of(band, more, group)
        if not (more.criterion < best.criterion and _are_modes(more, modes)):
            break
        best = more
    return best


def poles_of(band: Band, fit: PoleFit, group: PeakGroup) -> list[int]:
    """Numbers of the poles at the peaks of a group; others are background.

    Those of negative frequencies are the mirror images of modes.
    """
    poles = band.hertz(fit.pole)
    return [n for n, pole in enumerate(poles) if pole.real > 0 and group.holds(abs(pole))]


def _are_modes(fit: PoleFit, numbers: list[int]) -> bool:
    """Whether poles decay, move in phase, and where their half-power bands overlap not alike."""
    pole, unit = fit.pole[numbers], fit.residue[:, numbers]
    unit = unit / np.linalg.norm(unit, axis=0)
    in_phase = np.abs(np.sum(unit**2, axis=0)) >= 1 - 2 * MOST_IMAGINARY**2
    apart = np.abs(pole.real[:, None] - pole.real) > pole.imag[:, None] + pole.imag
    differ = np.abs(unit.conj().T @ unit) ** 2 < SAME
    return bool(
        np.all(pole.imag > 0)
        and np.all(in_phase)
        and np.all(apart | differ | np.eye(len(numbers), dtype=bool))
    )
