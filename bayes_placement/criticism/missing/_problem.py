"""_problem: in, an experiment and data; out, least squares in standard normal coordinates.

Not known here: candidates, what is claimed. In these coordinates the prior is one more residual,
so that the highest posterior density is where the sum of squares is least.
"""

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import MaskedDistribution, MultivariateNormal

from ..._compiled import compiled
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ...experiment.observe import Complex
from ...inference.standard_normal import StandardNormalCoordinates
from ._groups import Groups, grouped

BATCH = 16
"""Points evaluated together: more cost memory, fewer cost compiled calls."""

STEP = 1e-6
"""Step of differences, in prior standard deviations."""

LOGARITHMIC_ERROR = 0.1
"""Relative error that a logarithmic residual is measured by, at least."""

Point = Float[Array, "unknown"]


class Normal(NamedTuple):
    """Cost, its gradient and its Gauss-Newton curvature at a point, and its sum of squares."""

    cost: Any
    gradient: Any
    curvature: Any
    squares: Any


class Problem:
    """Cost of an experiment against data: half a sum of squares, minus log posterior density.

    Parameters
    ----------
    experiment
        Experiment whose unknowns have inverse distribution functions.
    data
        Measured outputs.
    """

    def __init__(self, experiment: Experiment, data: Data):
        self.experiment = experiment
        self.data = data
        priors = {unknown.name: unknown.distribution for unknown in experiment.unknowns}
        self.coordinates = StandardNormalCoordinates(priors)
        self.count = int(np.sum(np.asarray(data.measured)))
        self.compiled = compiled(_residuals).bound(experiment, data)

    def prepare(self) -> None:
        """Compile the residuals, unless that is done. Any thread may."""
        self.compiled.prepare(np.zeros((BATCH, self.dimension)), False)

    @property
    def dimension(self) -> int:
        """Number of unknowns."""
        return self.coordinates.dimension

    def at(self, point: Point) -> Experiment:
        """Return the experiment with the values at a point."""
        return self.experiment.fix(self.coordinates.values(point))

    @property
    def known_noise(self) -> bool:
        """Whether the cost is half a sum of squares but for a constant."""
        return not self._felt[1].any()

    def residual(self, point: Point, logarithmic: Any) -> tuple[Array, Array]:
        """Standardised residual of each datum, and the sum of the logs of the deviations.

        A logarithmic residual compares logarithms of complex FRFs: far from the solution it still
        points to it, where resonances that do not overlap leave the plain residual flat.
        """
        return _residual(self.at(point), self.data, logarithmic)

    def normal(
        self, points: np.ndarray, logarithmic: bool = False, weight: np.ndarray | None = None
    ) -> Normal:
        """Normal equations at several points.

        Slopes are differences: they need one compiled function in the place of two, and compiling
        takes most of the time of a search through many experiments.

        Parameters
        ----------
        points
            Points [point, unknown].
        logarithmic
            Of logarithmic residuals.
        weight
            Weight of each datum, zero for one that is held out.
        """
        residual, spread, slopes, widening = self.slopes(points, logarithmic)
        if weight is not None:
            residual, slopes = residual * weight, slopes * weight
        squares = np.einsum("bn,bn->b", residual, residual)
        # Fisher's information: unknown noise counts twice, once in the slopes.
        own = widening[:, :, None] * widening[:, None, :] / self.count
        return Normal(
            0.5 * squares + spread + 0.5 * np.einsum("bi,bi->b", points, points),
            np.einsum("bin,bn->bi", slopes, residual) + widening + points,
            slopes @ slopes.transpose(0, 2, 1) + own + np.eye(points.shape[1]),
            squares,
        )

    def slopes(
        self, points: np.ndarray, logarithmic: bool = False
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Residuals [point, datum], sums of log deviations [point], and the slopes of both."""
        groups = self.groups
        here, level, along, widening = self._differences(points, groups.directions(), logarithmic)
        return here, level, groups.slopes(along), widening[:, groups.of] * self._felt[1]

    @functools.cached_property
    def groups(self) -> Groups:
        """Unknowns that move different data."""
        moves, widens = self._felt
        # An unknown of the noise stands alone: it moves all that is known of the level.
        return grouped(moves | widens[:, None])

    @functools.cached_property
    def _felt(self) -> tuple[np.ndarray, np.ndarray]:
        """Whether each unknown moves each datum, and the noise, at any point.

        A value that is not a number passes through every operation, also where the slope is zero:
        it reaches all that an unknown can move. What steps from one value to another, such as a
        nearest node, may swallow it, but has a slope at a point of no symmetry, or none anywhere.
        """
        point = np.random.default_rng(0).uniform(-0.5, 0.5, (1, self.dimension))
        unknown = np.eye(self.dimension)
        probes = np.concatenate([point, np.where(unknown, np.nan, point)])
        reached, widened = (values[1:] for values in self.residuals(probes))
        _, _, slopes, widening = self._differences(point, unknown, False)
        return np.isnan(reached) | (slopes[0] != 0), np.isnan(widened) | (widening[0] != 0)

    def _differences(
        self, points: np.ndarray, directions: np.ndarray, logarithmic: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Residuals and sums of log deviations at points, and their slopes along directions."""
        steps = np.concatenate([np.zeros((1, self.dimension)), STEP * directions])
        around = (points[:, None] + steps).reshape(-1, self.dimension)
        residual, spread = self.residuals(around, logarithmic)
        residual = residual.reshape(len(points), len(steps), -1)
        spread = spread.reshape(len(points), len(steps))
        here, level = residual[:, 0], spread[:, 0]
        slopes = (residual[:, 1:] - here[:, None]) / STEP
        return here, level, slopes, (spread[:, 1:] - level[:, None]) / STEP

    def residuals(
        self, points: np.ndarray, logarithmic: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residuals [point, datum] and sums of log deviations [point] at several points."""
        count = len(points)
        padded = np.concatenate([points, np.repeat(points[-1:], -count % BATCH, axis=0)])
        parts = [
            self.compiled(some, logarithmic) for some in padded.reshape(-1, BATCH, self.dimension)
        ]
        residual = np.concatenate([np.asarray(part[0]) for part in parts])
        spread = np.concatenate([np.asarray(part[1]) for part in parts])
        return residual[:count], spread[:count]


def _residuals(
    experiment: Experiment, data: Data, points: Float[Array, "point unknown"], logarithmic: Any
) -> tuple[Array, Array]:
    """Residuals of a batch of points, all that can differ between variants being an input."""
    coordinates = StandardNormalCoordinates(
        {one.name: one.distribution for one in experiment.unknowns}
    )

    def at(point: Point) -> tuple[Array, Array]:
        return _residual(experiment.fix(coordinates.values(point)), data, logarithmic)

    return jax.vmap(at)(points)


def _residual(concrete: Experiment, data: Data, logarithmic: Any) -> tuple[Array, Array]:
    frf = concrete.frf()
    assert concrete.noise is not None
    law = concrete.noise.distribution(concrete.observe.output(frf), data)
    plain, spread = standardised(law, data)
    if not isinstance(concrete.observe, Complex):
        return plain, spread
    return jnp.where(logarithmic, _logarithmic(frf, data), plain), spread


def standardised(law: Any, data: Data) -> tuple[Array, Array]:
    """Residuals over their standard deviations, zero where nothing was measured."""
    base = law.base_dist if isinstance(law, MaskedDistribution) else law
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
