"""One more effect on a hypothesis: scanned through its prior, then fitted from its best places."""

import dataclasses
import functools
import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from ...effects.effect import OF_CHANNELS, Effect
from ...effects.instrument_effect import InstrumentEffect
from ...effects.library import kind_of
from ...experiment.experiment import Experiment
from ...inference.engines.empirical_bayes import DECREASING_ERRORS, Rival
from ...inference.residuals import Problem, fields_of
from ..kept_fits import NO_RIVAL, is_stored, kept_with_sizes, key_of, stored_or_computed
from ._at_channels import EffectAtData, at_all_lines, at_lines_of_scans, own_columns
from ._candidates import numbered
from ._compiled_ahead import compiled_ahead
from ._descents import FOLLOWED, fit_grown
from ._hypotheses import Hypothesis, decreasing_errors, linear_logarithmic
from ._scan import ANY_SCAN, LEAST, MOST, Scan, scan

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


@dataclasses.dataclass(frozen=True, eq=False)
class ScannedCandidate:
    """One more effect on a hypothesis, scanned through its prior but not yet fitted.

    The hypothesis is without it; the effect has a free name. `scores` tell how suspicious its
    places and settings are, see `suspicion`, None where that is not known.
    """

    base: Hypothesis
    effect: Effect
    scan: Scan
    scores: pd.DataFrame | None = None

    @functools.cached_property
    def problem(self) -> Problem:
        """The least-squares problem with it."""
        return self.base.problem.with_effect(self.effect)

    @functools.cached_property
    def part(self) -> EffectAtData:
        """It at all lines of the channels that it changes."""
        return at_all_lines(self.base, self.effect)

    @property
    def placed(self) -> tuple[Effect, Experiment]:
        """The effect as an experiment has it, and one with all instruments that tells its place."""
        experiment = self.base.problem.experiment
        if isinstance(self.effect, InstrumentEffect):
            numbered = self.effect.numbered(experiment.instruments)
            return numbered.on(experiment.structure.modes), experiment
        experiment = self.problem.experiment
        named = {each.name: each for each in experiment.effects}
        return named[self.effect.name], experiment

    def best_places(self, count: int) -> np.ndarray:
        """Coordinates [point, unknown] of least predicted cost."""
        points = np.repeat(self.base.point_in(self.problem)[None], count, axis=0)
        best = self.scan.best(count).points
        points[: len(best), own_columns(self.effect, self.problem)] = best
        return points[: len(best)]

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
    long = {kind_of(effect) for effect in tried if effect.takes_long}
    return {
        kind: LEAST if kind in long else max(MOST // count, LEAST)
        for kind, count in Counter(map(kind_of, tried)).items()
    }


def scanned(
    pairs: Sequence[Pair], tick: Tick, points: Mapping[str, int] | None = None
) -> Iterator[ScannedCandidate]:
    """Scan effects on hypotheses, in their order. Meanwhile the next ones are compiled.

    `tick` is called after each of them. `points` is their greatest number by kind, where there are
    other pairs than these.
    """
    most = points or points_of_scans(effect for _, effect in pairs)
    scannings = (
        _Scanning(base, effect, most[kind_of(effect)]) for base, effect in with_free_names(pairs)
    )
    for scanning in compiled_ahead(scannings):
        yield scanning.scanned()
        tick()


@dataclasses.dataclass(frozen=True)
class _Scanning:
    """An effect on a hypothesis, to be scanned at a greatest number of points."""

    base: Hypothesis
    effect: Effect
    most: int

    def prepare(self) -> None:
        """Compile the residuals, unless the scan is kept in a folder."""
        if not is_stored(ANY_SCAN, *self._inputs):
            self._part.evaluated.prepare()

    def scanned(self) -> ScannedCandidate:
        """Scan it, or take the scan from the folder."""
        found = stored_or_computed(self._scan, ANY_SCAN, *self._inputs)
        return ScannedCandidate(self.base, self.effect, found)

    @functools.cached_property
    def _part(self) -> EffectAtData:
        return at_lines_of_scans(self.base, self.effect)

    @functools.cached_property
    def _inputs(self) -> tuple[Problem, str | None, int]:
        return self._part.problem, _key_of_base(self.base), self.most

    def _scan(self) -> Scan:
        problem = self._part.problem
        counts = _counts(self.effect, fields_of(self.effect, problem), problem)
        solved = _solved(self.effect, problem)
        return scan(self._part, counts, self.most, linear_logarithmic(self.base), solved)


@functools.lru_cache(maxsize=4)
def _key_of_base(base: Hypothesis) -> str | None:
    """Hash of what its scans have in common, which is large."""
    return key_of(base.problem, base.fit.point)


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
    base, effect, problem = candidate.base, candidate.effect, candidate.problem
    weak = _weak_start(effect, problem, base)
    effects = (*base.effects, effect)
    if not base.has_errors:
        places = candidate.best_places(_followed(effect, problem))
        found = Hypothesis(effects, problem, *fit_grown(problem, places, weak[None]))
        return _or_its_twin(found, effect)
    starts = np.concatenate([candidate.best_places(PLACES_WITH_ERRORS), weak[None]])
    sized = kept_with_sizes(
        problem, starts, decreasing_errors(problem, DECREASING_ERRORS[-2:]), rival
    )
    return Hypothesis(effects, has_errors=True, **vars(sized))


def _or_its_twin(found: Hypothesis, effect: Effect) -> Hypothesis:
    """The fit, or a better one that begins where the effect acts almost alike."""
    problem, point = found.problem, found.fit.point
    values = {name: of[0] for name, of in problem.coordinates.named(point[None]).items()}
    words = fields_of(effect, problem)
    twin = effect.twin({word: values[name] for name, word in words.items()})
    if not twin:
        return found
    changed = {name: twin[word] for name, word in words.items() if word in twin}
    start = np.asarray(problem.coordinates.vector({**values, **changed}))
    if not np.isfinite(start).all():  # outside the prior
        return found
    both = fit_grown(problem, start[None], np.stack([point, start]))
    return Hypothesis(found.effects, problem, *both)


def _followed(effect: Effect, problem: Problem) -> int:
    """Number of places of a scan that are followed: more where it is coarse in many unknowns."""
    further = len(fields_of(effect, problem)) - FEW_UNKNOWNS
    return FOLLOWED if effect.takes_long else FOLLOWED * 2 ** max(0, further)


def _weak_start(effect: Effect, problem: Problem, base: Hypothesis) -> np.ndarray:
    """The fit without the effect, and the effect at its weakest: about as good as without."""
    return weakened(base.point_in(problem), effect, problem)


def weakened(point: np.ndarray, effect: Effect, problem: Problem) -> np.ndarray:
    """Return a point with an effect at its weakest."""
    weak = point.copy()
    for name, word in fields_of(effect, problem).items():
        if word == effect.absent[0]:
            weak[problem.coordinates.places[name]] = weakest(effect, problem, name)
    return weak


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

    solved = _solved(effect, problem)
    if solved is not None:
        return _fine(solved, fields)

    def count(name: str) -> int:
        if sized[name].stop - sized[name].start > 1:
            return 1
        if fields[name] in effect.place_fields:
            return PLACES if coordinates == 1 else PLACES_ACROSS
        if fields[name] == effect.absent[0]:
            return STRENGTHS if coordinates else 4 * STRENGTHS
        return SETTINGS if coordinates else MORE_SETTINGS

    return {name: count(name) for name in fields}


def _solved(effect: Effect, problem: Problem) -> str | None:
    """Name of the unknown strengths of an effect, one for each pair of channels; None without."""
    fields = dataclasses.fields(effect)
    of_channels = {field.name for field in fields if field.metadata.get(OF_CHANNELS)}
    places, pairs = problem.coordinates.places, math.prod(np.shape(problem.data.z)[:2])
    for name, word in fields_of(effect, problem).items():
        if word in of_channels and places[name].stop - places[name].start == pairs:
            return name
    return None


def _fine(solved: str, fields: dict[str, str]) -> dict[str, int]:
    """Numbers of points where strengths are solved for: the more along the first setting."""
    settings = [name for name in fields if name != solved]
    finest = MOST // SETTINGS ** max(0, len(settings) - 1)
    return {
        name: 1 if name == solved else finest if name == settings[0] else SETTINGS
        for name in fields
    }
