"""Least squares: residuals at batches of points, their Jacobian, and the normal equations.

The Jacobian is one of forward differences. For the models of this package that is faster than
forward-mode differentiation, compilation included: tangents double the time to compile (0.6 to
1.3 s a model become 1.2 to 2.6 s) and save at most a third of the time of an evaluation (some
milliseconds), and residuals are needed by themselves as well.
"""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Array, Float

from ._column_groups import Changed, ColumnGroups, changed_data, column_groups

STEP = 1e-6
"""Step of differences, in prior standard deviations."""

ParameterPoints = Float[np.ndarray, "point unknown"]
Evaluate = Callable[[Any, bool], tuple[Array | np.ndarray, Array | np.ndarray]]
Residuals = tuple[np.ndarray, np.ndarray]


class NormalEquations(NamedTuple):
    """Minus log posterior density, its gradient and curvature at points; the sum of squares."""

    cost: np.ndarray
    gradient: np.ndarray
    curvature: np.ndarray
    squares: np.ndarray

    @property
    def log_evidence(self) -> np.ndarray:
        """That of each point by Laplace's method, up to a constant; NaN where nothing is finite."""
        with np.errstate(invalid="ignore"):  # a descent may end where the model has no value
            return -self.cost - 0.5 * np.linalg.slogdet(self.curvature)[1]


class Terms(NamedTuple):
    """A function at points [point], its gradient and its curvature."""

    cost: np.ndarray
    gradient: np.ndarray
    curvature: np.ndarray


class Jacobian(NamedTuple):
    """Residuals and their slopes at points."""

    residual: np.ndarray
    """Residuals over their standard deviations [point, datum]."""
    log_scale: np.ndarray
    """Sum of the logs of the standard deviations [point]."""
    slopes: np.ndarray
    """Slopes of the residuals [point, unknown, datum]."""
    scale_slopes: np.ndarray
    """Slopes of the sum of logs [point, unknown]."""


class LeastSquares:
    """Minus log likelihood as half a sum of squares and the logs of standard deviations.

    `evaluate` maps points [point, unknown], and whether residuals are logarithmic, to residuals
    over their standard deviations [point, datum] and the sum of the logs of these [point]. A
    logarithmic residual compares logarithms of complex numbers: far from the solution it still
    points to it, where resonances that do not overlap leave the plain residual flat.

    `traced` is the same for compiled functions: a tree, so that one such function serves all
    problems of one form. Unknowns that have one number in `alike` may change different data.
    """

    def __init__(
        self,
        evaluate: Evaluate,
        dimension: int,
        count: int,
        traced: Evaluate | None = None,
        alike: np.ndarray | None = None,
    ):
        self.evaluate = evaluate
        self.dimension = dimension
        self.count = count
        self.traced = evaluate if traced is None else traced
        self.kinds = np.arange(dimension) if alike is None else alike
        self._alike: LeastSquares | None = None

    def residuals(self, points: ParameterPoints, logarithmic: bool = False) -> Residuals:
        """Residuals [point, datum] and sums of logs [point] at points."""
        residual, log_scale = self.evaluate(points, logarithmic)
        return np.require(residual, requirements="W"), np.require(log_scale, requirements="W")

    def log_posterior(self, points: ParameterPoints) -> np.ndarray:
        """Log of standard normal prior times likelihood [point]."""
        return self.log_density(points, *self.residuals(points))

    def log_density(
        self, points: ParameterPoints, residual: np.ndarray, log_scale: np.ndarray
    ) -> np.ndarray:
        """Log of standard normal prior times likelihood, from residuals that are known."""
        squares = np.einsum("bn,bn->b", residual, residual) + np.einsum("bi,bi->b", points, points)
        constants = (self.count + self.dimension) * 0.5 * np.log(2 * np.pi)
        return -0.5 * squares - log_scale - constants

    def jacobian(self, points: ParameterPoints, logarithmic: bool = False) -> Jacobian:
        """Residuals and their slopes at points."""
        along = self.along_groups(points, logarithmic)
        return along._replace(slopes=self.column_groups.slopes(along.slopes))

    def along_groups(self, points: ParameterPoints, logarithmic: bool = False) -> Jacobian:
        """The same, but for the slopes of residuals: along the groups of unknowns."""
        groups = self.column_groups
        along = self._differences(points, groups.directions(), logarithmic)
        return along._replace(
            scale_slopes=along.scale_slopes[:, groups.group] * self._changed.noise
        )

    def objective(
        self,
        *,
        logarithmic: bool = False,
        weight: np.ndarray | None = None,
        prior: Callable[[ParameterPoints], Terms] | None = None,
    ) -> "SquaresAndPrior":
        """Return what a descent makes small.

        A datum that is held out has the weight zero; the prior at points is standard normal by
        default.
        """
        return SquaresAndPrior(
            self, logarithmic, weight, standard_normal if prior is None else prior
        )

    @property
    def known_noise(self) -> bool:
        """Whether the cost is half a sum of squares but for a constant."""
        return not self._changed.noise.any()

    def take_structure(self, other: "LeastSquares") -> None:
        """Take over which datum depends on which unknown, once that is asked for."""
        self._alike = other

    @functools.cached_property
    def column_groups(self) -> ColumnGroups:
        """Unknowns that change different data."""
        if self._alike is not None:
            return self._alike.column_groups
        changes, widens = self._changed
        # An unknown of the noise stands alone: it changes all that is known of the level.
        return column_groups(changes | widens[:, None])

    @functools.cached_property
    def _changed(self) -> Changed:
        """Whether each unknown changes each datum, and the noise, at any point."""
        if self._alike is not None:
            return self._alike._changed
        return changed_data(self._probed, self.kinds)

    def _probed(self, sets: np.ndarray) -> Changed:
        """Whether sets of unknowns change each datum, and the noise.

        A value that is not a number passes through every operation, also where the slope is zero:
        it reaches all that an unknown can change. What steps from one value to another, such as a
        nearest node, may stop it, but has a slope at a point of no symmetry, or none anywhere.
        """
        point = np.random.default_rng(0).uniform(-0.5, 0.5, (1, self.dimension))
        probes = np.concatenate([point, np.where(sets, np.nan, point)])
        reached, widened = (values[1:] for values in self.residuals(probes))
        along = self._differences(point, sets.astype(float), False)
        return Changed(
            np.isnan(reached) | (along.slopes[0] != 0),
            np.isnan(widened) | (along.scale_slopes[0] != 0),
        )

    def _differences(
        self, points: ParameterPoints, directions: np.ndarray, logarithmic: bool
    ) -> Jacobian:
        """Residuals and sums of logs at points, and their slopes along directions."""
        steps = np.concatenate([np.zeros((1, self.dimension)), STEP * directions])
        around = (points[:, None] + steps).reshape(len(points) * len(steps), self.dimension)
        residual, log_scale = self.residuals(around, logarithmic)
        residual = residual.reshape(len(points), len(steps), -1)
        log_scale = log_scale.reshape(len(points), len(steps))
        for values in (residual, log_scale):  # in place: they are large
            values[:, 1:] -= values[:, :1]
            values[:, 1:] /= STEP
        return Jacobian(residual[:, 0], log_scale[:, 0], residual[:, 1:], log_scale[:, 1:])


