"""Importance sampling from the prior, Eqs. (27) and (28) of the paper."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from scipy.special import logsumexp

from ..._shared.arguments import check_count
from ..._shared.dimensions import Key
from ..._shared.errors import InputError
from ..._shared.progress import Progress
from ..estimates import GOOD_PARETO_K, effective_size, pareto_k
from .engine import (
    Draws,
    Engine,
    EngineDraws,
    PerDraw,
    PosteriorDensity,
    log_likelihoods_in_batches,
)

LEAST_ESS = 10


class Importance(Engine):
    """Importance sampling from the prior, Eqs. (27) and (28).

    Parameters
    ----------
    draws
        Draws from the prior, n_sim,h of the paper.
    batch
        Draws evaluated at a time; bounds the memory.

    Examples
    --------
    >>> bp.engines.Importance(draws=5000).settings()
    {'engine': 'Importance', 'draws': 5000}
    """

    draws: int = eqx.field(static=True, default=1000)
    batch: int = eqx.field(static=True, default=250)

    def __check_init__(self) -> None:
        """Refuse numbers of draws that sample nothing."""
        check_count("draws", self.draws, 1, "engines.Importance(draws=1000)")
        check_count("batch", self.batch, 1, "engines.Importance(batch=250)")

    def run(self, posterior: PosteriorDensity, key: Key, progress: Progress) -> EngineDraws:
        """Weight draws from the prior by their likelihood."""
        vectors = posterior.sample_prior(key, self.draws)
        batch = min(self.batch, self.draws)
        likelihood = log_likelihoods_in_batches(posterior, vectors, batch, progress)
        equal = jnp.full(self.draws, -jnp.log(self.draws))
        return _diagnosed(weighted(vectors, likelihood, equal))


def weighted(vectors: Draws, likelihood: PerDraw, log_prior_weight: PerDraw) -> EngineDraws:
    """Draws or nodes of the prior, whose weights sum to one, weighted by their log likelihood."""
    log_weight = likelihood + log_prior_weight
    if not np.any(np.isfinite(likelihood)):
        raise InputError(
            "No draw from the prior has a finite likelihood, so nothing can be weighted. The model "
            "cannot produce these data, or the kernels are too narrow: check the units of the "
            "measurement, widen the priors, or give the experiment an output error."
        )
    evidence = float(logsumexp(log_weight))
    return EngineDraws(
        position=vectors[None],
        log_likelihood=likelihood[None],
        log_weight=(log_weight - evidence)[None],
        log_evidence=evidence,
    )


def _diagnosed(draws: EngineDraws) -> EngineDraws:
    log_weight = np.asarray(draws.log_weight)
    relative = np.exp(log_weight) * log_weight.size
    k, ess = pareto_k(log_weight), float(effective_size(log_weight))
    warning = (
        f"Importance sampling is unreliable here: {ess:.0f} of {relative.size} draws are effective "
        f"and Pareto k = {k:.2f}, where {LEAST_ESS} draws and at most {GOOD_PARETO_K} are needed; "
        "use more draws, or engines.SMC()."
    )
    unreliable = k > GOOD_PARETO_K or ess < LEAST_ESS
    return dataclasses.replace(
        draws,
        log_evidence_error=float(np.std(relative) / np.sqrt(relative.size)),
        attributes={"weight_ess": ess, "pareto_k": k},
        warnings=(warning,) if unreliable else (),
    )
