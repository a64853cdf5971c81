"""Add the effects that a model lacks, one step at a time."""

import itertools
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import NamedTuple, overload

import pandas as pd

from ..._shared.arguments import arguments_checked, check_count, check_positive
from ..._shared.errors import InputError
from ..._shared.garbage import long_computation
from ..._shared.parts import done_by
from ..._shared.progress import Progress, no_progress
from ...effects.library import Library, kind_of
from ...experiment.data_checks.without_model import check_signal
from ...experiment.experiment import Experiment, Measurements
from ...experiment.modal_parameters import ModalParameters
from ...experiment.model_error import Embedded
from ...experiment.variants import as_measured
from ...inference.chi2 import LEVEL
from ...inference.record import record
from ...positions.channel import printable_name
from ..kept_fits import fits_kept_in
from ._alternatives import alternatives
from ._candidates import candidates_of, check_experiment
from ._cautions import cautions
from ._change_between_states import FoundEffect, found_effects
from ._claims import claims
from ._hypotheses import Hypothesis
from ._model_error_choice import Question, ticks
from ._posterior_odds import Comparison
from ._since_baseline import answered_by_states
from ._so_far import BestSoFar, Callback, Seen, no_callback
from ._standing import standing
from ._suspicion import suspicion
from ._weighed import NONE
from .decide import decide
from .fitted_model import FittedModel, Sampled, fitted_model, not_sampled, sampled_finalists
from .ledger import Ledger
from .states import LedgerOfStates, courses_of
from .table import Policy

MOST_EFFECTS = 3


@overload
def improve(
    experiment: Experiment,
    measurement: Measurements,
    *,
    baseline: Measurements | None = None,
    candidates: Library | None = None,
    level: float = LEVEL,
    most_effects: int = MOST_EFFECTS,
    model_error: Embedded | None = Embedded(),  # noqa: B008  it never changes
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: Progress = no_progress,
    callback: Callback = no_callback,
) -> Ledger: ...


@overload
def improve(
    experiment: Experiment,
    measurement: Mapping[str, Measurements],
    *,
    candidates: Library | None = None,
    level: float = LEVEL,
    most_effects: int = MOST_EFFECTS,
    model_error: Embedded | None = Embedded(),  # noqa: B008  it never changes
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: Progress = no_progress,
    callback: Callback = no_callback,
) -> LedgerOfStates: ...


@arguments_checked
@long_computation()
def improve(
    experiment: Experiment,
    measurement: Measurements | Mapping[str, Measurements],
    *,
    baseline: Measurements | None = None,
    candidates: Library | None = None,
    level: float = LEVEL,
    most_effects: int = MOST_EFFECTS,
    model_error: Embedded | None = Embedded(),  # noqa: B008  it never changes
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: Progress = no_progress,
    callback: Callback = no_callback,
) -> Ledger | LedgerOfStates:
    """Add the effects that a model lacks, until it passes its check or nothing pays any more.

    An effect is claimed only where the model without it fails its check, and where its evidence
    is strong (a Bayes factor of 20, candidates of the prior included). Several branches stay open,
    since the best single effect need not belong to the best pair, and each effect of the best
    explanation is taken away again and replaced.

    Parameters
    ----------
    experiment
        The model as given, with its priors.
    measurement
        What was measured: one measurement, or one for each force level. Or several states of the
        structure, such as growing damage, by label: the first is the baseline, and each later one
        is compared with it.
    baseline
        What was measured before, in an earlier state of the same structure: all unknowns are
        shared, model error included, and the effects are new since. Its lines may be other ones,
        and channels may be missing.
    candidates
        `effects.library(experiment)` by default.
    level
        Probability that a correct model fails its check of chi2.
    most_effects
        Most effects that are added.
    model_error
        Model error that is a rival of the candidates where the experiment has none and no candidate
        reaches the noise; None where the model must be taken for exact.
    store
        Folder in which fits are kept, one file each, named by a hash of all that they follow from.
        A later search, `explain` or `improve`, takes those that are there.
    executor
        Any `concurrent.futures.Executor` that does the parts, such as `design.workers()` gives, or
        one of a cluster; by default this process and its helpers do. The result is the same.
    progress
        Called with the share of the work done.
    callback
        Called with the best model so far, as soon as it is another one: the model as given first,
        then with one more effect each time. Only the ledger says what is claimed.

    Returns
    -------
    Ledger or LedgerOfStates
        The steps; of several states, the steps of each, and how every effect grows.

    Raises
    ------
    InputError
        If data and experiment do not match, there is no noise, or there is no candidate.
    InfeasibleError
        If a prior has no inverse distribution function.
    WorkerError
        If the executor loses a worker again and again, or takes no more.

    Examples
    --------
    >>> candidates = bp.effects.library(experiment, ["point_mass"])
    >>> ledger = bp.improve(experiment, surprise, candidates=candidates, model_error=None)
    >>> ledger.verdict
    ('point_mass',)
    """
    check_experiment(experiment, "improve")
    check_positive("level", level, "improve(..., level=0.01)", 0.999)
    check_count("most_effects", most_effects, 0, "improve(..., most_effects=3)")
    search = _Search(
        experiment, candidates_of(experiment, candidates), model_error, level, most_effects
    )
    with fits_kept_in(store), done_by(executor):
        if not isinstance(measurement, Mapping):
            return search.of(measurement, baseline, progress, callback).ledger
        _check_states(measurement, baseline)
        return search.of_states(measurement, progress, callback)


