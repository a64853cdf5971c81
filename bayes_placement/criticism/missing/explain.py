"""explain: in, the result of an inference and candidates; out, which effect is missing, if any.

Not known here: how to go on to several effects.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import jax.numpy as jnp
import numpy as np
import pandas as pd
import xarray as xr
from threadpoolctl import threadpool_limits

from ..._types import InputError, Progress, no_progress
from ...effects.library import Library
from ...experiment.experiment import MEASURED, Experiment
from ...experiment.noise import Data
from ...inference.alternative_explanation import Alternative
from ...inference.engines.about_mode import SampledPosterior, sampled_about
from ._alternatives import alternatives
from ._branches import singles
from ._estimates import Estimate, estimates
from ._held_out import held_out
from ._hypotheses import Hypothesis, alone
from ._odds import NONE, NOTHING, STRONG, Pool, p_value
from ._suspicion import suspicion
from .ledger import Step

FINALISTS = 3
"""Hypotheses, at most, whose evidence is confirmed by sampling."""


@dataclass(frozen=True)
class Explanation:
    """Which effect may be missing.

    Parameters
    ----------
    steps
        The model as given, and with the best variant of each kind of effect, by falling odds.
    probabilities
        Posterior probability of each kind, of `nothing_missing` and of `none_of_these`.
    confounded
        Pairs of kinds that these data cannot tell apart.
    suspicion
        Score of every candidate along its places: `kind`, `variant`, `setting` in words, `at` [m]
        along a line, `x`, `y`, `z` [m] in space, `score`, and `p_value` corrected for having
        looked in many places.
    alternatives
        Explanations that survive, with draws of their unknowns: those of nearly the best odds and
        those that leave no more than the noise. `information.Separation` tells where to measure
        next, so that one of them is left.
    """

    steps: tuple[Step, ...]
    probabilities: dict[str, float]
    confounded: tuple[tuple[str, str], ...]
    suspicion: pd.DataFrame = field(repr=False)
    alternatives: tuple[Alternative, ...] = field(repr=False)

    def table(self) -> pd.DataFrame:
        """One row for each kind, the most probable first."""
        scores = self.suspicion.groupby("kind")["p_value"].min()
        rows = []
        for step in self.steps:
            kind = step.added or NOTHING
            rows.append(
                {
                    "effect": kind,
                    "probability": f"{self.probabilities[kind]:.3g}",
                    "chi2 per datum": f"{step.chi2_per_datum:.4g}",
                    "log evidence": f"{step.log_evidence:.1f}",
                    "held out": f"{step.held_out:.3f}",
                    "p of score": f"{scores[kind]:.2g}" if kind in scores else "",
                    "parameters": step.found(),
                }
            )
        return pd.DataFrame(rows).set_index("effect")

    def words(self) -> list[str]:
        """Say what is most probable, and what cannot be told apart."""
        likely = max(self.probabilities, key=lambda kind: self.probabilities[kind])
        share = self.probabilities[likely]
        said = {
            NOTHING: f"Nothing is missing, with probability {share:.3g}.",
            NONE: "Something is missing, but none of the candidates explains the data down to the "
            f"stated noise (probability {share:.3g}). Two effects at once are tried by improve.",
        }.get(likely, f"Missing is {likely}, with probability {share:.3g}.")
        pairs = [
            f"These data cannot tell {one} from {other}: either explains them down to the noise."
            for one, other in self.confounded
        ]
        return [said, *pairs]

    def __str__(self) -> str:
        """Lay out the table and the words."""
        lines = [f"- {line}" for line in self.words()]
        return "\n".join([self.table().to_string(), "", *lines])


@threadpool_limits.wrap(limits=1)  # small products: BLAS threads would only wait for each other
def explain(
    posterior: xr.DataTree, candidates: Library, *, progress: Progress = no_progress
) -> Explanation:
    """Say which of some effects is missing from a fitted model.

    Each candidate gets a score test at its weakest (the suspicion map), then is fitted from many
    starts. Fits are compared by evidence: Laplace's method, confirmed by sampling for the
    finalists; and by how well they foretell a channel or a band that they have not seen.

    Parameters
    ----------
    posterior
        What `infer` returned for the experiment of the candidates.
    candidates
        `effects.library(experiment)`.
    progress
        Called with the share of the work done.

    Raises
    ------
    ValueError
        If the posterior belongs to another experiment, or there is no candidate.
    """
    data = observed(posterior, candidates.experiment)
    if not candidates.effects:
        raise InputError(
            "No candidate was given, so nothing can be compared. Give some: "
            "effects.library(experiment)."
        )
    count, done = len(candidates.effects) + 2, iter(range(1, len(candidates.effects) + 2))
    null = alone(candidates.experiment, data)
    pool = singles(null, candidates.effects, lambda: progress(next(done) / count))
    shown = pool.distinct()
    draws = finalists(pool, shown)
    steps = tuple(step_of(one, draws) for one in shown)
    progress(1.0)
    return Explanation(
        steps=steps,
        probabilities=pool.probabilities(),
        confounded=tuple(pool.confounded()),
        suspicion=suspicion(null, pool.scanned),
        alternatives=alternatives(pool, shown, draws),
    )


Sampled = dict[int, SampledPosterior]
"""Finalists that were sampled, by identity."""


def finalists(pool: Pool, chosen: Sequence[Hypothesis]) -> Sampled:
    """Draws, log evidence and its error of the hypotheses that evidence hardly tells apart."""
    best = max(pool.log_odds(one) for one in chosen)
    close = [one for one in chosen if pool.log_odds(one) > best - 3 * STRONG][:FINALISTS]
    return {id(one): sampled_about(one.problem.squares, one.fit) for one in close}


def step_of(hypothesis: Hypothesis, draws: Sampled, added: str | None = None) -> Step:
    """Lay out a fitted hypothesis for the record."""
    points, evidence, error = draws.get(id(hypothesis), (None, hypothesis.fit.log_evidence, None))
    named = hypothesis.effects[-1].name if hypothesis.effects else None
    return Step(
        added=added or named,
        effects=tuple(effect.name for effect in hypothesis.effects),
        parameters=estimates(hypothesis, points),
        chi2_per_datum=hypothesis.chi2_per_datum,
        p_value=p_value(hypothesis),
        log_evidence=float(evidence),
        log_evidence_error=error,
        held_out=held_out(hypothesis),
        setting=_setting(hypothesis, added or named),
    )


def _setting(hypothesis: Hypothesis, added: str | None) -> str:
    """Which sensor or part of the structure the added effect is about."""
    experiment = hypothesis.problem.experiment
    every = {one.name: one for one in experiment.effects}
    return every[added].setting(experiment.structure.modes, experiment.instruments) if added else ""


def observed(posterior: xr.DataTree, experiment: Experiment) -> Data:
    """Take the data out of a result, as the experiment of some candidates has them.

    Raises
    ------
    ValueError
        If unknowns or outputs of the two are not the same.
    """
    theirs = {str(name) for name in posterior["posterior"].data_vars}
    ours = {one.name for one in experiment.unknowns}
    if theirs != ours:
        strange = ", ".join(sorted(theirs ^ ours))
        raise InputError(
            f"The posterior and the candidates differ in {strange}: they belong to different "
            "experiments, whose misfits are not the same. Take the candidates of the experiment "
            "that was inferred: effects.library(experiment)."
        )
    z = np.asarray(posterior["observed_data"][MEASURED])
    if "deviation" in posterior["observed_data"]:
        deviation = jnp.asarray(np.asarray(posterior["observed_data"]["deviation"]))
    else:
        deviation = None
    return Data(jnp.asarray(np.nan_to_num(z)), np.isfinite(z), deviation)


__all__ = ["Estimate", "Explanation", "explain"]
