"""Least squares by Levenberg's and Marquardt's method from many starts; Laplace's approximation."""

from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from scipy.special import ndtri

from .least_squares import NormalEquations, ParameterPoints

LEAST_CURVATURE = 1e-8
"""Least curvature, over the greatest, below which a direction counts as flat."""


class Laplace(NamedTuple):
    """Gaussian about a mode."""

    mode: Float[np.ndarray, "unknown"]
    """Its mean [unknown]."""
    root: Float[np.ndarray, "unknown unknown"]
    """Factor of its covariance, root @ root.T [unknown, unknown]."""
    is_flat: bool
    """Whether the posterior is flat along some direction, where the Gaussian means nothing."""

    @property
    def covariance(self) -> Float[np.ndarray, "unknown unknown"]:
        """Covariance."""
        return self.root @ self.root.T

    @property
    def log_volume(self) -> float:
        """Log of the integral of a Gaussian of height one."""
        return 0.5 * self.mode.size * np.log(2 * np.pi) + float(np.linalg.slogdet(self.root)[1])

    def widened(self, factor: float) -> "Laplace":
        """Return the Gaussian with standard deviations that are so many times as large."""
        return self._replace(root=factor * self.root)

    def points(
        self, normal: Float[np.ndarray, "draw unknown"]
    ) -> Float[np.ndarray, "draw unknown"]:
        """Draws, from standard normal ones."""
        return self.mode + normal @ self.root.T

    def log_density(self, normal: Float[np.ndarray, "draw unknown"]) -> Float[np.ndarray, "draw"]:
        """Log density of the draws that standard normal ones give."""
        return -0.5 * np.einsum("di,di->d", normal, normal) - self.log_volume


def laplace(
    mode: Float[np.ndarray, "unknown"],
    curvature: Float[np.ndarray, "unknown unknown"],
    least_share: float = LEAST_CURVATURE,
) -> Laplace:
    """Gaussian of the curvature of minus the log posterior density at its mode.

    The least share is the least curvature, over the greatest, that is more than rounding.
    """
    if not np.isfinite(curvature).all():
        return Laplace(mode, np.full(curvature.shape, np.nan), True)
    values, vectors = np.linalg.eigh(curvature)
    least = least_share * values.max(initial=0.0)
    covariance = (vectors / np.maximum(values, least)) @ vectors.T
    return Laplace(mode, np.linalg.cholesky(covariance), bool(np.any(values < least)))


LARGEST = 5.0
"""Largest coordinate; the prior probability beyond it is 3e-7."""

GAIN = 1e-3
"""Gain of log density of a step below which a descent has converged."""

MOST_DAMPING = 1e2
"""Damping above which a descent whose step was rejected ends, one of many starts."""

LONGEST = 2.0
"""Greatest change of a coordinate in a step: beyond, that of a uniform prior has no slope left."""

HELD_ROUNDS = 4
"""Greatest number of times that coordinates are held at their limits."""

RIGHT, WRONG = 0.6, 0.1
"""Decrease over the predicted one above which the damping falls, and below which it grows."""

ROUNDING = 1e-13
"""Rounding of a curvature over the greatest. A direction that the data leave to a standard normal
prior has a curvature of 1, however large that of others is."""

SAME_MODE = 0.5
"""Difference of log density below which two descents end at the same mode."""

MET = 0.1
"""Distance in deviations of the posterior below which two descents go on as one."""

APART = 10.0
"""Distance in deviations of the posterior from which on two points are not of one mode."""


@runtime_checkable
class Objective(Protocol):
    """What a descent makes small."""

    def cost(self, points: ParameterPoints) -> np.ndarray:
        """Minus log posterior density at points [point]."""

    def normal_equations(self, points: ParameterPoints) -> NormalEquations:
        """The same, its gradient and positive definite curvature, and the sum of squares."""