class _Search(NamedTuple):
    """What is searched for in any measurement of an experiment; fields as of `improve`."""

    experiment: Experiment
    tried: Library[Experiment]
    model_error: Embedded | None
    level: float
    most_effects: int

    def of(
        self,
        measurement: Measurements,
        baseline: Measurements | None,
        progress: Progress,
        callback: Callback,
        between: Hypothesis | None = None,
    ) -> "_Improved":
        """Search in one measurement, or for what is new in it since a baseline.

        What was claimed in a state in between is a candidate too.
        """
        began = time.perf_counter()
        check_signal(self.experiment, measurement)
        question = self._question(measurement, BestSoFar(callback))
        singles = len(self.tried.effects)
        # Where none of them explains the data, several together take most of the time.
        tick = ticks(progress, 0.02, (singles, 0.2), (2 * singles + 20, 0.9))
        answer, earlier = answered_by_states(question, tick, baseline, between)
        null, comparison, _ = answer
        policy = Policy(level=self.level)
        progress(0.9)
        best = answer.claimed(decide(answer.table(policy), policy))[-1]
        sampled = sampled_finalists(comparison, [best])
        progress(0.97)
        rows = answer.table(policy, sampled)
        decision = decide(rows, policy)
        steps = _steps(answer.claimed(decision), sampled)
        stands = standing(answer, decision, sampled)
        progress(1.0)
        ledger = Ledger(
            steps=steps,
            verdict=decision.kinds,
            probabilities=decision.probabilities,
            confounded=decision.confounded,
            unexplained=decision.unexplained,
            seconds=time.perf_counter() - began,
            experiment=best.problem.experiment,
            given=self.experiment,
            measurement=measurement,
            compared=_compared(comparison),
            suspicion=suspicion(null, comparison.candidates),
            alternatives=alternatives(comparison, comparison.distinct(), sampled),
            cautions=(*cautions(best, sampled.get(id(best))), *not_sampled(best, sampled)),
            **({} if earlier is None else earlier.in_full),
            record=record(self.experiment, [measurement, baseline]),
            effects=claims(comparison, best, steps[-1], stands, decision.probabilities[NONE]),
            reach=comparison.reach,
            standing=stands,
            rows=rows,
            policy=policy,
        )
        return _Improved(ledger, best, found_effects(best, steps[-1]))

    def _question(self, measurement: Measurements, seen: Seen) -> Question:
        asked = self.experiment, self.experiment.data(measurement), self.tried, self.model_error
        return Question.of(*asked, level=self.level, most_effects=self.most_effects, seen=seen)

    def of_states(
        self, states: Mapping[str, Measurements], progress: Progress, callback: Callback
    ) -> LedgerOfStates:
        """Search in each later state for what is new since the first."""
        first, *later = states
        improved: dict[str, _Improved] = {}
        between = None
        for number, label in enumerate(later):
            share = _share(progress, number, len(later))
            improved[label] = self._in(states[label]).of(
                states[label], states[first], share, callback, between
            )
            between = improved[label].best
        return LedgerOfStates(
            baseline=first,
            ledgers={label: state.ledger for label, state in improved.items()},
            courses=courses_of({label: state.claims for label, state in improved.items()}),
        )

    def _in(self, measurement: Measurements) -> "_Search":
        """The search in a state, whose modes the experiment observes where it observes modes."""
        if self.experiment.observe.is_modal and isinstance(measurement, ModalParameters):
            return self._replace(experiment=as_measured(self.experiment, measurement))
        return self


class _Improved(NamedTuple):
    """Ledger of one measurement, the hypothesis that it claims, and its effects."""

    ledger: Ledger
    best: Hypothesis
    claims: tuple[FoundEffect, ...]


def _share(progress: Progress, number: int, count: int) -> Progress:
    """Report one of several equal parts of the work."""
    return lambda done: progress((number + done) / count)


def _check_states(states: Mapping[str, Measurements], baseline: object) -> None:
    """Refuse states of which there is only one, a label that is none, or a second baseline."""
    for label in states:
        printable_name("A state of the label", label)
    if len(states) < 2 or baseline is not None:
        raise InputError(
            f"{len(states)} states by label were given"
            f"{'' if baseline is None else ' and a baseline as well'}; at least two are needed "
            "and no baseline, since the first one is what the others are compared with: "
            'bp.improve(experiment, {"undamaged": before, "5 mm cut": after}).'
        )


def _steps(way: Sequence[Hypothesis], sampled: Sampled) -> tuple[FittedModel, ...]:
    """The way from the model as given to what is claimed, laid out for the record."""
    steps = [fitted_model(way[0], sampled)]
    for before, after in itertools.pairwise(way):
        steps.append(fitted_model(after, sampled, _added(before, after)))
    return tuple(steps)


def _added(before: Hypothesis, after: Hypothesis) -> list[str]:
    """Names of the effects that one has more than another, which may name its own otherwise."""
    known = {effect.name for effect in before.effects}
    added = set[str]()
    for kind, count in (Counter(after.kinds) - Counter(before.kinds)).items():
        alike = [effect.name for effect in after.effects if kind_of(effect) == kind]
        added |= {*sorted(alike, key=known.__contains__)[:count]}
    return [effect.name for effect in after.effects if effect.name in added]


def _compared(comparison: Comparison) -> pd.DataFrame:
    rows = [
        {
            "effects": " + ".join(hypothesis.kinds) or "none",
            "chi2_per_datum": hypothesis.chi2_per_datum,
            "log_evidence": hypothesis.log_evidence,
            "log_odds": comparison.log_odds(hypothesis),
        }
        for hypothesis in comparison.distinct()
    ]
    return pd.DataFrame(rows)
