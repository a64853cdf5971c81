"""How well a fitted hypothesis predicts data that it was not fitted to.

Left out are one channel at a time, of sensors or of hits of a roved hammer, and one frequency band
at a time; each time the fit is corrected from where it was.
"""

import functools
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from ...experiment.noise import Covariance
from ...inference.engines.least_squares import SquaresAndPrior
from ...inference.engines.levenberg_marquardt import minimise
from ...inference.residuals import Problem
from ._hypotheses import Hypothesis

BANDS = 4
"""Frequency bands, of as many lines each."""

STEPS = 6


def held_out(hypothesis: Hypothesis) -> float:
    """Mean log density of held-out data, in nats a real datum, in units of their deviation.

    The density of what is held out is Laplace's: Gaussian, with the uncertainty of the fit to the
    other data. It is comparable between models of the same data and the same noise. NaN where
    nothing can be held out: one sensor and one line.
    """
    scores = _scores(hypothesis)
    return float(np.mean(scores)) if scores.size else float("nan")


def gain_held_out(hypothesis: Hypothesis, other: Hypothesis) -> tuple[float, float]:
    """Gain of `held_out` over that of another hypothesis, and its standard error over the folds.

    NaN where there are no two folds.
    """
    gains = _scores(hypothesis) - _scores(other)
    if gains.size < 2:
        return float("nan"), float("nan")
    return float(np.mean(gains)), float(np.std(gains, ddof=1) / np.sqrt(gains.size))


@functools.lru_cache(maxsize=32)  # asked for by the search and by the ledger
def _scores(hypothesis: Hypothesis) -> Float[np.ndarray, "fold"]:
    """Mean log density of a datum of each fold, of which something is left to fit to."""
    problem = hypothesis.problem
    measured = np.asarray(problem.data.measured).ravel()
    folds = [problem.of_experiment(fold & measured) for fold in _folds(problem)]
    is_linear = hypothesis.is_noise_known and not hypothesis.has_errors
    score = _score if is_linear else _evidence_ratio
    scores = [
        score(hypothesis, fold)
        for fold in folds
        if fold.any() and (problem.of_experiment(measured) & ~fold).any()
    ]
    return np.array(scores)


def _folds(problem: Problem) -> Iterator[np.ndarray]:
    """Which data are held out, one fold after the other."""
    shape = np.shape(problem.data.z)
    sensors, actuators = shape[:2]
    channels = sensors if sensors > 1 else actuators
    for channel in range(channels if channels > 1 else 0):
        fold = np.zeros(shape, dtype=bool)
        fold[channel if sensors > 1 else (slice(None), channel)] = True
        yield fold.ravel()
    for lines in np.array_split(np.arange(shape[-1]), BANDS):
        fold = np.zeros(shape, dtype=bool)
        fold[..., lines] = True
        yield fold.ravel()


def _evidence_ratio(hypothesis: Hypothesis, fold: np.ndarray) -> float:
    """Evidence of all data over that of the other data, each by Laplace's method about its own fit.

    Errors of what is held out go back to their prior, much farther than slopes hold.
    """
    problem, fit = hypothesis.problem, hypothesis.fit
    training, level = _training(hypothesis, fold)
    _, normal = minimise(training, fit.point[None], steps=2 * STEPS)
    log_evidence = -normal.cost[0] - 0.5 * np.linalg.slogdet(normal.curvature[0])[1]
    all_data = -fit.cost + fit.gaussian.log_volume - 0.5 * problem.dimension * np.log(2 * np.pi)
    count = int(fold.sum())
    return float((all_data - log_evidence) / count - 0.5 * np.log(2 * np.pi) - level)


def _training(hypothesis: Hypothesis, fold: np.ndarray) -> tuple[SquaresAndPrior, float]:
    """What a fit to the other data minimises, and the log deviation a datum that it leaves out.

    Unknown noise is fitted to the remaining data alone. Known noise, and noise that allows no gaps,
    stays as it is.
    """
    problem = hypothesis.problem
    data, noise = problem.data, problem.experiment.noise
    assert noise is not None
    remaining = np.asarray(data.measured) & ~fold[: data.z.size].reshape(data.z.shape)
    if hypothesis.is_noise_known or isinstance(noise, Covariance):
        _, log_scale = problem.squares.residuals(hypothesis.fit.point[None])
        weight = (~fold).astype(float)
        return problem.squares.objective(weight=weight), log_scale[0] / problem.count
    return problem.with_measured(remaining).squares.objective(), 0.0


def _score(hypothesis: Hypothesis, fold: np.ndarray) -> float:
    problem = hypothesis.problem
    training = problem.squares.objective(weight=(~fold).astype(float))
    point, normal = minimise(training, hypothesis.fit.point[None], steps=STEPS)
    residual, spread, slopes, _ = problem.squares.jacobian(point)
    error, slope = residual[0][fold], slopes[0][:, fold]
    curvature = normal.curvature[0]
    after = curvature + slope @ slope.T
    pull = slope @ error
    # Inverse and determinant of 1 + J C J^T by those of the small matrix.
    squares = error @ error - pull @ np.linalg.solve(after, pull)
    volume = np.linalg.slogdet(after)[1] - np.linalg.slogdet(curvature)[1]
    count = int(fold.sum())
    level = spread[0] / problem.count
    return float(-0.5 * (squares + volume) / count - 0.5 * np.log(2 * np.pi) - level)
