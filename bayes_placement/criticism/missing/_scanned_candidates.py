"""One more effect on a hypothesis: scanned through its prior, then fitted from its best places."""

import functools
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ...effects.effect import Effect
from ...effects.library import kind_of
from ...inference.engines.empirical_bayes import SOFTENING, Rival
from ...inference.residuals import Problem, fields_of
from ..kept_fits import NO_RIVAL, is_stored, kept_with_sizes, stored_or_computed
from ._candidates import numbered
from ._compiled_ahead import compiled_ahead
from ._hypotheses import Hypothesis, logarithmic_jacobian, softening
from ._scan import ANY_SCAN, FOLLOWED, LEAST, MOST, Scan, best_places, fit_grown, scan
from ._screening_lines import at_screening_lines

PLACES, PLACES_ACROSS, STRENGTHS, SETTINGS, MORE_SETTINGS = 21, 11, 5, 4, 6
"""Points along a place, each coordinate of one on a surface, a strength, a setting, and a setting
where there is no place."""

WEAKEST = np.array([-3.0, -1.0, -0.3, -0.05, 0.05, 0.3, 1.0, 3.0])
"""Coordinates of a strength, of which the one nearest to absence is taken for weak."""

FEW_UNKNOWNS = 2
"""Unknowns of an effect, such as a place and a size; with each further one twice as many places of
a scan are followed, since a grid of as many points is coarser in each."""

PLACES_WITH_ERRORS = 4
"""Best places of a scan from which an effect is fitted together with a model error."""

Tick = Callable[[], None]


class ScannedCandidate(NamedTuple):
    """One more effect on a hypothesis, scanned through its prior but not yet fitted.

    Parameters
    ----------
    base
        The hypothesis without it.
    effect
        The effect, under a free name.
    problem
        The least-squares problem with it.
    scan
        Its scan.
    scores
        How suspicious its places and settings are, see `suspicion`; None where that is not known.
    """

    base: Hypothesis
    effect: Effect
    problem: Problem
    scan: Scan
    scores: pd.DataFrame | None = None

    @property
    def predicted_cost(self) -> float:
        """Least cost that the scan predicts for its fit."""
        return float(np.nanmin(self.scan.predicted_cost, initial=np.inf))


Pair = tuple[Hypothesis, Effect]
"""A hypothesis and an effect to add to it."""


def with_free_names(pairs: Sequence[Pair]) -> list[Pair]:
    """Give each effect a name that the hypothesis does not have yet."""
    return [
        (base, numbered(effect, {present.name for present in base.problem.experiment.effects}))
        for base, effect in pairs
    ]


