"""_hypotheses: in, an experiment, data and effects that may be missing; out, each one's best fit.

Not known here: probabilities, what is claimed.
"""

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from ...effects.effect import Effect
from ...effects.library import kind_of
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ...inference.engines.levenberg_marquardt import Fit
from ...inference.residuals import Problem
from ._candidates import numbered
from ._scan import LEAST, MOST, Scan, fit_alone, fit_grown, others, scan

PLACES, PLACES_ACROSS, STRENGTHS, SETTINGS, MORE_SETTINGS = 21, 11, 5, 4, 6
"""Points along a place, each coordinate of one on a surface, a strength, a setting, and a setting
where there is no place."""

WEAKEST = np.array([-3.0, -1.0, -0.3, -0.05, 0.05, 0.3, 1.0, 3.0])
"""Coordinates of a strength, of which the one nearest to absence is taken for weak."""

AHEAD = 2
"""Problems that are compiled while one is fitted."""


class Hypothesis(NamedTuple):
    """An experiment with none, one or several effects, fitted.

    Parameters
    ----------
    effects
        The effects, with priors.
    problem
        The least-squares problem.
    fit
        Its best fit.
    scan
        The last effect scanned, None without effects.
    """

    effects: tuple[Effect, ...]
    problem: Problem
    fit: Fit
    scan: Scan | None = None

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of its effects, sorted."""
        return tuple(sorted(kind_of(effect) for effect in self.effects))

    @property
    def chi2_per_datum(self) -> float:
        """Mean square of the residuals over their variance."""
        return self.fit.squares / self.problem.count

    def own(self, effect: Effect) -> list[str]:
        """Names of the unknowns of one of its effects."""
        return list(fields_of(effect, self.problem))


def fields_of(effect: Effect, problem: Problem) -> dict[str, str]:
    """Field of an effect that each of its unknowns belongs to, by the name of the unknown."""
    return {unknown.name: unknown.field for unknown in problem.experiment.unknowns_of(effect)}


def alone(experiment: Experiment, data: Data) -> Hypothesis:
    """Fit the experiment as it is."""
    problem = Problem(experiment, data)
    return Hypothesis((), problem, fit_alone(problem))


class Scanned(NamedTuple):
    """One more effect on a hypothesis, scanned through its prior but not yet fitted."""

    below: Hypothesis
    effect: Effect
    problem: Problem
    scan: Scan

    @property
    def promised(self) -> float:
        """Least cost that the scan promises."""
        return float(np.nanmin(self.scan.promised, initial=np.inf))


def grown(below: Hypothesis, effect: Effect) -> Hypothesis:
    """Fit a hypothesis with one more effect."""
    return fitted(_scanned(below, *_prepared(below, effect)))


def all_scanned(
    pairs: Sequence[tuple[Hypothesis, Effect]], tick: Callable[[], None]
) -> Iterator[Scanned]:
    """Scan several, in their order. While one is scanned, the next ones are compiled.

    The variants of one kind share the points of a scan, as they share its prior.
    """
    variants = Counter(kind_of(effect) for _, effect in pairs)
    with ThreadPoolExecutor(AHEAD) as pool:
        for below, effect, problem, compiled in _ahead(pool, pairs):
            compiled.result()
            yield _scanned(below, effect, problem, variants[kind_of(effect)])
            tick()


def all_grown(
    pairs: Sequence[tuple[Hypothesis, Effect]], tick: Callable[[], None]
) -> list[Hypothesis]:
    """Fit several, in their order; those without a finite density are left out."""
    return finite(fitted(one) for one in all_scanned(pairs, tick))


def finite(several: Iterable[Hypothesis]) -> list[Hypothesis]:
    """Those with a finite density."""
    return [one for one in several if np.isfinite(one.fit.log_evidence)]


_Ahead = tuple[Hypothesis, Effect, Problem, Future[Any]]


def _ahead(
    pool: ThreadPoolExecutor, pairs: Iterable[tuple[Hypothesis, Effect]]
) -> Iterator[_Ahead]:
    waiting: deque[_Ahead] = deque()
    for below, effect in pairs:
        renamed, problem = _prepared(below, effect)
        waiting.append((below, renamed, problem, pool.submit(problem.prepare)))
        if len(waiting) > AHEAD:
            yield waiting.popleft()
    yield from waiting


def _prepared(below: Hypothesis, effect: Effect) -> tuple[Effect, Problem]:
    effect = numbered(effect, {present.name for present in below.problem.experiment.effects})
    return effect, Problem(below.problem.experiment + effect, below.problem.data)


def _scanned(below: Hypothesis, effect: Effect, problem: Problem, variants: int = 1) -> Scanned:
    own = fields_of(effect, problem)
    most = max(MOST // variants, LEAST)
    found = scan(problem, _counts(effect, own, problem), below.fit.point, most)
    return Scanned(below, effect, problem, found)


def fitted(scanned: Scanned) -> Hypothesis:
    """Fit what was scanned."""
    below, effect, problem, found = scanned
    weak = _weak_start(effect, problem, below.fit.point)
    fit = fit_grown(problem, found, weak[None])
    return Hypothesis((*below.effects, effect), problem, fit, found)


def _weak_start(effect: Effect, problem: Problem, base: np.ndarray) -> np.ndarray:
    """The fit without the effect, and the effect at its weakest: never worse than without."""
    start, fields = np.zeros(problem.dimension), fields_of(effect, problem)
    start[others(problem, list(fields))] = base
    for name, field in fields.items():
        if field == effect.absent[0]:
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


def _counts(effect: Effect, field: dict[str, str], problem: Problem) -> dict[str, int]:
    """Number of points along each unknown of an effect."""
    sized = {name: problem.coordinates.places[name] for name in field}
    coordinates = sum(word in effect.place_fields for word in field.values())

    def count(name: str) -> int:
        if sized[name].stop - sized[name].start > 1:
            return 1
        if field[name] in effect.place_fields:
            return PLACES if coordinates == 1 else PLACES_ACROSS
        if field[name] == effect.absent[0]:
            return STRENGTHS if coordinates else 4 * STRENGTHS
        return SETTINGS if coordinates else MORE_SETTINGS

    return {name: count(name) for name in field}
