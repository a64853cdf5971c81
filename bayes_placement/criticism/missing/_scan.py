"""Best fits from many starts: an effect is scanned through its prior first."""

import itertools
from collections import Counter
from typing import NamedTuple

import numpy as np
from scipy.stats import norm

from ...inference.engines.levenberg_marquardt import Fit, best_fit, minimise, sobol_starts
from ...inference.residuals import Problem
from ..kept_fits import ANY_FIT, stored_or_computed
from ._screening_lines import at_lines_of_descents, at_screening_lines, sample

MOST, LEAST = 1600, 400
"""Greatest number of points of a grid for all variants of a kind, and least for each."""

KEPT, TOGETHER = 128, 256
"""Points of a scan that are kept, those of the least predicted cost, and points that are scanned
together: residuals of all would be gigabytes."""

FOLLOWED, FINISHED, COPIES = 8, 3, 2
"""Starts that are followed along logarithmic residuals, of an effect of few unknowns; those
followed to the end, and of these the most that met: the others may lead to a mirror image."""

ABOUT_AS_GOOD = 0.05
"""Cost per datum above the least at some of the lines, up to which a descent goes on at all."""

NEAR = 0.5
"""Gain of log density of a step below which a start is near enough to be followed to the end."""


class Scan(NamedTuple):
    """An effect scanned through its prior, all else as it is without the effect.

    Parameters
    ----------
    points
        Points in the coordinates of the problem with the effect [point, unknown].
    residual
        Logarithmic residuals there, of a sample of the data [point, datum], see `sample`.
    predicted_cost
        Cost at each point once all else is fitted, as far as residuals are linear in it.
    """

    points: np.ndarray
    residual: np.ndarray
    predicted_cost: np.ndarray

    def best(self, count: int) -> "Scan":
        """Return the points of least predicted cost, at most so many."""
        cost = np.nan_to_num(self.predicted_cost, nan=np.inf)
        order = np.argsort(cost, kind="stable")[:count]
        return Scan(*(values[order] for values in self))

    def joined(self, other: "Scan") -> "Scan":
        """Return these points followed by others."""
        return Scan(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))


ANY_SCAN = Scan(np.zeros(0), np.zeros(0), np.zeros(0))
"""Its structure alone matters."""


class Fitted(NamedTuple):
    """A best fit, and the ends of descents along logarithmic residuals before it.

    Parameters
    ----------
    fit
        The fit.
    near
        The ends, those of least cost [start, unknown].
    """

    fit: Fit
    near: np.ndarray


ANY_FITTED = Fitted(ANY_FIT, np.zeros(0))
"""Its structure alone matters."""


def fit_alone(problem: Problem, seed: int = 0) -> Fitted:
    """Best fit of an experiment whose unknowns are all treated alike."""

    def fitted() -> Fitted:
        near = _near(problem, sobol_starts(problem.dimension, 16, seed))
        return Fitted(_followed(problem, near), near)

    return stored_or_computed(fitted, ANY_FITTED, problem, seed)


def fit_grown(
    problem: Problem, scan: Scan, further: np.ndarray, followed: int = FOLLOWED
) -> Fitted:
    """Best fit of an experiment with one more effect, from the best places of a scan.

    Parameters
    ----------
    problem
        The problem with the effect.
    scan
        The effect scanned.
    further
        Further starts [start, unknown], followed to the end as they are.
    followed
        Number of places that are followed.
    """
    places = best_places(scan, followed)

    def fitted() -> Fitted:
        near = _near(problem, places)
        return Fitted(_followed(problem, np.concatenate([near, further])), near)

    return stored_or_computed(fitted, ANY_FITTED, problem, places, further)


def best_places(scan: Scan, count: int = FOLLOWED) -> np.ndarray:
    """Points of least predicted cost [point, unknown]."""
    return scan.best(count).points


def scan(
    problem: Problem, counts: dict[str, int], base: np.ndarray, slopes: np.ndarray, most: int
) -> Scan:
    """Scan an effect through the prior of its own unknowns.

    Parameters
    ----------
    problem
        The problem with the effect.
    counts
        Its unknowns, and the number of points along each.
    base
        Coordinates [unknown] of the problem, of which those of all other unknowns are taken.
    slopes
        Slopes of the logarithmic residuals without the effect [unknown, datum], along which all
        other unknowns are refitted.
    most
        Greatest number of points.
    """
    grid = _grid(problem, counts, most)
    columns = other_places(problem, list(counts))
    grid[:, columns] = base[columns]
    parts = (grid[begin : begin + TOGETHER] for begin in range(0, len(grid), TOGETHER))
    best = _scanned(problem, next(parts), slopes)
    for points in parts:
        best = best.joined(_scanned(problem, points, slopes)).best(KEPT)
    return best


def _scanned(problem: Problem, points: np.ndarray, slopes: np.ndarray) -> Scan:
    """The best of some points."""
    residual, _ = at_screening_lines(problem).squares.residuals(points, True)
    curvature = slopes @ slopes.T + np.eye(len(slopes))
    pull = residual @ slopes.T
    absorbed = np.einsum("bi,bi->b", pull, np.linalg.solve(curvature, pull.T).T)
    predicted_cost = 0.5 * (np.einsum("bn,bn->b", residual, residual) - absorbed)
    best = Scan(points, residual, predicted_cost).best(KEPT)
    return best._replace(residual=sample(best.residual).astype(np.float32))


def other_places(problem: Problem, names: list[str]) -> np.ndarray:
    """Places of the unknowns that are not among those named."""
    slices = [problem.coordinates.places[name] for name in names]
    named = [place for part in slices for place in range(part.start, part.stop)]
    return np.setdiff1d(np.arange(problem.dimension), named)


def _followed(problem: Problem, starts: np.ndarray) -> Fit:
    """Best of the descents from all starts: at some of many lines first, at all lines then."""
    screened = at_lines_of_descents(problem)
    if screened is not problem:
        fewer = screened.squares.objective()
        starts, normal = minimise(fewer, starts, steps=40, gain=NEAR, count=problem.count)
        behind = normal.cost - np.nanmin(normal.cost, initial=np.inf)
        starts = starts[~(behind > ABOUT_AS_GOOD * problem.count)]
    ends, final = minimise(problem.squares.objective(), starts, steps=40, count=problem.count)
    return best_fit(ends, final, problem.count)


def _near(problem: Problem, points: np.ndarray) -> np.ndarray:
    """The best ends of descents along logarithmic residuals."""
    objective = at_lines_of_descents(problem).squares.objective(logarithmic=True)
    ends, normal = minimise(objective, points, steps=10, gain=NEAR)
    best = ends[np.argsort(np.nan_to_num(normal.cost, nan=np.inf), kind="stable")]
    copies: Counter[bytes] = Counter()
    is_kept = []
    for end in best:
        copies[end.tobytes()] += 1
        is_kept.append(copies[end.tobytes()] <= COPIES)
    return best[is_kept][:FINISHED]


def _grid(problem: Problem, counts: dict[str, int], most: int) -> np.ndarray:
    """Points in the middle of cells of equal prior probability; a random part of too many."""
    axes = [norm.ppf((np.arange(count) + 0.5) / count) for count in counts.values()]
    rows = (
        np.array(list(itertools.product(*axes))).reshape(-1, len(axes))
        if axes
        else np.zeros((1, 0))
    )
    if len(rows) > most:
        rows = rows[np.random.default_rng(0).choice(len(rows), most, replace=False)]
    grid = np.zeros((len(rows), problem.dimension))
    for column, name in enumerate(counts):
        grid[:, problem.coordinates.places[name]] = rows[:, column, None]
    return grid
