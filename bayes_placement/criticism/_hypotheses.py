"""_hypotheses: in, an experiment, data and effects that may be missing; out, each one's best fit.

Not known here: probabilities, what is claimed.
"""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, NamedTuple

import numpy as np

from ..effects._effect import Effect, InstrumentEffect
from ..effects._library import kind_of
from ..experiment import Experiment
from ..noise import Data
from ._descent import Fit
from ._problem import Problem
from ._search import Scan, fit_alone, fit_grown, others, scan

PLACES, STRENGTHS, SETTINGS, MORE_SETTINGS = 21, 5, 4, 6
"""Points along a place, a strength, a setting, and a setting where there is no place."""

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
        return unknowns_of(effect, self.problem)


def unknowns_of(effect: Effect, problem: Problem) -> list[str]:
    """Names of the unknowns of an effect."""
    where = "chain" if isinstance(effect, InstrumentEffect) else "structure.effects"
    prefix = f"{where}.{effect.name}."
    return [name for name in problem.coordinates.places if name.startswith(prefix)]


def alone(experiment: Experiment, data: Data) -> Hypothesis:
    """Fit the experiment as it is."""
    problem = Problem(experiment, data)
    return Hypothesis((), problem, fit_alone(problem))


class _Prepared(NamedTuple):
    below: Hypothesis
    effect: Effect
    problem: Problem


def grown(below: Hypothesis, effect: Effect) -> Hypothesis:
    """Fit a hypothesis with one more effect."""
    return _fitted(_prepared(below, effect))


def all_grown(
    pairs: Iterable[tuple[Hypothesis, Effect]], tick: Callable[[], None]
) -> list[Hypothesis]:
    """Fit several, in their order; those without a finite density are left out.

    While one is fitted, the next ones are compiled.
    """
    found = []
    with ThreadPoolExecutor(AHEAD) as pool:
        for prepared, compiled in _ahead(pool, pairs):
            compiled.result()
            found.append(_fitted(prepared))
            tick()
    return [one for one in found if np.isfinite(one.fit.log_evidence)]


def _ahead(
    pool: ThreadPoolExecutor, pairs: Iterable[tuple[Hypothesis, Effect]]
) -> Iterator[tuple[_Prepared, Future[Any]]]:
    waiting: deque[tuple[_Prepared, Future[Any]]] = deque()
    for pair in pairs:
        prepared = _prepared(*pair)
        waiting.append((prepared, pool.submit(getattr, prepared.problem, "compiled")))
        if len(waiting) > AHEAD:
            yield waiting.popleft()
    yield from waiting


def _prepared(below: Hypothesis, effect: Effect) -> _Prepared:
    effect = _renamed(effect, below.effects)
    return _Prepared(below, effect, Problem(below.problem.experiment + effect, below.problem.data))


def _fitted(prepared: _Prepared) -> Hypothesis:
    below, effect, problem = prepared
    own = unknowns_of(effect, problem)
    found = scan(problem, _counts(effect, own, problem), below.fit.point)
    fit = fit_grown(problem, found, _weak_start(effect, problem, below.fit.point)[None])
    return Hypothesis((*below.effects, effect), problem, fit, found)


def _weak_start(effect: Effect, problem: Problem, base: np.ndarray) -> np.ndarray:
    """The fit without the effect, and the effect at its weakest: never worse than without."""
    start, own = np.zeros(problem.dimension), unknowns_of(effect, problem)
    start[others(problem, own)] = base
    for name in own:
        if name.endswith(f".{effect.absent[0]}"):
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


def _renamed(effect: Effect, others: Sequence[Effect]) -> Effect:
    """Number an effect whose name is taken."""
    taken = {one.name for one in others}
    names = [effect.name, *(f"{effect.name}_{number}" for number in range(2, 9))]
    free = next(name for name in names if name not in taken)
    return effect if free == effect.name else replaced_name(effect, free)


def replaced_name(effect: Effect, name: str) -> Effect:
    """Return an effect under another name."""
    fields = {key: getattr(effect, key) for key in effect.__dataclass_fields__ if key != "name"}
    return type(effect)(**fields, name=name)


def _counts(effect: Effect, own: list[str], problem: Problem) -> dict[str, int]:
    """Number of points along each unknown of an effect."""
    last = {name: name.rsplit(".", 1)[-1] for name in own}
    sized = {name: problem.coordinates.places[name] for name in own}
    placed = any(word in ("at", "shift") for word in last.values())

    def count(name: str) -> int:
        if sized[name].stop - sized[name].start > 1:
            return 1
        if last[name] in ("at", "shift"):
            return PLACES
        if last[name] == effect.absent[0]:
            return STRENGTHS if placed else 4 * STRENGTHS
        return SETTINGS if placed else MORE_SETTINGS

    return {name: count(name) for name in own}
