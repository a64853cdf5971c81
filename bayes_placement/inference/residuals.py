"""An experiment with data as a problem of least squares over standard normal coordinates."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import MaskedDistribution, MultivariateNormal

from .._compiled import Bound, compiled
from .._types import InputError
from ..experiment.experiment import Experiment
from ..experiment.noise import Data
from ..experiment.observe import Complex
from .coordinates import Coordinates
from .engines.least_squares import BATCH, LeastSquares

LOGARITHMIC_ERROR = 0.1
"""Relative error by which a logarithmic residual is divided."""


class Problem:
    """Least squares of an experiment against data.

    Parameters
    ----------
    experiment
        Experiment with Gaussian noise.
    data
        Measured outputs.
    standard_normal
        Whether the prior has to be standard normal in the coordinates.

    Raises
    ------
    InfeasibleError
        If it has to be, and a prior has no inverse distribution function.
    """

    def __init__(self, experiment: Experiment, data: Data, *, standard_normal: bool = True):
        if experiment.noise is None:
            raise InputError(
                "The experiment has noise=None, so residuals cannot be compared with the noise. "
                "Give it noise.Gaussian(sigma) or noise.FromCoherence()."
            )
        experiment.noise.check(data)
        self.experiment = experiment
        self.data = data
        self.coordinates = coordinates_of(experiment, standard_normal=standard_normal)
        self._evaluate: Bound[tuple[Array, Array]] = compiled(_residuals).bound(experiment, data)
        self.squares = LeastSquares(
            self._evaluate, self.dimension, int(np.sum(np.asarray(data.measured)))
        )

    @property
    def dimension(self) -> int:
        """Number of unknowns."""
        return self.coordinates.dimension

    @property
    def count(self) -> int:
        """Number of data."""
        return self.squares.count

    def prepare(self) -> None:
        """Compile the residuals, unless that is done. Any thread may."""
        self._evaluate.prepare(np.zeros((BATCH, self.dimension)), False)


def coordinates_of(experiment: Experiment, *, standard_normal: bool = True) -> Coordinates:
    """Coordinates of the unknowns of an experiment.

    Raises
    ------
    InfeasibleError
        If the prior has to be standard normal, and one has no inverse distribution function.
    """
    distributions = {unknown.name: unknown.distribution for unknown in experiment.unknowns}
    return Coordinates(distributions, standard_normal=standard_normal)


def _residuals(
    experiment: Experiment, data: Data, points: Float[Array, "point unknown"], logarithmic: Any
) -> tuple[Array, Array]:
    """Residuals of a batch of points, all numbers of the experiment being inputs."""
    coordinates = coordinates_of(experiment, standard_normal=False)

    def at(point: Float[Array, "unknown"]) -> tuple[Array, Array]:
        return _residual(experiment.fix(coordinates.values(point)), data, logarithmic)

    return jax.vmap(at)(points)


def _residual(known: Experiment, data: Data, logarithmic: Any) -> tuple[Array, Array]:
    frf = known.frf()
    assert known.noise is not None
    distribution = known.noise.distribution(known.observe.output(frf), data)
    plain, log_scale = standardised(distribution, data)
    if not isinstance(known.observe, Complex):
        return plain, log_scale
    return jnp.where(logarithmic, _logarithmic(frf, data), plain), log_scale


def standardised(distribution: Any, data: Data) -> tuple[Array, Array]:
    """Residuals over their standard deviations and the sum of the logs of these.

    Zero where nothing was measured.
    """
    base = distribution.base_dist if isinstance(distribution, MaskedDistribution) else distribution
    error = data.z - base.mean
    if isinstance(base, MultivariateNormal):
        scale = base.scale_tril
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
