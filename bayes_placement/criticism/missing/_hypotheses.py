"""An experiment with none, one or several effects that may be missing, each fitted."""

import functools
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...effects.effect import Effect
from ...effects.library import kind_of
from ...experiment.experiment import Experiment
from ...experiment.model_error import ModalErrors
from ...experiment.noise import Data
from ...inference.engines.empirical_bayes import SOFTENING, Rival
from ...inference.engines.least_squares import Jacobian
from ...inference.engines.levenberg_marquardt import Fit
from ...inference.residuals import Problem
from ._candidates import numbered
from ._compiled_ahead import compiled_ahead
from ._kept_fits import NO_RIVAL, kept_with_sizes
from ._outliers import Mixture, mixture
from ._scan import LEAST, MOST, Scan, best_places, fit_alone, fit_grown, point_in_problem, scan

PLACES, PLACES_ACROSS, STRENGTHS, SETTINGS, MORE_SETTINGS = 21, 11, 5, 4, 6
"""Points along a place, each coordinate of one on a surface, a strength, a setting, and a setting
where there is no place."""

WEAKEST = np.array([-3.0, -1.0, -0.3, -0.05, 0.05, 0.3, 1.0, 3.0])
"""Coordinates of a strength, of which the one nearest to absence is taken for weak."""

PLACES_WITH_ERRORS = 4
"""Best places of a scan from which an effect is fitted together with a model error."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An experiment with none, one or several effects, fitted.

    Parameters
    ----------
    effects
        The effects, with priors.
    problem
        The least-squares problem.
    fit
        Its best fit.
    near
        Ends of descents along logarithmic residuals [start, unknown], of the exact model.
    scan
        The last effect scanned, None without effects.
    deviations
        Standard deviation of the log of each unknown size of the model error, by name.
    has_errors
        Whether a model error is fitted.
    as_rival
        Evidence on the way to its fit with model error.
    chi2_when_exact
        Mean square of the residuals of its fit without the model error; NaN where there is none.
    """

    effects: tuple[Effect, ...]
    problem: Problem
    fit: Fit
    near: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    scan: Scan | None = None
    deviations: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    has_errors: bool = False
    as_rival: Rival = NO_RIVAL
    chi2_when_exact: float = float("nan")

    def point_in(self, problem: Problem, onto: np.ndarray | None = None) -> np.ndarray:
        """The fit as coordinates of a problem; what is new there as in `onto`, else at medians."""
        return point_in_problem(self.problem, self.fit.point, problem, onto)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of its effects, sorted."""
        return tuple(sorted(kind_of(effect) for effect in self.effects))

    @functools.cached_property
    def is_noise_known(self) -> bool:
        """Whether the level of the noise is stated, or read from the data."""
        noise = self.problem.experiment.noise
        return noise is not None and noise.deviation(self.problem.data) is not None

    @functools.cached_property
    def residual(self) -> np.ndarray:
        """Residuals at its fit over their standard deviations [datum]."""
        return self.problem.squares.residuals(self.fit.point[None])[0][0]

    @functools.cached_property
    def with_outliers(self) -> Mixture:
        """Likelihood at its fit where a few data may be outliers."""
        return mixture(self.residual, self.problem.count)

    @property
    def chi2_per_datum(self) -> float:
        """Mean square of the residuals over their variance."""
        return self.fit.squares / self.problem.count


def fields_of(effect: Effect, problem: Problem) -> dict[str, str]:
    """Field of an effect that each of its unknowns belongs to, by the name of the unknown."""
    return {unknown.name: unknown.field for unknown in problem.experiment.unknowns_of(effect)}


@functools.lru_cache(maxsize=4)  # of the hypotheses that are extended
def logarithmic_jacobian(hypothesis: Hypothesis) -> Jacobian:
    """Logarithmic residuals at its fit, and their slopes."""
    return hypothesis.problem.squares.jacobian(hypothesis.fit.point[None], True)


def null_hypothesis(experiment: Experiment, data: Data) -> Hypothesis:
    """Fit the experiment as it is given."""
    problem = Problem(experiment, data)
    return Hypothesis((), problem, *fit_alone(problem))


def with_errors(exact: Hypothesis, errors: ModalErrors, rival: Rival = NO_RIVAL) -> Hypothesis:
    """Fit a hypothesis once more, with a model error.

    Errors begin at zero, where the exact model follows the data best on a logarithmic scale: a fit
    whose errors have already taken up what an effect does would keep them.

    Parameters
    ----------
    exact
        The hypothesis without model error.
    errors
        The errors.
    rival
        Another hypothesis; where this one stays far behind it is left as it is.
    """
    return fitted_with_errors(exact, problem_with_errors(exact, errors), rival)


def problem_with_errors(exact: Hypothesis, errors: ModalErrors) -> Problem:
    """Return the problem of a hypothesis with a model error."""
    before = exact.problem
    return Problem(before.experiment.with_errors(errors), before.data, baseline=before.baseline)


def fitted_with_errors(exact: Hypothesis, problem: Problem, rival: Rival) -> Hypothesis:
    """Fit a hypothesis in its problem with model error, see `with_errors`."""
    starts = np.zeros((len(exact.near), problem.dimension))
    starts[:, : exact.problem.dimension] = exact.near  # errors are the last unknowns
    sized = kept_with_sizes(problem, starts, _softening(problem, SOFTENING), rival)
    chi2 = exact.chi2_per_datum
    return replace(exact, **vars(sized), has_errors=True, chi2_when_exact=chi2)


def _softening(problem: Problem, relative_errors: Sequence[float]) -> Sequence[float]:
    """Relative errors that data have besides, at first; the last alone where modes are observed.

    A resonance that is off is flat in an FRF; a natural frequency is not, wherever it is.
    """
    is_modal = problem.experiment.observe.is_modal
    return relative_errors[-1:] if is_modal else relative_errors


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
    """

    base: Hypothesis
    effect: Effect
    problem: Problem
    scan: Scan

    @property
    def predicted_cost(self) -> float:
        """Least cost that the scan predicts for its fit."""
        return float(np.nanmin(self.scan.predicted_cost, initial=np.inf))


