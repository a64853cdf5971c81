"""The same hypotheses with and without model error: which of the two the data ask for."""

import functools
import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from ..._shared.errors import InputError
from ..._shared.parts import nothing
from ..._shared.progress import Progress
from ...effects.library import Library
from ...experiment.experiment import Experiment
from ...experiment.model_error import Embedded, ModalErrors
from ...experiment.noise import Data
from ..kept_fits import NO_RIVAL
from ._errors_as_identified import refitted_from_given
from ._hypotheses import Hypothesis, finite, rival_among, takes_long
from ._more_effects import (
    AT_FIRST,
    NARROW,
    VARIANTS_WITH_ERRORS,
    Breadth,
    one_more_effect,
    with_listed_replaced,
)
from ._networks import laws_beside_best, with_networks, with_other_laws
from ._posterior_odds import (
    Comparison,
    explains,
    greatest_odds_expected,
    may_explain,
    p_value,
    passes,
    wants_more_effects,
)
from ._predicted_odds import worth_fitting
from ._rows import row_with_sizes
from ._scanned_candidates import Tick
from ._shared_fits import SharedFits, shared_fits
from ._simpler_laws import with_simpler_laws
from ._so_far import Seen, nothing_seen
from ._suspension import with_suspended
from ._weighed import Weighed
from .decide import Decision, as_good_elsewhere, predicts_better
from .fitted_model import Sampled
from .table import Policy, TableOfFits


class Question(NamedTuple):
    """The question which of some effects an experiment, without its model error, lacks.

    A model error that is not declared with the experiment is a rival of all candidates. The level
    is the probability that a correct model fails its check. Fits of the same question are those
    that were made before, and those that are made now. `seen` is called with what has been compared
    so far.
    """

    experiment: Experiment
    data: Data
    tried: Library[Experiment]
    errors: ModalErrors | None
    declared: bool
    level: float
    fits: SharedFits
    most_effects: int = 1
    seen: Seen = nothing_seen

    @classmethod
    def of(
        cls,
        experiment: Experiment,
        data: Data,
        tried: Library[Experiment],
        rival: Embedded | None,
        **settings: Any,
    ) -> "Question":
        """Return the question, the rival being the model error where the experiment has none."""
        declared = experiment.model_error is not None
        errors = experiment.model_error
        if not declared and rival is not None:
            errors = experiment.with_model_error(rival).model_error
        content = experiment.with_errors(None), data, tried, errors
        return cls(*content, declared, fits=shared_fits(*content, declared), **settings)

    def asked_of(self, experiment: Experiment, data: Data) -> "Question":
        """Return the question asked of another experiment, and what was measured of that."""
        content = experiment, data, self.tried, self.errors
        fits = shared_fits(*content, self.declared)
        return self._replace(experiment=experiment, data=data, fits=fits)

    def of_one_state(self) -> "Question":
        """Return the question without effects that only a second state tells, if others are left.

        Where they alone were asked for, they are tried.
        """
        effects = tuple(effect for effect in self.tried.effects if not effect.only_new)
        if not effects or len(effects) == len(self.tried.effects):
            return self
        fewer = self._replace(tried=replace(self.tried, effects=effects))
        return fewer.asked_of(self.experiment, self.data)

    def of_what_is_new(self) -> "Question":
        """Return the question which effects came between two states."""
        effects = tuple(effect for effect in self.tried.effects if effect.may_be_new)
        if not effects:
            raise InputError(
                f"candidates={', '.join(self.tried.kinds)} was given beside an earlier state; one "
                "that can be new is needed, since these were there before: "
                'effects.library(experiment, ["point_mass"]).'
            )
        new = self._replace(tried=replace(self.tried, effects=effects))
        return new.asked_of(self.experiment, self.data)


class Answer(NamedTuple):
    """Hypotheses compared, exact or with model error, as the data ask for.

    `null` is the model as given, exact; with an earlier state, the model of that one alone.
    `baseline` is that fitted to the earlier state alone, completed where it lacked something there.
    """

    null: Hypothesis
    comparison: Comparison
    baseline: Hypothesis | None = None

    def table(self, policy: Policy, sampled: Sampled = MappingProxyType({})) -> TableOfFits:
        """All that is decided by; of hypotheses that were sampled, the edges of their draws."""
        table = self.comparison.table_in_full(policy, sampled)
        exact = p_value(self.null) if self.baseline is None else np.nan
        rows = [row if row.kinds else row._replace(p_value_when_exact=exact) for row in table.rows]
        before = None if self.baseline is None else row_with_sizes(self.baseline)
        return table._replace(rows=rows, baseline=before)

    def claimed(self, decision: Decision) -> list[Hypothesis]:
        """Hypotheses from the model as given to what is claimed, one effect more each time."""
        return [self.comparison.hypotheses[number] for number in decision.steps]