class Fit(NamedTuple):
    """Mode of the posterior and a Gaussian about it, in standard normal coordinates."""

    point: np.ndarray
    """The mode [unknown]."""
    cost: float
    """Minus the log posterior density at the mode, without constants."""
    squares: float
    """Sum of the squared residuals at the mode."""
    gaussian: Laplace
    """Laplace's approximation."""
    log_evidence: float
    """Log evidence by Laplace's approximation."""
    reached: int
    """Number of starts whose descents ended at a density as high."""
    elsewhere: Float[np.ndarray, "mode unknown"] = np.zeros((0, 0))
    """Other places of that density at which descents ended [place, unknown]."""
    gradient: Float[np.ndarray, "unknown"] = np.zeros(0)
    """Slope of the cost there [unknown]: not zero where the descent was cut short, or at a limit
    of coordinates."""

    @property
    def determined(self) -> float:
        """Number of unknowns that the data determine, rather than the prior."""
        return len(self.point) - float(np.sum(self.gaussian.root**2))  # trace of the covariance


def sobol_starts(dimension: int, count: int, seed: int) -> ParameterPoints:
    """The median of the prior, then scrambled Sobol points of it."""
    if dimension == 0:
        return np.zeros((1, 0))
    from scipy.stats import qmc  # it takes long to import

    sobol = qmc.Sobol(dimension, rng=np.random.default_rng(seed))
    uniform = sobol.random_base2(max(1, int(np.ceil(np.log2(max(2, count))))))
    normal = ndtri(np.clip(uniform, 0.02, 0.98))
    return np.concatenate([np.zeros((1, dimension)), normal])[:count]


def minimise(
    objective: Objective,
    starts: ParameterPoints,
    *,
    steps: int,
    gain: float = GAIN,
    largest: float | np.ndarray = LARGEST,
    most_damping: float = MOST_DAMPING,
    count: int | None = None,
) -> tuple[ParameterPoints, NormalEquations]:
    """Final points of the descents from all starts, and the normal equations at these.

    Each descent has its own damping; converged descents are no longer evaluated, and of those that
    meet, one. Slopes are taken where a step is accepted, since two steps of five are not. Below a
    gain of log density of a step a descent has converged; above the most damping it ends where a
    step was rejected. Coordinates are at most the largest in size. Where the model may miss them
    the number of data is given: deviations are then too small, and gains count in units of the mean
    square of the residuals, where that is above 1. By default they are taken as they are.
    """
    points = starts.copy()
    normal = NormalEquations(*(np.array(array) for array in objective.normal_equations(points)))
    damping = np.full(len(points), 1e-3)
    active = np.ones(len(points), dtype=bool)
    leader = np.arange(len(points))
    for _ in range(steps):
        _follow(leader, points, normal)
        rows = np.flatnonzero(active & (leader == np.arange(len(points))))
        if not rows.size:
            break
        near = NormalEquations(*(array[rows] for array in normal))
        step = _steps(near, damping[rows], *_limits(points[rows], largest))
        trial = points[rows] + step
        trial_cost = np.nan_to_num(objective.cost(trial), nan=np.inf)
        cost = np.nan_to_num(normal.cost[rows], nan=np.inf)
        accepted = trial_cost < cost
        decrease = np.zeros_like(cost)
        np.subtract(cost, trial_cost, out=decrease, where=accepted)  # both may be infinite
        predicted = _predicted_decrease(near, step)
        if accepted.any():
            points[rows[accepted]] = trial[accepted]
            for array, new in zip(normal, objective.normal_equations(trial[accepted]), strict=True):
                array[rows[accepted]] = new
        damping[rows] = np.clip(damping[rows] * _change_of_damping(decrease, predicted), 1e-9, 1e12)
        least = gain if count is None else gain * np.fmax(near.squares / count, 1.0)
        active[rows] = ~(
            (accepted & (decrease < least)) | (~accepted & (damping[rows] > most_damping))
        )
    return points[leader], NormalEquations(*(array[leader] for array in normal))