def points_of_scans(effects: Iterable[Effect]) -> dict[str, int]:
    """Greatest number of points of a scan by kind: its variants share them, as their prior."""
    tried = list(effects)
    long = {kind_of(effect) for effect in tried if effect.tried_last}
    return {
        kind: LEAST if kind in long else max(MOST // count, LEAST)
        for kind, count in Counter(map(kind_of, tried)).items()
    }


def scanned(
    pairs: Sequence[Pair], tick: Tick, points: Mapping[str, int] | None = None
) -> Iterator[ScannedCandidate]:
    """Scan effects on hypotheses, in their order. Meanwhile the next ones are compiled.

    Parameters
    ----------
    pairs
        Hypotheses and effects.
    tick
        Called after each of them.
    points
        Greatest number of points by kind, where there are other pairs than these.
    """
    most = points or points_of_scans(effect for _, effect in pairs)
    scannings = (
        _Scanning(base, effect, base.problem.with_effect(effect), most[kind_of(effect)])
        for base, effect in with_free_names(pairs)
    )
    for scanning in compiled_ahead(scannings):
        yield scanning.scanned()
        tick()


@dataclass(frozen=True)
class _Scanning:
    """An effect on a hypothesis, to be scanned at a greatest number of points."""

    base: Hypothesis
    effect: Effect
    problem: Problem
    most: int

    def prepare(self) -> None:
        """Compile the residuals, unless the scan is kept in a folder."""
        if not is_stored(self.problem, *self._inputs):
            at_screening_lines(self.problem).prepare()

    def scanned(self) -> ScannedCandidate:
        """Scan it, or take the scan from the folder."""
        found = stored_or_computed(self._scan, ANY_SCAN, self.problem, *self._inputs)
        return ScannedCandidate(self.base, self.effect, self.problem, found)

    @functools.cached_property
    def _inputs(self) -> tuple[Any, ...]:
        counts = _counts(self.effect, fields_of(self.effect, self.problem), self.problem)
        return counts, self.base.point_in(self.problem), self.most

    def _scan(self) -> Scan:
        counts, point, most = self._inputs
        slopes = logarithmic_jacobian(self.base).slopes[0]
        return scan(self.problem, counts, point, slopes, most)


def promising(candidates: Sequence[ScannedCandidate], variants: int) -> list[ScannedCandidate]:
    """A few variants of each kind: those of which the scan predicts the least cost."""
    count: Counter[str] = Counter()
    promising = []
    for candidate in sorted(candidates, key=lambda candidate: candidate.predicted_cost):
        kind = kind_of(candidate.effect)
        count[kind] += 1
        if count[kind] <= variants:
            promising.append(candidate)
    return promising


def fitted(candidate: ScannedCandidate, rival: Rival = NO_RIVAL) -> Hypothesis:
    """Fit a candidate that was scanned; with model error, see `with_errors`."""
    base, effect, problem, scan, _ = candidate
    weak = _weak_start(effect, problem, base)
    effects = (*base.effects, effect)
    if not base.has_errors:
        fit = fit_grown(problem, scan, weak[None], _followed(effect, problem))
        return Hypothesis(effects, problem, *fit)
    starts = np.concatenate([best_places(scan)[:PLACES_WITH_ERRORS], weak[None]])
    sized = kept_with_sizes(problem, starts, softening(problem, SOFTENING[-2:]), rival)
    return Hypothesis(effects, has_errors=True, **vars(sized))


def _followed(effect: Effect, problem: Problem) -> int:
    """Number of places of a scan that are followed: more where it is coarse in many unknowns."""
    further = len(fields_of(effect, problem)) - FEW_UNKNOWNS
    return FOLLOWED if effect.tried_last else FOLLOWED * 2 ** max(0, further)


def _weak_start(effect: Effect, problem: Problem, base: Hypothesis) -> np.ndarray:
    """The fit without the effect, and the effect at its weakest: about as good as without."""
    start = base.point_in(problem)
    for name, word in fields_of(effect, problem).items():
        if word == effect.absent[0]:
            start[problem.coordinates.places[name]] = weakest(effect, problem, name)
    return start


def weakest(effect: Effect, problem: Problem, name: str) -> float:
    """Coordinate of the least strength of an effect, of one sign."""
    points = np.zeros((len(WEAKEST), problem.dimension))
    points[:, problem.coordinates.places[name]] = WEAKEST[:, None]
    values = problem.coordinates.named(points)[name].reshape(len(WEAKEST), -1)[:, 0]
    absent = effect.absent[1]
    distance = -np.abs(values) if np.isinf(absent) else np.abs(values - absent)
    return float(WEAKEST[int(np.argmin(distance))])


def _counts(effect: Effect, fields: dict[str, str], problem: Problem) -> dict[str, int]:
    """Number of points along each unknown of an effect."""
    sized = {name: problem.coordinates.places[name] for name in fields}
    coordinates = sum(word in effect.place_fields for word in fields.values())

    def count(name: str) -> int:
        if sized[name].stop - sized[name].start > 1:
            return 1
        if fields[name] in effect.place_fields:
            return PLACES if coordinates == 1 else PLACES_ACROSS
        if fields[name] == effect.absent[0]:
            return STRENGTHS if coordinates else 4 * STRENGTHS
        return SETTINGS if coordinates else MORE_SETTINGS

    return {name: count(name) for name in fields}