def answered(question: Question, tick: Tick) -> Answer:
    """Compare hypotheses without model error, and with it where none of them reaches the noise.

    A declared model error is always fitted.
    """
    null = question.fits.null
    question.seen(Comparison([null], {}))
    exact = question.fits.singles(tick)
    question.seen(exact)
    if question.declared:
        return Answer(null, _deepened_with_errors(question, exact, tick))
    if explains(exact.best(), question.level):
        return Answer(null, exact)
    rivals = _rivals(question, exact)
    if not rivals:
        return Answer(null, deepened(question, exact, Breadth(), -np.inf, tick))
    # More effects of an exact model are tried first: that takes a fraction of the time of
    # all effects with a model error, and where they explain the data nothing else is needed.
    rival = max(map(exact.log_odds, rivals.values()))
    exact = deepened(question, exact, NARROW, rival, tick)
    if explains(exact.best(), question.level) and _odds(exact) > rival:
        return Answer(null, exact)
    erroneous = _deepened_with_errors(question, exact, tick, rivals)
    if not explains(erroneous.best(), question.level):
        exact = deepened(question, exact, Breadth(), _odds(erroneous), tick)
    return Answer(null, exact if _odds(exact) > _odds(erroneous) else erroneous)


def ticks(progress: Progress, begin: float, *stages: tuple[int, float]) -> Tick:
    """Report the share of the work that is done, one of many parts more at each call.

    Stages follow one after the other: each has so many equal parts, and ends at a share of all.
    """
    counts, ends = zip(*stages, strict=True)
    calls = itertools.count(1)

    def tick() -> None:
        progress(float(np.interp(next(calls), np.cumsum([0, *counts]), [begin, *ends])))

    return tick


def _holds_by_itself(comparison: Comparison, policy: Policy) -> bool:
    """Whether the best effects stand out and predict held-out data better than one effect less."""
    weighed = Weighed(comparison.table_in_full(policy, {}), policy)
    *_, fewer, best = weighed.steps_to(weighed.best)
    rows = weighed.rows
    return not as_good_elsewhere(weighed, best) and predicts_better(rows[best], rows[fewer], policy)


def _odds(comparison: Comparison) -> float:
    return comparison.log_odds(comparison.best())


def _rivals(question: Question, exact: Comparison) -> dict[Hypothesis, Hypothesis]:
    """None and the best single effect with model error, by what they are without.

    None of them where the model error explains less than the best effect alone.
    """
    if question.errors is None:
        return {}
    none, best = exact.hypotheses[0], exact.best()
    # One after the other: effects may begin at what the model error of none of them explains.
    rivals = {each: question.fits.with_errors(each, leading=True)[0] for each in (none, best)}
    return {} if exact.log_odds(rivals[best]) < exact.log_odds(best) else rivals


def deepened(
    question: Question, comparison: Comparison, breadth: Breadth, rival: float, tick: Tick
) -> Comparison:
    """Try more effects, while they may reach the odds of a rival."""
    for depth in range(1, question.most_effects):
        further_effects = question.most_effects - depth
        if not wants_more_effects(comparison, depth, question.level):
            break
        if greatest_odds_expected(comparison, depth, further_effects) < rival:
            break
        if not may_explain(comparison, depth, further_effects, question.level):
            break
        must_explain = further_effects == 1 and bool(np.isfinite(rival))
        comparison = deeper(question, comparison, depth, breadth, tick, must_explain)
        question.seen(comparison)
    return comparison


def deeper(
    question: Question,
    comparison: Comparison,
    depth: int,
    breadth: Breadth,
    tick: Tick,
    must_explain: bool = False,
) -> Comparison:
    """Try one more effect, also one that is in no list, beside each of the best so many.

    Where it must explain the data, and no law at any port does, it is looked for elsewhere alone;
    none that takes long where a model error explains them.
    """
    if depth == 1:
        comparison = with_suspended(comparison, comparison, question.tried.networks)
    laws = laws_beside_best(comparison, depth, tick) if question.tried.networks else None
    if must_explain and laws is not None and not laws.may_explain(question.level):
        given_up = laws.is_bounded_or_long if breadth == NARROW else laws.is_bounded
        return one_more_effect(comparison, depth, tick, breadth, is_given_up=given_up)
    meanwhile = nothing if laws is None else laws.look
    comparison = one_more_effect(comparison, depth, tick, breadth, meanwhile)
    # Two of the library may pass the check though one of them is in no list: a spring beside
    # the root of a cantilever stands for one against rotation.
    if laws is not None:
        comparison = with_networks(comparison, laws)
    comparison = with_other_laws(comparison, tick, laws)
    replaced = with_listed_replaced(comparison, tick)
    # Beside another effect the law may be another one: a part of it stood for what that one does.
    is_other = replaced.best() is not comparison.best()
    return with_other_laws(replaced, tick, laws) if is_other else replaced


