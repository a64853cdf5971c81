"""Rao's score test of every candidate at its weakest, along all its places and settings.

What the model can absorb is projected out. A vector of strengths is tested component by component,
and the p-value is corrected for their number as for that of places.
"""

import functools
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy.special import ndtr, ndtri

from ..._shared.sites import Role
from ...effects.effect import Effect
from ...effects.library import kind_of
from ...inference.engines.least_squares import Jacobian
from ...inference.residuals import Problem, fields_of
from ..kept_fits import key_of, stored_or_computed
from ..locations import locations
from ._hypotheses import Hypothesis
from ._linear import Linear
from ._scanned_candidates import ScannedCandidate, weakest

PLACES = {1: 41, 2: 17, 3: 7}
"""Points along each coordinate of a place that has so many."""

SETTINGS = 5
"""Points along any other unknown."""

MOST, LEAST = 400, 100
"""Greatest number of places and settings for all variants of a kind, and least for each."""

COLUMNS = ["kind", "variant", "setting", "at", "x", "y", "z", "score", "p_value"]

ABSORBED = 1e-4
"""Share of the squares of its change that is left where the model does the same by itself."""

STEP = 0.1
"""Step of a component of a vector of strengths [standard deviations of its prior]. That is large
against rounding; the size of a change does not count in a score."""

ROUNDING = float(np.sqrt(np.finfo(float).eps))
"""Change [standard deviations of the noise, over all data] below which it may be rounding alone."""

TRIALS = 2000
"""Draws of what chance does, for the correction for having looked in many places."""


class _Signatures(NamedTuple):
    """What an effect changes at its weakest, beyond what the model can absorb.

    Points [place, unknown] are places and settings of the effect to which it is sensitive; of a
    vector of strengths each as often as there are components. Each has a score; these have a
    correlation [place, place].
    """

    points: np.ndarray
    score: np.ndarray
    correlation: np.ndarray


class _Scores(NamedTuple):
    """Scores of a candidate at places and settings that it is sensitive to [place, unknown]."""

    points: np.ndarray
    score: np.ndarray
    p_value: float


ANY_SCORES = _Scores(np.zeros((0, 0)), np.zeros(0), 1.0)
"""Its structure alone matters."""


def suspicion(null: Hypothesis, candidates: Sequence[ScannedCandidate]) -> pd.DataFrame:
    """Score every candidate along its places and settings.

    There is a row for each place and setting, and each component of a vector of strengths: `kind`,
    `variant` (number), `setting` (words for what of the structure or which sensor it is about),
    `at` [m] (place on a line or shift of a sensor; NaN where there is none), `x`, `y`, `z` [m]
    (place of the effect, or of the sensor, support, member or region that it is about; NaN where
    not known, and for y and z on a line), `score` (standard normal if nothing is missing), and
    `p_value` of the candidate, corrected for all its places, settings and components.
    """
    known = [candidate.scores for candidate in candidates if candidate.scores is not None]
    frames = known if len(known) == len(candidates) else scores(null, candidates)
    numbered = [frame.assign(variant=number) for number, frame in enumerate(frames)]
    return pd.concat(numbered, ignore_index=True)[COLUMNS]