Pair = tuple[Hypothesis, Effect]
"""A hypothesis and an effect to add to it."""


def scanned(pairs: Sequence[Pair], tick: Callable[[], None]) -> Iterator[ScannedCandidate]:
    """Scan effects on hypotheses, in their order. Meanwhile the next ones are compiled.

    The variants of one kind share the points of a scan, as they share its prior.
    """
    variants = Counter(kind_of(effect) for _, effect in pairs)
    named = [(base, _under_free_name(effect, base)) for base, effect in pairs]
    problems = compiled_ahead(base.problem.with_effect(effect) for base, effect in named)
    for (base, effect), problem in zip(named, problems, strict=True):
        fields = fields_of(effect, problem)
        most = max(MOST // variants[kind_of(effect)], LEAST)
        counts = _counts(effect, fields, problem)
        slopes = logarithmic_jacobian(base).slopes[0]
        seen = scan(problem, counts, base.point_in(problem), slopes, most)
        yield ScannedCandidate(base, effect, problem, seen)
        tick()


def _under_free_name(effect: Effect, base: Hypothesis) -> Effect:
    return numbered(effect, {present.name for present in base.problem.experiment.effects})


def extended(pairs: Sequence[Pair], tick: Callable[[], None]) -> list[Hypothesis]:
    """Fit hypotheses with one more effect; those without a finite density are left out."""
    return finite(fitted(candidate) for candidate in scanned(pairs, tick))


def relocated(hypothesis: Hypothesis, null: Hypothesis, tick: Callable[[], None]) -> Hypothesis:
    """Fit each effect in turn from its best places beside the others, where these are fitted.

    A descent moves all effects together. From the mirror image of a place, or from a place that
    was the best one without the others, it leads nowhere else.

    Parameters
    ----------
    hypothesis
        A hypothesis of several effects.
    null
        The one of none.
    tick
        Called once for each effect.

    Returns
    -------
    Hypothesis
        That of the greatest evidence, the given one included.
    """
    best = hypothesis
    for effect in hypothesis.effects:
        moved = extended([(_without(best, effect.name, null), effect)], tick)
        best = max(best, *moved, key=lambda hypothesis: hypothesis.fit.log_evidence)
    return best


def _without(hypothesis: Hypothesis, name: str, null: Hypothesis) -> Hypothesis:
    """A hypothesis less one of its effects, all else where it is."""
    others = tuple(effect for effect in hypothesis.effects if effect.name != name)
    problem = functools.reduce(Problem.with_effect, others, null.problem)
    fit = hypothesis.fit._replace(point=hypothesis.point_in(problem))
    return replace(hypothesis, effects=others, problem=problem, fit=fit)


def rival_among(hypotheses: Sequence[Hypothesis]) -> Rival:
    """Return the hypothesis of the greatest evidence as a rival; without any, there is none."""
    best = max(hypotheses, key=lambda hypothesis: hypothesis.fit.log_evidence, default=None)
    return NO_RIVAL if best is None else best.as_rival


def finite(hypotheses: Iterable[Hypothesis]) -> list[Hypothesis]:
    """Those with a finite density."""
    return [hypothesis for hypothesis in hypotheses if np.isfinite(hypothesis.fit.log_evidence)]


def fitted(candidate: ScannedCandidate, rival: Rival = NO_RIVAL) -> Hypothesis:
    """Fit a candidate that was scanned; with model error, see `with_errors`."""
    base, effect, problem, scan = candidate
    weak = _weak_start(effect, problem, base)
    effects = (*base.effects, effect)
    if not base.has_errors:
        return Hypothesis(effects, problem, *fit_grown(problem, scan, weak[None]), scan)
    starts = np.concatenate([best_places(scan)[:PLACES_WITH_ERRORS], weak[None]])
    sized = kept_with_sizes(problem, starts, _softening(problem, SOFTENING[-2:]), rival)
    return Hypothesis(effects, scan=scan, has_errors=True, **vars(sized))


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
