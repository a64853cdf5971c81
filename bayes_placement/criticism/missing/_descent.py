"""_descent: in, a least-squares problem and starts; out, where its cost is least.

Not known here: experiments, candidates. Levenberg's and Marquardt's method from many starts at
once, with Laplace's approximation of the evidence about the best end.
"""

from typing import NamedTuple

import numpy as np
from scipy.stats import norm, qmc

from ._problem import Normal, Problem

LARGEST = 5.0
"""Greatest coordinate: a prior probability of 3e-7 is left beyond it."""

GAIN = 1e-3
"""Gain of log density below which a descent has arrived."""


class Fit(NamedTuple):
    """The highest posterior density and a Gaussian about it, in standard normal coordinates.

    Parameters
    ----------
    point
        Where [unknown].
    cost
        Minus the log of the posterior density there, less constants.
    squares
        Sum of squares of the residuals.
    covariance
        Covariance of Laplace's method [unknown, unknown].
    log_evidence
        Log evidence by Laplace's method.
    reached
        Number of starts that ended there.
    """

    point: np.ndarray
    cost: float
    squares: float
    covariance: np.ndarray
    log_evidence: float
    reached: int


def starts(dimension: int, count: int, seed: int) -> np.ndarray:
    """Scrambled Sobol points of the prior, after its middle."""
    if dimension == 0:
        return np.zeros((1, 0))
    sobol = qmc.Sobol(dimension, rng=np.random.default_rng(seed))
    uniform = sobol.random_base2(max(1, int(np.ceil(np.log2(max(2, count))))))
    drawn = norm.ppf(np.clip(uniform, 0.02, 0.98))
    return np.concatenate([np.zeros((1, dimension)), drawn])[:count]


def descend(
    problem: Problem,
    points: np.ndarray,
    *,
    steps: int,
    logarithmic: bool = False,
    weight: np.ndarray | None = None,
) -> tuple[np.ndarray, Normal]:
    """Ends of several descents, and the normal equations there.

    Levenberg's and Marquardt's steps, each start with a damping of its own; one that no longer
    gains is left alone.
    """
    points = points.copy()
    here = problem.normal(points, logarithmic, weight)
    damping = np.full(len(points), 1e-3)
    moving = np.ones(len(points), dtype=bool)
    for _ in range(steps):
        some = np.flatnonzero(moving)
        trial = np.clip(points[some] + _steps(_at(here, some), damping[some]), -LARGEST, LARGEST)
        there = problem.normal(trial, logarithmic, weight)
        better = np.nan_to_num(there.cost, nan=np.inf) < here.cost[some]
        gained = np.where(better, here.cost[some] - there.cost, 0.0)
        points[some[better]] = trial[better]
        for whole, new in zip(here, there, strict=True):
            whole[some[better]] = new[better]
        damping[some] = np.clip(damping[some] * np.where(better, 0.2, 5.0), 1e-9, 1e9)
        moving[some] = ~((better & (gained < GAIN)) | (~better & (damping[some] > 1e2)))
        if not moving.any():
            break
    return points, here


def _at(normal: Normal, places: np.ndarray) -> Normal:
    return Normal(*(each[places] for each in normal))


def _steps(here: Normal, damping: np.ndarray) -> np.ndarray:
    diagonal = np.einsum("bii->bi", here.curvature)
    eye = np.eye(diagonal.shape[1])
    curvature = here.curvature + damping[:, None, None] * eye * diagonal[:, None]
    clean = np.nan_to_num(curvature, nan=0.0, posinf=0.0, neginf=0.0) + 1e-12 * eye
    return -np.linalg.solve(clean, np.nan_to_num(here.gradient)[..., None])[..., 0]


def best(points: np.ndarray, normal: Normal, data_count: int) -> Fit:
    """Laplace's approximation about the best end."""
    costs = np.nan_to_num(normal.cost, nan=np.inf)
    place = int(np.argmin(costs))
    covariance = np.linalg.inv(normal.curvature[place])
    volume = 0.5 * np.linalg.slogdet(covariance)[1]
    constant = -0.5 * data_count * np.log(2 * np.pi)
    return Fit(
        point=points[place],
        cost=float(costs[place]),
        squares=float(normal.squares[place]),
        covariance=covariance,
        log_evidence=float(constant - costs[place] + volume),
        reached=int(np.sum(costs < costs[place] + 0.5)),
    )
