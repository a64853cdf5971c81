"""Rank the effects that a model may lack, each added alone."""

from concurrent.futures import Executor
from pathlib import Path

from ..._shared.arguments import arguments_checked
from ..._shared.garbage import long_computation
from ..._shared.parts import done_by
from ..._shared.progress import Progress, no_progress
from ...effects.library import Library
from ...experiment.data_checks.without_model import check_signal
from ...experiment.experiment import Experiment, Measurements
from ...experiment.model_error import Embedded
from ...inference.chi2 import LEVEL
from ...inference.record import record
from ..kept_fits import fits_kept_in
from ._alternatives import alternatives
from ._candidates import candidates_of, check_experiment
from ._claims import claims
from ._model_error_choice import Question, ticks
from ._since_baseline import answered_by_states
from ._standing import standing
from ._suspicion import suspicion
from ._weighed import NONE
from .decide import decide
from .fitted_model import fitted_model, sampled_finalists
from .ranking import Ranking
from .table import AS_STATED

LEADING = 6
"""Hypotheses of the greatest odds that are reported in full."""


@arguments_checked
@long_computation()
def explain(
    experiment: Experiment,
    measurement: Measurements,
    *,
    baseline: Measurements | None = None,
    candidates: Library[Experiment] | None = None,
    model_error: Embedded | None = Embedded(),  # noqa: B008  it never changes
    store: str | Path | None = None,
    executor: Executor | None = None,
    progress: Progress = no_progress,
) -> Ranking:
    """Say which effect is missing from a model, if any.

    Each candidate gets a score test at its weakest (the suspicion map; of swapped pairs those few
    that leave least), then is fitted from many starts: where another one explains the data, those
    on few channels alone that may still win. Fits are compared by evidence: Laplace's
    approximation, and sampling for the finalists; and by how well they predict a channel or a band
    that they were not fitted to.

    Parameters
    ----------
    experiment
        The model as given, with its priors.
    measurement
        What was measured: one measurement, or one for each force level.
    baseline
        What was measured before, in an earlier state of the same structure; see `improve`.
    candidates
        `effects.library(experiment)` by default.
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

    Returns
    -------
    Ranking
        Probabilities by kind, fits, the suspicion map, and sentences, the verdict first.

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
    >>> ranking = bp.explain(experiment, surprise, candidates=candidates, model_error=None)
    >>> max(ranking.probabilities, key=ranking.probabilities.get)
    'point_mass'
    """
    check_experiment(experiment, "explain")
    check_signal(experiment, measurement)
    data = experiment.data(measurement)
    tried = candidates_of(experiment, candidates)
    question = Question.of(experiment, data, tried, model_error, level=LEVEL)
    count = 2 * len(tried.effects) + 2
    with fits_kept_in(store), done_by(executor):
        tick = ticks(progress, 0.0, (count, 0.9))
        answer, earlier = answered_by_states(question, tick, baseline)
    null, comparison, _ = answer
    shown = comparison.distinct()
    sampled = sampled_finalists(comparison, shown)
    leading = {id(hypothesis) for hypothesis in [*shown[:LEADING], comparison.hypotheses[0]]}
    steps = tuple(
        fitted_model(hypothesis, sampled, in_full=id(hypothesis) in leading) for hypothesis in shown
    )
    rows = answer.table(AS_STATED, sampled)
    decision = decide(rows)
    stands, none = standing(answer, decision, sampled), decision.probabilities[NONE]
    best = answer.claimed(decision)[-1]
    progress(1.0)
    return Ranking(
        steps=steps,
        probabilities=decision.probabilities,
        confounded=decision.confounded,
        suspicion=suspicion(null, comparison.candidates),
        alternatives=alternatives(comparison, shown, sampled),
        claimed=decision.kinds,
        **({} if earlier is None else earlier.in_full),
        record=record(experiment, [measurement, baseline]),
        effects=claims(comparison, best, fitted_model(best, sampled, in_full=False), stands, none),
        reach=comparison.reach,
        standing=stands,
        rows=rows,
    )
