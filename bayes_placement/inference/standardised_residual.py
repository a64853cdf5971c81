"""Residuals of an experiment over their standard deviations, plain or of logarithms of FRFs."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array
from numpyro.distributions import MaskedDistribution, MultivariateNormal

from ..experiment.experiment import Experiment
from ..experiment.noise import Data
from ..experiment.observe import Complex

LOGARITHMIC_ERROR = 0.1
"""Relative error by which a logarithmic residual is divided."""


def standardised_residual(known: Experiment, data: Data, logarithmic: Any) -> tuple[Array, Array]:
    """Residuals over their standard deviations, and the sum of the logs of these.

    Parameters
    ----------
    known
        The experiment, nothing of which is unknown.
    data
        Measured outputs.
    logarithmic
        Whether residuals are those of the complex logarithm, which only complex FRFs have.
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


def _standardised(distribution: Any, data: Data) -> tuple[Array, Array]:
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
    """Residual of the complex logarithm, the phase wrapped to its principal value."""
    measured = data.z[..., 0, :] + 1j * data.z[..., 1, :]
    ratio = jnp.where(data.measured[..., 0, :], frf / measured, 1.0)
    ratio = jnp.where(jnp.abs(ratio) > 1e-12, ratio, 1e-12)
    parts = jnp.stack([jnp.log(jnp.abs(ratio)), jnp.angle(ratio)], axis=-2)
    return parts.ravel() / LOGARITHMIC_ERROR
