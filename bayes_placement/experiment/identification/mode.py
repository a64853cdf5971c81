"""A mode of the poles of a fit: natural frequency, damping and shape, with their errors."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float
from scipy.special import chdtrc

from .band import Band, PoleFit

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