def _deepened_with_errors(
    question: Question,
    exact: Comparison,
    tick: Tick,
    fitted: Mapping[Hypothesis, Hypothesis] = MappingProxyType({}),
) -> Comparison:
    """Effects with model error, one more at a time; some were fitted, by what they are without."""
    assert question.errors is not None
    comparison = with_simpler_laws(_single_effects_with_errors(question, exact, tick, fitted))
    if not explains(comparison.best(), question.level):
        rival = rival_among(comparison.hypotheses)
        of_exact = functools.partial(question.fits.with_errors, rival=rival)
        comparison = with_suspended(comparison, exact, question.tried.networks, of_exact)
    comparison = _with_best_of_exact(question, exact, comparison, tick)
    question.seen(comparison)
    for depth in range(1, question.most_effects):
        if not wants_more_effects(comparison, depth, question.level):
            break
        # Nothing is built on a claim that does not hold by itself.
        if not _holds_by_itself(comparison, Policy(level=question.level)):
            break
        branches = [h for h in comparison.distinct() if len(h.effects) == depth]
        kinds = {hypothesis.kinds for hypothesis in branches[: NARROW.branches]}
        counterparts = [h for h in exact.distinct() if h.kinds in kinds]
        deeper = one_more_effect(
            exact._replace(hypotheses=[exact.hypotheses[0], *counterparts]), depth, tick, NARROW
        )
        further = [h for h in deeper.hypotheses if len(h.effects) == depth + 1]
        exact = exact.with_hypotheses(further)
        refitted = _refitted(_by_evidence(further), question, tick)
        comparison = comparison.with_hypotheses(finite(refitted.values()))
        question.seen(comparison)
    return _with_fewer_from_best(comparison)


def _with_fewer_from_best(comparison: Comparison) -> Comparison:
    """Fit what has fewer effects than the best hypothesis from the errors of that as well.

    Posteriors of a model error have many modes. An effect that only begins at a better one explains
    nothing.
    """
    weighed = comparison.weighed
    *fewer, best = (comparison.hypotheses[n] for n in weighed.steps_to(weighed.best))
    better = {each: refitted_from_given(each, each, best, NO_RIVAL) for each in fewer}
    return comparison._replace(hypotheses=[better.get(h, h) for h in comparison.hypotheses])


def _with_best_of_exact(
    question: Question, exact: Comparison, comparison: Comparison, tick: Tick
) -> Comparison:
    """Add the several effects that explain most without model error, each step to them.

    A model error large enough explains what a second effect does, and no more would be looked for.
    """
    weighed = exact.weighed
    way = [exact.hypotheses[number] for number in weighed.steps_to(weighed.best)]
    several = [hypothesis for hypothesis in way if len(hypothesis.effects) > 1]
    return comparison.with_hypotheses(finite(_refitted(several, question, tick).values()))


def _single_effects_with_errors(
    question: Question, exact: Comparison, tick: Tick, fitted: Mapping[Hypothesis, Hypothesis]
) -> Comparison:
    """None and single effects with model error, of each kind the variants of most evidence."""
    assert question.errors is not None
    none = exact.hypotheses[0]
    null = fitted.get(none) or question.fits.with_errors(none)[0]
    singles = _best_variants(exact.hypotheses)
    known = {**fitted, none: null}
    if passes(null, question.level):
        # What the best one reaches is compared with what is predicted of the others.
        best = [h for h in singles[:1] if h not in known]
        known |= dict(zip(best, question.fits.with_errors(*best), strict=True))
        singles = worth_fitting(null, exact, singles, [known[h] for h in singles if h in known])
    first = [h for h in singles if not takes_long(h) or h in known]
    last = [h for h in singles if h not in first]
    refitted = _refitted(first, question, tick, known)
    comparison = exact._replace(hypotheses=finite([null, *refitted.values()]))
    if not last or (first and explains(comparison.best(), question.level)):
        return comparison
    further = _refitted(last, question, tick, refitted)
    return comparison.with_hypotheses(finite(further.values()))


def _best_variants(hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Single effects, of each kind the variants of the greatest evidence."""
    count: Counter[tuple[str, ...]] = Counter()
    chosen = []
    for hypothesis in _by_evidence(hypotheses):
        count[hypothesis.kinds] += 1
        if len(hypothesis.effects) == 1 and count[hypothesis.kinds] <= VARIANTS_WITH_ERRORS:
            chosen.append(hypothesis)
    return chosen


def _by_evidence(hypotheses: Sequence[Hypothesis]) -> list[Hypothesis]:
    return sorted(hypotheses, key=lambda exact: exact.fit.log_evidence, reverse=True)


def _refitted(
    hypotheses: Sequence[Hypothesis],
    question: Question,
    tick: Tick,
    fitted: Mapping[Hypothesis, Hypothesis] = MappingProxyType({}),
) -> dict[Hypothesis, Hypothesis]:
    """Hypotheses with model error, by what they are without; those far behind others given up."""
    known = {hypothesis: fitted[hypothesis] for hypothesis in hypotheses if hypothesis in fitted}
    remaining = [hypothesis for hypothesis in hypotheses if hypothesis not in fitted]
    for chosen in (remaining[:AT_FIRST], remaining[AT_FIRST:]):
        rival = rival_among([*fitted.values(), *known.values()])
        leading = chosen == remaining[:AT_FIRST]
        refitted = question.fits.with_errors(*chosen, rival=rival, leading=leading)
        known |= dict(zip(chosen, refitted, strict=True))
        for _ in chosen:
            tick()
    return known