def scores(null: Hypothesis, candidates: Sequence[ScannedCandidate]) -> list[pd.DataFrame]:
    """Score candidates, all variants of each kind among them, see `suspicion`."""
    model = _Model(null)
    variants = Counter(kind_of(candidate.effect) for candidate in candidates)
    most = [max(MOST // variants[kind_of(candidate.effect)], LEAST) for candidate in candidates]
    return [
        _table(candidate, _scored(model, candidate, points))
        for candidate, points in zip(candidates, most, strict=True)
    ]


def _moves_response(problem: Problem) -> np.ndarray:
    """Tell which coordinates move the response, rather than the level of the noise.

    A higher level scales all residuals down, as if it explained them; the information on it is
    independent of that on the response.
    """
    moves = np.ones(problem.dimension, dtype=bool)
    for name, unknown in (problem.experiment.unknown | problem.further_unknowns).items():
        if unknown.role is Role.OUTPUT_ERROR and name in problem.coordinates.places:
            moves[problem.coordinates.places[name]] = False
    return moves


class _Model:
    """Residual of the fitted model as given, and the directions that it can absorb."""

    def __init__(self, null: Hypothesis):
        self.null = null

    @functools.cached_property
    def key(self) -> str | None:
        """Hash of what scores of all candidates have in common."""
        return key_of(self.null.problem, self.null.fit.point)

    @functools.cached_property
    def _at_fit(self) -> Jacobian:
        return self.null.problem.squares.jacobian(self.null.fit.point[None])

    @functools.cached_property
    def residual(self) -> np.ndarray:
        """Its residual [datum]."""
        return self._at_fit.residual[0]

    @functools.cached_property
    def slopes(self) -> np.ndarray:
        """Slopes of the residual [unknown, datum], without those along the level of the noise."""
        return self._at_fit.slopes[0][_moves_response(self.null.problem)]

    @functools.cached_property
    def linear(self) -> Linear:
        """It, linear in what the model can absorb."""
        return Linear(self.residual, self.slopes)


def _scored(model: _Model, candidate: ScannedCandidate, most: int) -> _Scores:
    """Score a candidate, or take its scores from the folder of fits."""

    def anew() -> _Scores:
        points, score, correlation = _signatures(model, candidate, most)
        return _Scores(points, score, _corrected(correlation, score) if score.size else 1.0)

    inputs = model.key, most
    return stored_or_computed(anew, ANY_SCORES, candidate.part.problem, *inputs)


def _table(candidate: ScannedCandidate, scored: _Scores) -> pd.DataFrame:
    effect, (points, score, p_value) = candidate.effect, scored
    problem = candidate.part.problem
    named = problem.coordinates.named(points)
    unknowns = problem.experiment.unknowns_of(effect)
    values = {unknown.name: named[unknown.name] for unknown in unknowns}
    lengths = (
        named[unknown.name]
        for unknown in unknowns
        if unknown.field in effect.place_fields and not unknown.component
    )
    placed, experiment = candidate.placed
    setting = placed.setting(experiment.structure.modes, experiment.instruments)
    x, y, z = locations(placed, experiment, values, len(score)).T
    return pd.DataFrame(
        {"kind": kind_of(effect), "setting": setting}
        | {"at": next(lengths, np.full(len(score), np.nan)), "x": x, "y": y, "z": z}
        | {"score": score, "p_value": p_value}
    )


def _signatures(model: _Model, candidate: ScannedCandidate, most: int) -> _Signatures:
    part, effect = candidate.part, candidate.effect
    points = weak_points(part.problem, effect, most)
    others = np.setdiff1d(np.arange(part.problem.dimension), part.columns)
    points[:, others] = part.point[others]
    residual = model.residual[part.data]
    points, change = changes(part.problem, effect, points, residual)
    information = model.linear.information(change, part.data)
    # Residuals of a fit have the covariance of the projection: it is not applied to them again.
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    largest = np.max(size, where=np.isfinite(size), initial=0.0)
    absorbed = size**2 <= ABSORBED * np.einsum("pn,pn->p", change, change)
    is_sensitive = (size > max(1e-9 * largest, ROUNDING)) & np.isfinite(size) & ~absorbed
    scale = size[is_sensitive]
    return _Signatures(
        points[is_sensitive],
        -(change @ residual)[is_sensitive] / scale,
        information[np.ix_(is_sensitive, is_sensitive)] / np.outer(scale, scale),
    )


def changes(
    problem: Problem, effect: Effect, points: np.ndarray, residual: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return what an effect at its weakest changes, by points.

    Of a vector of strengths each component is changed by itself: at its weakest, which may be zero,
    all of them together may change nothing but the rounding.

    Points [place, unknown] are those at which it is weak, the residual is without it. Points
    [change, unknown] come back, those of a vector as often as it has components; and the changes
    [change, datum].
    """
    after, _ = problem.squares.residuals(points)
    components = _components(problem, effect)
    if len(components) < 2:
        after -= residual  # in place, as it is large
        return points, after
    steps = STEP * np.eye(problem.dimension)[components]
    change, _ = problem.squares.residuals((points[:, None] + steps).reshape(-1, problem.dimension))
    change -= np.repeat(after, len(components), axis=0)
    return np.repeat(points, len(components), axis=0), change


def _components(problem: Problem, effect: Effect) -> np.ndarray:
    """Places of the strength of an effect among the coordinates."""
    places = problem.coordinates.places
    strengths = [
        np.arange(places[name].start, places[name].stop)
        for name, word in fields_of(effect, problem).items()
        if word == effect.absent[0]
    ]
    return np.concatenate([np.zeros(0, dtype=int), *strengths])


def weak_points(problem: Problem, effect: Effect, most: int) -> np.ndarray:
    """Coordinates of an effect at its weakest, along its places and settings; of all else zero."""
    columns, fields = [], fields_of(effect, problem)
    coordinates = sum(field in effect.place_fields for field in fields.values())
    for name, word in fields.items():
        place = problem.coordinates.places[name]
        if word == effect.absent[0] and word not in effect.place_fields:
            axis = np.array([weakest(effect, problem, name)])
        elif place.stop - place.start > 1:
            axis = np.zeros(1)
        else:
            count = PLACES.get(coordinates, 5) if word in effect.place_fields else SETTINGS
            axis = ndtri((np.arange(count) + 0.5) / count)
        columns.append((place, axis))
    grids = np.meshgrid(*(axis for _, axis in columns), indexing="ij") if columns else []
    points = np.zeros((grids[0].size if grids else 1, problem.dimension))
    for (place, _), grid in zip(columns, grids, strict=True):
        points[:, place] = grid.reshape(-1, 1)
    if len(points) > most:
        points = points[np.random.default_rng(0).choice(len(points), most, replace=False)]
    return points


def _corrected(correlation: np.ndarray, score: np.ndarray) -> float:
    """Probability that the greatest score of a correct model is as large.

    Scores of neighbouring places are correlated. The number of places is therefore replaced by the
    number of independent scores whose greatest is as large as that of correlated draws.
    """
    greatest = float(np.max(np.abs(score)))
    rng = np.random.default_rng(0)
    values, vectors = np.linalg.eigh(correlation)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    drawn = np.abs(rng.standard_normal((TRIALS, len(score))) @ root.T).max(axis=1)
    typical = float(np.median(drawn))
    count = max(1.0, np.log(0.5) / np.log1p(-2 * ndtr(-typical)))
    return float(-np.expm1(count * np.log1p(-min(2 * ndtr(-greatest), 1 - 1e-12))))
