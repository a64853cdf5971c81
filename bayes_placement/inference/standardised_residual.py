"""Residuals of an experiment over their standard deviations, plain or of logarithms of FRFs."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool
from numpyro.distributions import Distribution, MaskedDistribution, MultivariateNormal

from ..experiment.experiment import Experiment
from ..experiment.noise import Data
from ..experiment.observe import Complex

Logarithmic = bool | Bool[Array, ""]

LOGARITHMIC_ERROR = 0.1
"""Relative error by which a logarithmic residual is divided."""

LEAST_RATIO = 1e-12
"""Least modulus of what is predicted over what was measured, whose logarithm is taken."""


def standardised_residual(
    known: Experiment, data: Data, logarithmic: Logarithmic
) -> tuple[Array, Array]:
    """Residuals over their standard deviations, and the sum of the logs of these.

    Nothing of the experiment is unknown. They may be those of the complex logarithm, which only
    complex FRFs have.
    """
    assert known.noise is not None
    frf = known.frf() if isinstance(known.observe, Complex) else None
    predicted = known.predict() if frf is None else known.observe.output(frf)
    distribution = known.noise.distribution(predicted, data)
    plain, log_scale = _standardised(distribution, data)
    if frf is None:
        return plain, log_scale
    # A logarithm and an angle take longer than the FRF: they are computed where they are asked for.
    chosen = jax.lax.cond(logarithmic, lambda: _logarithmic(frf, data), lambda: plain)
    return chosen, log_scale


def _standardised(distribution: Distribution, data: Data) -> tuple[Array, Array]:
    """Residuals over their standard deviations and the sum of the logs of these.

    Zero where nothing was measured.
    """
    base = distribution.base_dist if isinstance(distribution, MaskedDistribution) else distribution
    error = data.z - base.mean
    if isinstance(base, MultivariateNormal):
        # One factor serves all channels and parts: its logarithm counts for each of them.
        scale = jnp.broadcast_to(base.scale_tril, (*error.shape, error.shape[-1]))
        plain = jax.scipy.linalg.solve_triangular(scale, error[..., None], lower=True)[..., 0]
        return plain.ravel(), jnp.sum(jnp.log(jnp.diagonal(scale, axis1=-2, axis2=-1)))
    deviation = jnp.broadcast_to(base.scale, error.shape)
    logs = jnp.sum(jnp.where(data.measured, jnp.log(deviation), 0.0))
    return jnp.where(data.measured, error / deviation, 0.0).ravel(), logs


def _logarithmic(frf: Array, data: Data) -> Array:
    """Residual of the complex logarithm, the phase wrapped to its principal value.

    In real numbers: complex division and modulus guard against overflow, and take three times as
    long.
    """
    real, imaginary = jnp.real(frf), jnp.imag(frf)
    of_data = data.z[..., 0, :], data.z[..., 1, :]
    over_square = 1 / (of_data[0] ** 2 + of_data[1] ** 2)
    along = (real * of_data[0] + imaginary * of_data[1]) * over_square
    across = (imaginary * of_data[0] - real * of_data[1]) * over_square
    square = along**2 + across**2
    is_known = square > LEAST_RATIO**2  # not where nothing is predicted, or NaN
    log_ratio = 0.5 * jnp.log(jnp.where(is_known, square, LEAST_RATIO**2))
    angle = jnp.where(is_known, jnp.arctan2(across, along), 0.0)
    measured = data.measured
    parts = jnp.where(measured, jnp.stack([log_ratio, angle], axis=-2), 0.0)
    return parts.ravel() / LOGARITHMIC_ERROR
