"""_suspicion: in, a fitted experiment and scanned candidates; out, how suspect each place is.

Not known here: evidence, what is claimed. Rao's score test of every candidate at its weakest, along
all its places and settings at once, once all that the model can absorb is projected out.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import ndtri
from scipy.stats import norm

from ..effects._effect import Effect
from ..effects._library import kind_of
from ._hypotheses import PLACED, Hypothesis, Scanned, field_of, unknowns_of, weakest
from ._problem import Problem
from ._search import others

PLACES, SETTINGS = 41, 5
"""Points along a place and along any other unknown."""

MOST = 400
"""Greatest number of places and settings of one candidate."""

TRIALS = 2000
"""Draws of what chance does, for the correction for having looked in many places."""


class _Signatures(NamedTuple):
    points: np.ndarray
    unit: np.ndarray


def suspicion(null: Hypothesis, singles: Sequence[Scanned]) -> pd.DataFrame:
    """Score every candidate along its places and settings.

    Returns
    -------
    DataFrame
        One row for each place and setting: `kind`, `variant` (number), `at` [m] (NaN where the
        effect has no place), `score` (standard normal if nothing is missing), and `p_value` of
        the candidate, corrected for all its places and settings.
    """
    residual, _, slopes, _ = null.problem.slopes(null.fit.point[None])
    base = _Base(residual[0], slopes[0])
    frames = [_of_one(base, one, number) for number, one in enumerate(singles)]
    return pd.concat(frames, ignore_index=True)


class _Base:
    """Residual of the model as given, and the directions that it can absorb."""

    def __init__(self, residual: np.ndarray, slopes: np.ndarray):
        self.slopes = slopes
        self.curvature = slopes @ slopes.T + np.eye(len(slopes))
        self.start = residual
        self.residual = self.projected(residual[None])[0]

    def projected(self, vectors: np.ndarray) -> np.ndarray:
        """What the model cannot absorb, its prior included."""
        pull = vectors @ self.slopes.T
        return vectors - np.linalg.solve(self.curvature, pull.T).T @ self.slopes


def _of_one(base: _Base, single: Scanned, number: int) -> pd.DataFrame:
    effect = single.effect
    found = _signatures(base, single, effect)
    score = -found.unit @ base.residual
    corrected = _corrected(found.unit, score) if score.size else 1.0
    named = single.problem.coordinates.named(found.points)
    own = unknowns_of(effect, single.problem)
    values = {name: named[name] for name in own if name.endswith((".at", ".shift"))}
    places = next(iter(values.values()), np.full(len(score), np.nan))
    return pd.DataFrame(
        {"kind": kind_of(effect), "variant": number, "at": places, "score": score}
        | {"p_value": corrected}
    )


def _signatures(base: _Base, single: Scanned, effect: Effect) -> _Signatures:
    problem = single.problem
    points = _weak_points(problem, effect)
    rest = others(problem, unknowns_of(effect, problem))
    points[:, rest] = single.scan.points[0, rest]
    change = base.projected(problem.residuals(points)[0] - base.start)
    size = np.linalg.norm(change, axis=1, keepdims=True)
    largest = np.max(size, where=np.isfinite(size), initial=0.0)
    felt = (size[:, 0] > 1e-9 * largest) & np.isfinite(size[:, 0])
    return _Signatures(points[felt], change[felt] / size[felt])


def _weak_points(problem: Problem, effect: Effect) -> np.ndarray:
    columns = []
    for name in unknowns_of(effect, problem):
        place = problem.coordinates.places[name]
        word = field_of(effect, name)
        if place.stop - place.start > 1:
            axis = np.zeros(1)
        elif word == effect.absent[0] and word not in PLACED:
            axis = np.array([weakest(effect, problem, name)])
        else:
            count = PLACES if word in PLACED else SETTINGS
            axis = ndtri((np.arange(count) + 0.5) / count)
        columns.append((place.start, axis))
    grids = np.meshgrid(*(axis for _, axis in columns), indexing="ij") if columns else []
    points = np.zeros((grids[0].size if grids else 1, problem.dimension))
    for (place, _), grid in zip(columns, grids, strict=True):
        points[:, place] = grid.ravel()
    if len(points) > MOST:
        points = points[np.random.default_rng(0).choice(len(points), MOST, replace=False)]
    return points


def _corrected(unit: np.ndarray, score: np.ndarray) -> float:
    """Probability that the greatest score of a right model is as large.

    Scores of near places are alike, so that many places count as few: as many as make the
    greatest of so many independent scores as large as that of correlated draws.
    """
    greatest = float(np.max(np.abs(score)))
    rng = np.random.default_rng(0)
    values, vectors = np.linalg.eigh(unit @ unit.T)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    drawn = np.abs(rng.standard_normal((TRIALS, len(score))) @ root.T).max(axis=1)
    typical = float(np.median(drawn))
    count = max(1.0, np.log(0.5) / np.log1p(-2 * norm.sf(typical)))
    return float(-np.expm1(count * np.log1p(-min(2 * norm.sf(greatest), 1 - 1e-12))))
