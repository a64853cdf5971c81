"""Natural frequency, damping ratio and real shape of a pole, with one covariance."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float

from .band import Band, PoleFit
from .shapes import shape_of


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