def _follow(leader: np.ndarray, points: ParameterPoints, normal: NormalEquations) -> None:
    """Let descents that have met another one of lower cost follow it."""
    leading = np.flatnonzero(leader == np.arange(len(points)))
    leading = leading[np.argsort(normal.cost[leading], kind="stable")]
    for place, best in enumerate(leading):
        if leader[best] != best:
            continue
        others = leading[place + 1 :]
        others = others[leader[others] == others]
        apart = points[others] - points[best]
        squares = np.sum((apart @ normal.curvature[best]) * apart, axis=1)
        met = others[squares < MET**2]
        if met.size:
            leader[np.isin(leader, met)] = best


def _limits(points: ParameterPoints, largest: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest step along each coordinate."""
    return np.maximum(-LONGEST, -largest - points), np.minimum(LONGEST, largest - points)


def _steps(
    normal: NormalEquations, damping: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Step of each descent; curvatures and gradients that are not finite count as zero.

    A coordinate that would leave its limits goes as far as it may. The others take the best step
    that is left then.
    """
    diagonal = np.einsum("bii->bi", normal.curvature)
    identity = np.eye(diagonal.shape[1])
    curvature = normal.curvature + damping[:, None, None] * identity * diagonal[:, None]
    finite = np.nan_to_num(curvature, nan=0.0, posinf=0.0, neginf=0.0) + 1e-12 * identity
    downhill = -np.nan_to_num(normal.gradient)
    step = np.linalg.solve(finite, downhill[..., None])[..., 0]
    at_limit = np.zeros(step.shape, dtype=bool)
    for _ in range(HELD_ROUNDS):
        outside = (step < low) | (step > high)
        if not (outside & ~at_limit).any():
            break
        at_limit |= outside
        matrix = np.where(at_limit[:, :, None], identity, finite)
        target = np.where(at_limit, np.clip(step, low, high), downhill)
        step = np.linalg.solve(matrix, target[..., None])[..., 0]
    return np.clip(step, low, high)


def _predicted_decrease(normal: NormalEquations, step: np.ndarray) -> np.ndarray:
    """Decrease of the cost that the normal equations predict."""
    curved = np.einsum("bi,bij,bj->b", step, normal.curvature, step)
    return -np.einsum("bi,bi->b", normal.gradient, step) - 0.5 * curved


def _change_of_damping(decrease: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Factor on the damping: less where the prediction was right, more where it was wrong."""
    ratio = decrease / np.where(predicted > 0, predicted, np.inf)
    return np.select([ratio > RIGHT, ratio > WRONG], [0.2, 1.0], 5.0)


def best_fit(points: ParameterPoints, normal: NormalEquations, count: int) -> Fit:
    """Laplace's approximation about the final point of the highest posterior density."""
    costs = np.nan_to_num(normal.cost, nan=np.inf)
    best = int(np.argmin(costs))
    gaussian = laplace(points[best], normal.curvature[best], ROUNDING)
    as_high = points[costs < costs[best] + SAME_MODE]
    constant = -0.5 * (count + len(points[best])) * np.log(2 * np.pi)
    return Fit(
        point=points[best],
        cost=float(costs[best]),
        squares=float(normal.squares[best]),
        gaussian=gaussian,
        log_evidence=float(constant - costs[best] + gaussian.log_volume),
        reached=len(as_high),
        elsewhere=_elsewhere(gaussian, as_high),
        gradient=normal.gradient[best],
    )


def _elsewhere(gaussian: Laplace, points: ParameterPoints) -> Float[np.ndarray, "mode unknown"]:
    """Points far from a mode by its deviations, one of those that are near each other."""
    apart: list[np.ndarray] = []
    for point in points if np.isfinite(gaussian.root).all() else []:
        distances = [
            np.linalg.norm(np.linalg.solve(gaussian.root, point - centre))
            for centre in (gaussian.mode, *apart)
        ]
        if min(distances) > APART:
            apart.append(point)
    return np.array(apart).reshape(len(apart), gaussian.mode.size)
