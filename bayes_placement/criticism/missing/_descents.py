"""Best fits from many starts: along logarithmic residuals first, at some of many lines."""

from collections import Counter
from typing import NamedTuple

import numpy as np

from ...inference.engines.levenberg_marquardt import Fit, best_fit, minimise, sobol_starts
from ...inference.residuals import Problem
from ..kept_fits import FIT_LAYOUT, stored_or_computed
from ..screening_lines import at_lines_of_descents

FOLLOWED, FINISHED, COPIES = 8, 3, 2
"""Starts that are followed along logarithmic residuals, of an effect of few unknowns; those
followed to the end, and of these the most that met: the others may lead to a mirror image."""

ABOUT_AS_GOOD = 0.05
"""Cost per datum above the least at some of the lines, up to which a descent goes on at all."""

NEAR = 0.5
"""Gain of log density of a step below which a start is near enough to be followed to the end."""


class Fitted(NamedTuple):
    """A best fit, and the ends [start, unknown] of descents along logarithmic residuals before it.

    Those ends are of least cost.
    """

    fit: Fit
    near: np.ndarray


FITTED_LAYOUT = Fitted(FIT_LAYOUT, np.zeros(0))
"""Its structure alone matters."""


def fit_alone(problem: Problem, seed: int = 0) -> Fitted:
    """Best fit of an experiment whose unknowns are all treated alike."""

    def fitted() -> Fitted:
        near = _near(problem, sobol_starts(problem.dimension, 16, seed))
        return Fitted(_followed(problem, near), near)

    return stored_or_computed(fitted, FITTED_LAYOUT, problem, seed)


def fit_grown(problem: Problem, places: np.ndarray, further: np.ndarray) -> Fitted:
    """Best fit of an experiment with one more effect, from the best places of a scan.

    Places [start, unknown] are followed along logarithmic residuals first, further starts to the
    end as they are.
    """

    def fitted() -> Fitted:
        near = _near(problem, places)
        return Fitted(_followed(problem, np.concatenate([near, further])), near)

    return stored_or_computed(fitted, FITTED_LAYOUT, problem, places, further)


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
