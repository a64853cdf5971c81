"""What came since an earlier state, asked of a model that explains that state.

A model that does not is completed first, by the effects that explain the earlier state best: what
both states share cancels, whatever its name.
"""

import functools
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...experiment.experiment import Experiment, Measurements
from ...inference.residuals_of_state import State
from ._before_and_after import compared_with_baseline, fitted_baseline, refitted_effects, state_of
from ._hypotheses import Hypothesis, null_hypothesis
from ._model_error_choice import Answer, Question, answered, deepened, deeper
from ._more_effects import ALL
from ._mounts import on_mounts
from ._networks import priors_of_networks
from ._posterior_odds import explains, passes
from ._rows import row_with_sizes
from ._scanned_candidates import Tick
from .decide import is_unexplained
from .fitted_model import FittedModel, fitted_model
from .table import Policy

MOST_LACKING = 2
"""Effects that complete a model; of one that lacks more, nothing is asked that came later."""


class Earlier(NamedTuple):
    """An earlier state, and the model that explains it if any does.

    The question is what is new since, asked of that model. `before` is the model fitted to the
    state alone; its effects are those that the model as given, `as_given`, lacked.
    """

    question: Question
    state: State
    before: Hypothesis
    as_given: Hypothesis

    @property
    def in_full(self) -> dict[str, FittedModel]:
        """Both fits of the earlier state, laid out for the record."""
        return {
            "baseline": fitted_model(self.before, {}),
            "baseline_as_given": fitted_model(self.as_given, {}),
        }

    @property
    def is_explained(self) -> bool:
        """Whether the model explains it: else nothing can be said of what came since."""
        return _is_explained(self.before, self.question)


def earlier_state(question: Question, baseline: Measurements, tick: Tick) -> Earlier:
    """Return an earlier state, and the question on the model completed by what it lacks there."""
    state = state_of(question.experiment.with_errors(question.errors), baseline)
    as_given = before = fitted_baseline(state, question.errors)
    if not _is_explained(as_given, question):
        completed = _completed(question, state, tick)
        if completed is not None:
            before = completed
            effects = completed.effects
            experiment = functools.reduce(Experiment.__add__, effects, question.experiment)
            question = question._replace(experiment=experiment)
            state = state_of(experiment.with_errors(question.errors), baseline)
    return Earlier(question.of_what_is_new(), state, before, as_given)


def _completed(question: Question, state: State, tick: Tick) -> Hypothesis | None:
    """The fewest effects, of these the most probable, that explain an earlier state; None if none.

    They are looked for by the exact model, which takes a fraction of the time of a model error, and
    without networks, which would follow what is a model error there.
    """
    listed = question._replace(tried=replace(question.tried, networks=False))
    alone = listed.asked_of(state.experiment.with_errors(None), state.data).of_one_state()
    comparison = alone.fits.singles(tick)
    most = min(question.most_effects, MOST_LACKING)
    for depth in range(1, most + 1):
        best = [each for each in comparison.distinct() if len(each.effects) == depth]
        best = best[: ALL.branches]
        for tried in (best, on_mounts(best, comparison.of(()))):
            fitted = tried if question.errors is None else alone.fits.with_errors(*tried)
            explaining = [each for each in fitted if _is_explained(each, question)]
            if explaining:
                return max(explaining, key=comparison.log_odds)
        if best and depth < most:
            comparison = deeper(alone, comparison, depth, ALL, tick)
    return None


def _is_explained(fitted: Hypothesis, question: Question) -> bool:
    return not is_unexplained(row_with_sizes(fitted), Policy(level=question.level))


def answered_by_states(
    question: Question, tick: Tick, baseline: Measurements | None, between: Hypothesis | None = None
) -> tuple[Answer, Earlier | None]:
    """Answer a question by one state; with a baseline by both, and tell what explains that one."""
    if baseline is None:
        return answered(question.of_one_state(), tick), None
    earlier = earlier_state(question, baseline, tick)
    return answered_since(earlier, tick, between), earlier


def answered_since(earlier: Earlier, tick: Tick, between: Hypothesis | None = None) -> Answer:
    """Compare what is new in the later of two states; the model error is that of both.

    Effects that were found in a state in between are tried from where they were.
    """
    question = earlier.question
    if not earlier.is_explained:
        # Nothing is claimed then: single effects tell what is nearest.
        tried = replace(question.tried, networks=False)
        question = question._replace(tried=tried, most_effects=1)
    later = State(question.experiment.with_errors(question.errors), question.data)
    unchanged, comparison = compared_with_baseline(
        later,
        earlier.state,
        earlier.before,
        question.tried,
        question.level,
        question.most_effects,
        tick,
        question.seen,
    )
    if between is not None:
        refitted = refitted_effects(comparison, between, question.most_effects)
        priors = priors_of_networks(between, comparison)
        comparison = comparison.with_hypotheses(refitted, priors)
    if earlier.is_explained and not explains(comparison.best(), question.level):
        of_later_state = _best_of_later_state(question, earlier.state, tick)
        refitted = refitted_effects(comparison, of_later_state, question.most_effects)
        priors = priors_of_networks(of_later_state, comparison)
        comparison = comparison.with_hypotheses(refitted, priors)
    question.seen(comparison)
    return Answer(unchanged, comparison, earlier.before)


def _best_of_later_state(question: Question, earlier: State, tick: Tick) -> Hypothesis:
    """Best hypothesis of the later state alone, where the exact model explains the earlier one.

    Effects that act together may each win alone elsewhere than where they are; all pairs of an
    exact model are tried in the time of a few with a model error of two states.
    """
    exact = null_hypothesis(earlier.experiment.with_errors(None), earlier.data)
    if not passes(exact, question.level):
        return exact
    question = question.of_one_state()
    singles = question.fits.singles(tick)
    return deepened(question, singles, ALL, -np.inf, tick).best()
