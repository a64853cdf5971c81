"""Levenberg's and Marquardt's method from many starts at once, and a fit about the best end."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.stats import norm, qmc

from .laplace import Laplace, laplace
from .least_squares import NormalEquations, Points

LARGEST = 5.0
"""Greatest coordinate: a prior probability of 3e-7 is left beyond it."""

GAIN = 1e-3
"""Gain of log density below which a descent has arrived."""

ALIKE = 0.5
"""Difference of log density below which two starts end at the same mode."""


class Fit(NamedTuple):
    """The highest posterior density and a Gaussian about it, in standard normal coordinates.

    Parameters
    ----------
    point
        The mode [unknown].
    cost
        Minus the log of the posterior density there, less constants.
    squares
        Sum of squares of the residuals.
    gaussian
        Laplace's approximation.
    log_evidence
        Log evidence by Laplace's approximation.
    reached
        Number of starts that ended there.
    """

    point: np.ndarray
    cost: float
    squares: float
    gaussian: Laplace
    log_evidence: float
    reached: int

    @property
    def determined(self) -> float:
        """Number of unknowns that the data determine, rather than the prior."""
        return len(self.point) - float(np.trace(self.gaussian.covariance))


def sobol_starts(dimension: int, count: int, seed: int) -> Points:
    """Scrambled Sobol points of the prior, after its middle."""
    if dimension == 0:
        return np.zeros((1, 0))
    sobol = qmc.Sobol(dimension, rng=np.random.default_rng(seed))
    uniform = sobol.random_base2(max(1, int(np.ceil(np.log2(max(2, count))))))
    drawn = norm.ppf(np.clip(uniform, 0.02, 0.98))
    return np.concatenate([np.zeros((1, dimension)), drawn])[:count]


def minimise(
    normal_equations: Callable[[Points], NormalEquations],
    starts: Points,
    *,
    steps: int,
    gain: float = GAIN,
    largest: float | np.ndarray = LARGEST,
) -> tuple[Points, NormalEquations]:
    """Ends of descents from all starts, and the normal equations there.

    Each start has a damping of its own; one that no longer gains is left alone.

    Parameters
    ----------
    normal_equations
        Cost, gradient and positive definite curvature at points.
    starts
        Starts [start, unknown].
    steps
        Most steps.
    gain
        Gain of log density below which a descent has arrived.
    largest
        Greatest size of a coordinate.
    """
    points = starts.copy()
    here = NormalEquations(*(np.array(part) for part in normal_equations(points)))
    damping = np.full(len(points), 1e-3)
    moving = np.ones(len(points), dtype=bool)
    for _ in range(steps):
        some = np.flatnonzero(moving)
        step = _steps(NormalEquations(*(part[some] for part in here)), damping[some])
        trial = np.clip(points[some] + step, -largest, largest)
        there = normal_equations(trial)
        cost = np.nan_to_num(here.cost[some], nan=np.inf)
        better = np.nan_to_num(there.cost, nan=np.inf) < cost
        gained = np.where(better, cost - there.cost, 0.0)
        points[some[better]] = trial[better]
        for array, new in zip(here, there, strict=True):
            array[some[better]] = new[better]
        damping[some] = np.clip(damping[some] * np.where(better, 0.2, 5.0), 1e-9, 1e9)
        moving[some] = ~((better & (gained < gain)) | (~better & (damping[some] > 1e2)))
        if not moving.any():
            break
    return points, here


def _steps(here: NormalEquations, damping: np.ndarray) -> np.ndarray:
    diagonal = np.einsum("bii->bi", here.curvature)
    eye = np.eye(diagonal.shape[1])
    curvature = here.curvature + damping[:, None, None] * eye * diagonal[:, None]
    clean = np.nan_to_num(curvature, nan=0.0, posinf=0.0, neginf=0.0) + 1e-12 * eye
    return -np.linalg.solve(clean, np.nan_to_num(here.gradient)[..., None])[..., 0]


def best_fit(points: Points, normal: NormalEquations, count: int) -> Fit:
    """Laplace's approximation about the best end, of so many data."""
    costs = np.nan_to_num(normal.cost, nan=np.inf)
    best = int(np.argmin(costs))
    gaussian = laplace(points[best], normal.curvature[best])
    prior = -0.5 * (count + len(points[best])) * np.log(2 * np.pi)
    return Fit(
        point=points[best],
        cost=float(costs[best]),
        squares=float(normal.squares[best]),
        gaussian=gaussian,
        log_evidence=float(prior - costs[best] + gaussian.log_volume),
        reached=int(np.sum(costs < costs[best] + ALIKE)),
    )
