"""A law as measured: what each line asks for, all else as the best law of its kind has it.

On one port residuals are r + a t at each line, so that the law follows from least squares at each
line, at the place and the unknowns of a law that was fitted in full. What these leave open adds to
its variance: cov(Z) = 1 / I + J C J', with the slope J of Z along the other unknowns and their
covariance C (law of total variance, to first order). That a line has a part in C is left aside:
intervals are a little too wide where lines are few.
"""

import numpy as np
import pandas as pd
from jaxtyping import Complex, Float

from ..._shared.dimensions import ComplexSpectrum, Spectrum
from ..kept_fits import NONE
from ._at_port import kept, omega_of
from ._channels import CHANNELS
from ._free_law import Free, over
from ._named_laws import NamedLaw

OfParts = Float[np.ndarray, "part part frequency"]
"""Covariance of the real and the imaginary part at each line."""

TINY = np.finfo(float).tiny
"""Least information: the deviation is huge where the data do not see the port."""


def as_measured(law: NamedLaw, free: Free) -> pd.DataFrame:
    """Dynamic stiffness at each line, of a cut the compliance, of channels the factor.

    Each with its uncertainty.

    The law is fitted in full; the problem with the port, or the factor, holds nothing.
    """
    covariance = law.fit.gaussian.covariance
    asked, variance = kept(
        lambda: _asked(law, free), (NONE, NONE), free, law.port, law.point, covariance
    )
    return pd.DataFrame(
        {
            "frequency": omega_of(free) / (2 * np.pi),
            "real": asked.real,
            "imaginary": asked.imag,
            "deviation_real": np.sqrt(variance[0, 0]),
            "deviation_imaginary": np.sqrt(variance[1, 1]),
            "covariance": variance[0, 1],
            "unit": law.port.unit,
        }
    )


def _asked(law: NamedLaw, free: Free) -> tuple[ComplexSpectrum, OfParts]:
    """What each line asks for, and its covariance."""
    point = law.point[None]
    at = free.at(point)
    strength = at.best()
    soft = 1 - at.receptance * strength
    along = at.slope * (soft**2)[:, None]  # residuals along Z, not along t
    information = np.sum(np.abs(along) ** 2, axis=1)
    slopes = free.slopes(point, strength, soft)  # with this Z held
    pulls = slopes.crossed(along)
    variance = _covariance(-over(pulls, information[:, None])[0], information[0], law)
    return over(strength, soft)[0] + (law.port.acts_on in CHANNELS), variance  # the factor is 1 + t


def _covariance(
    moved: Complex[np.ndarray, "unknown frequency"], information: Spectrum, law: NamedLaw
) -> OfParts:
    """Covariance of what lines ask for."""
    parts = np.stack([moved.real, moved.imag])
    of_others = law.fit.gaussian.covariance[: len(moved), : len(moved)]
    of_noise = np.eye(2)[..., None] / np.maximum(information, TINY)
    return of_noise + np.asarray(np.einsum("auf,uv,bvf->abf", parts, of_others, parts))