class SquaresAndPrior(NamedTuple):
    """Half a sum of squares, logs of deviations and a prior: what a descent makes small."""

    problem: LeastSquares
    """The problem."""
    logarithmic: bool
    """Whether residuals are logarithmic."""
    weight: np.ndarray | None
    """Weight of each datum; None where all count alike."""
    prior: Callable[[ParameterPoints], Terms]
    """Minus log prior density at points, its gradient and its curvature."""

    def cost(self, points: ParameterPoints) -> np.ndarray:
        """Minus log posterior density at points [point]; it takes no slopes."""
        residual, log_scale = self.problem.residuals(points, self.logarithmic)
        return self._cost(points, self._weighted(residual), log_scale)

    def normal_equations(self, points: ParameterPoints) -> NormalEquations:
        """Normal equations at points."""
        residual, log_scale, slopes, scale_slopes = self.problem.along_groups(
            points, self.logarithmic
        )
        residual = self._weighted(residual)
        squares, pulls = self.problem.column_groups.products(self._weighted(slopes), residual)
        # Fisher's information: unknown noise counts twice, once in the slopes.
        of_scale = scale_slopes[:, :, None] * scale_slopes[:, None, :] / self.problem.count
        prior = self.prior(points)
        return NormalEquations(
            self._cost(points, residual, log_scale),
            pulls + scale_slopes + prior.gradient,
            squares + of_scale + prior.curvature,
            np.einsum("bn,bn->b", residual, residual),
        )

    def _weighted(self, values: np.ndarray) -> np.ndarray:
        return values if self.weight is None else values * self.weight

    def _cost(
        self, points: ParameterPoints, residual: np.ndarray, log_scale: np.ndarray
    ) -> np.ndarray:
        squares = np.einsum("bn,bn->b", residual, residual)
        return 0.5 * squares + log_scale + self.prior(points).cost


def standard_normal(points: ParameterPoints) -> Terms:
    """Standard normal prior, but for its constant."""
    half_squares = 0.5 * np.einsum("bi,bi->b", points, points)
    return Terms(half_squares, points, np.eye(points.shape[1]))


GENERATIONS = 300
"""Most generations."""


def evolved(
    costs: Callable[[ParameterPoints], np.ndarray], starts: ParameterPoints, seed: int
) -> np.ndarray:
    """Return the point of the least cost that a population reaches [unknown].

    Differential evolution from a population of starts (Storn and Price 1997). A cost that is not
    a number counts as infinite. Points stay within a width of the first population on either
    side.
    """
    width = np.ptp(starts, axis=0)
    from scipy import optimize  # it takes long to import

    best = optimize.differential_evolution(
        lambda vectors: np.nan_to_num(costs(vectors.T), nan=np.inf),
        list(zip(starts.min(0) - width, starts.max(0) + width, strict=True)),
        init=starts,
        vectorized=True,
        updating="deferred",
        polish=False,
        rng=seed,
        maxiter=GENERATIONS,
    )
    return best.x
