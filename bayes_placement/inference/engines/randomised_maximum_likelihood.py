"""Weighted draws of a posterior along its ridges: randomise the data, then minimise.

Bardsley, Solonen, Haario and Laine (2014, doi:10.1137/140964023). An angle about the axis along
which a sensor reads is hardly known, and others must follow it on a curve much narrower than it is
long. No Gaussian has that shape, and random walks do not get along it; least squares with
randomised data do.
"""

from typing import NamedTuple

import numpy as np

from .least_squares import LeastSquares, ParameterPoints
from .levenberg_marquardt import LARGEST, Fit

DRAWS, BLOCK = 192, 16
"""Draws, and those that are found together, at most."""

MOST_SLOPES = 2**25
"""Slopes of those that are found together: a quarter of a gigabyte."""

ROUNDS, CHORDS = 4, 3
"""Evaluations of the slopes, and steps that are made with those of each."""

ARRIVED = 0.01
"""Distance from its target, in standard deviations, at which a draw is found."""

LOST = 0.05
"""Share of draws that may be lost on the way."""


class Weighted(NamedTuple):
    """Draws [draw, unknown], and the log of posterior density over that of the draws [draw]."""

    points: np.ndarray
    log_weight: np.ndarray


class _State(NamedTuple):
    """Image of each point, the slopes of the image, and the log of the posterior density."""

    image: np.ndarray
    slopes: np.ndarray
    log_posterior: np.ndarray


class _Image:
    """Residuals and coordinates, prior included, seen along their slopes at the fit: Q^T F."""

    def __init__(self, problem: LeastSquares, fit: Fit):
        self.problem = problem
        slopes = problem.jacobian(fit.point[None]).slopes[0]
        jacobian = np.concatenate([np.eye(problem.dimension), slopes.T])
        self.axes, self.root = np.linalg.qr(jacobian)
        self.of_point, self.of_residual = np.split(self.axes, [problem.dimension])

    def image(self, points: ParameterPoints, residual: np.ndarray) -> np.ndarray:
        """Q^T F [point, unknown], a standard normal vector if the problem is linear."""
        return points @ self.of_point + residual @ self.of_residual

    def at(self, points: ParameterPoints) -> _State:
        """Image, slopes and density of points."""
        residual, log_scale, slopes, _ = self.problem.jacobian(points)
        slopes_of_image = self.of_point.T + (slopes @ self.of_residual).transpose(0, 2, 1)
        density = self.problem.log_density(points, residual, log_scale)
        return _State(self.image(points, residual), slopes_of_image, density)

    def chord(self, points: ParameterPoints, state: _State, target: np.ndarray) -> ParameterPoints:
        """Move points towards those that have the target as image, by slopes from nearby."""
        image = state.image
        for _ in range(CHORDS):
            step = np.linalg.solve(state.slopes, (target - image)[..., None])[..., 0]
            points = np.clip(points + np.nan_to_num(step), -2 * LARGEST, 2 * LARGEST)
            image = self.image(points, self.problem.residuals(points)[0])
        return points


def randomised_maximum_likelihood(problem: LeastSquares, fit: Fit, seed: int) -> Weighted | None:
    """Weighted draws about a fit of known noise; None where too many of them are not found."""
    image = _Image(problem, fit)
    target = np.random.default_rng(seed).standard_normal((DRAWS, problem.dimension))
    together = min(BLOCK, max(1, MOST_SLOPES // max(1, problem.dimension * problem.count)))
    parts = np.array_split(target, -(-DRAWS // together))
    blocks = [_solved(image, fit.point, block) for block in parts]
    points, log_weight = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    if np.mean(np.isneginf(log_weight)) > LOST:
        return None
    return Weighted(points, log_weight)


def _solved(image: _Image, mode: np.ndarray, target: np.ndarray) -> Weighted:
    """Points whose image is the target."""
    points = mode + np.linalg.solve(image.root, target.T).T
    state = image.at(points)
    for _ in range(ROUNDS):
        if _distance(state, target).max() < ARRIVED:
            break
        points = image.chord(points, state, target)
        state = image.at(points)
    with np.errstate(invalid="ignore"):  # where the model is not finite no draw has arrived
        log_slope = np.linalg.slogdet(state.slopes)[1]
    volume = log_slope - 0.5 * target.shape[1] * np.log(2 * np.pi)
    log_density = volume - 0.5 * np.einsum("bi,bi->b", state.image, state.image)
    arrived = np.isfinite(state.log_posterior) & (_distance(state, target) < ARRIVED)
    return Weighted(points, np.where(arrived, state.log_posterior - log_density, -np.inf))


def _distance(state: _State, target: np.ndarray) -> np.ndarray:
    return np.nan_to_num(np.abs(state.image - target), nan=np.inf).max(axis=1)
