"""Groups of close peaks of FRFs with the poles that the data ask for, and the modes of these."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from scipy.special import chdtrc

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


ROUNDS = 30
"""Rounds of alternating least squares."""

CHANCE = 0.01
"""Probability below which residues are no product, but for chance."""


class ShapeFit(NamedTuple):
    """Complex shape of a mode at the channels of one side."""

    shape: Complex[np.ndarray, "channel"]
    """The shape, of any scale and phase."""
    of_residues: Complex[np.ndarray, "channel pair"]
    """What each residue that was measured contributes to it, to first order."""
    squares: float
    freedom: int
    """Sum of |residue - product|^2 over their variances, and its complex degrees of freedom."""

    def excess(self, level: float) -> float:
        """Variance of residues about the product over a level; 1 where errors of these explain it.

        Residues are few: what chance explains, at 1 in 100, is none.
        """
        chance = chdtrc(2 * self.freedom, 2 * self.squares / level) if self.freedom > 0 else 1.0
        return self.squares / self.freedom / level if chance < CHANCE else 1.0


def shape_of(
    residue: Complex[np.ndarray, "pair"],
    variance: Float[np.ndarray, "pair"],
    measured: Bool[np.ndarray, "channel other"],
) -> ShapeFit:
    """Fit residues [channel, other] by a product of a number for each channel of either side.

    The product has no scale of its own: the change of least size is that which the residues tell.
    Residues and variances are those of the pairs that were measured.
    """
    rows, columns = np.nonzero(measured)
    table, weight = np.zeros(measured.shape, complex), np.zeros(measured.shape)
    table[measured], weight[measured] = residue, 1 / variance
    other = np.linalg.svd(table)[2][0]
    for _ in range(ROUNDS):
        shape = _shares(table, weight, other)
        other = _shares(table.T, weight.T, shape)
    product = np.zeros((residue.size, sum(measured.shape)), complex)
    pairs = np.arange(residue.size)
    product[pairs, rows] = other[columns]
    product[pairs, len(measured) + columns] = shape[rows]
    root = np.sqrt(1 / variance)
    inverse = np.linalg.pinv(root[:, None] * product) * root
    left = np.abs(residue - shape[rows] * other[columns]) ** 2
    used = measured.any(axis=1).sum() + measured.any(axis=0).sum() - 1
    return ShapeFit(
        shape, inverse[: len(measured)], float(np.sum(left / variance)), residue.size - int(used)
    )


def _shares(table: np.ndarray, weight: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Numbers of the rows of least squares, those of the columns being known; 0 for empty rows."""
    above = (weight * table) @ other.conj()
    below = weight @ np.abs(other) ** 2
    return np.asarray(above / np.where(below > 0, below, 1.0))


class IdentifiedMode(NamedTuple):
    """One mode."""

    values: Float[np.ndarray, "row"]
    """Natural frequency [Hz], damping ratio [1] and shape of unit length."""
    covariance: Float[np.ndarray, "row row"]
    """Covariance of their errors. That of the scale of the shape means nothing."""
    imaginary: float
    """Share of the shape that is imaginary after the best turn [1]."""


def identified_mode(
    band: Band, fit: PoleFit, number: int, measured: Bool[np.ndarray, "channel other"]
) -> IdentifiedMode:
    """Return the mode of a pole of a fit.

    Pairs of channels that were measured are told by those of the shape first.
    """
    found = shape_of(fit.residue[:, number], fit.variance[:, number], measured)
    phase = np.exp(-0.5j * np.angle(np.sum(found.shape**2)))
    turned = phase * found.shape
    length = float(np.linalg.norm(turned.real))
    real = turned.real / length
    without_scale = np.eye(real.size) - np.outer(real, real) if real.size > 1 else np.eye(1)
    of_residues = phase / length * without_scale @ found.of_residues
    covariance = _covariance(band, fit, number, of_residues)
    covariance[2:, 2:] *= found.excess(fit.excess)
    if real.size > 1:  # the scale is given the error of all else: none would be singular
        scale = np.trace(covariance[2:, 2:]) / (real.size - 1)
        covariance[2:, 2:] += scale * np.outer(real, real)
    pole = complex(band.hertz(fit.pole[number]))
    values = np.array([abs(pole), pole.imag / abs(pole), *real])
    return IdentifiedMode(
        values, covariance, float(np.linalg.norm(turned.imag) / np.linalg.norm(turned))
    )


def _covariance(
    band: Band, fit: PoleFit, number: int, of_residues: Complex[np.ndarray, "channel pair"]
) -> Float[np.ndarray, "row row"]:
    """Covariance of real parts of what is linear in the circular errors of poles and residues."""
    pole = complex(band.hertz(fit.pole[number]))
    to_frequency = band.half * np.conj(pole) / abs(pole)
    to_ratio = -1j * band.half / abs(pole) - pole.imag / abs(pole) ** 2 * to_frequency
    of_this = np.eye(fit.pole.size)[number]
    of_poles = np.concatenate(
        [np.outer([to_frequency, to_ratio], of_this), of_residues @ fit.slope[:, number]]
    )
    own = np.zeros((len(of_poles), len(of_poles)), complex)
    own[2:, 2:] = (of_residues * fit.variance[:, number]) @ of_residues.conj().T
    whole = of_poles @ fit.covariance @ of_poles.conj().T + own
    return np.asarray(fit.excess * (whole + whole.T).real / 4)
