"""Rank the effects that a model may lack, each added alone."""

from threadpoolctl import threadpool_limits

from ..._types import Progress, no_progress
from ...effects.library import Library
from ...experiment.experiment import Experiment, Measurements
from ._alternatives import alternatives
from ._candidates import candidates_of
from ._hypotheses import null_hypothesis
from ._score_test import suspicion
from ._search import single_effects
from .fitted_model import fitted_model, sampled_finalists
from .ranking import Ranking


@threadpool_limits.wrap(limits=1)  # small products: BLAS threads would only wait for each other
def explain(
    experiment: Experiment,
    measurement: Measurements,
    *,
    candidates: Library[Experiment] | None = None,
    progress: Progress = no_progress,
) -> Ranking:
    """Say which effect is missing from a model, if any.

    Each candidate gets a score test at its weakest (the suspicion map), then is fitted from many
    starts. Fits are compared by evidence: Laplace's approximation, and sampling for the finalists;
    and by how well they predict a channel or a band that they were not fitted to.

    Parameters
    ----------
    experiment
        The model as given, with its priors.
    measurement
        What was measured: one measurement, or one for each force level.
    candidates
        `effects.library(experiment)` by default.
    progress
        Called with the share of the work done.

    Raises
    ------
    InputError
        If data and experiment do not match, there is no noise, or there is no candidate.
    InfeasibleError
        If a prior has no inverse distribution function.
    """
    data = experiment.data(measurement)
    effects = candidates_of(experiment, candidates)
    count, done = len(effects) + 2, iter(range(1, len(effects) + 2))
    null = null_hypothesis(experiment, data)
    comparison = single_effects(null, effects, lambda: progress(next(done) / count))
    shown = comparison.distinct()
    sampled = sampled_finalists(comparison, shown)
    steps = tuple(fitted_model(hypothesis, sampled) for hypothesis in shown)
    progress(1.0)
    return Ranking(
        steps=steps,
        probabilities=comparison.probabilities(),
        confounded=tuple(comparison.confounded()),
        suspicion=suspicion(null, comparison.candidates),
        alternatives=alternatives(comparison, shown, sampled),
    )
