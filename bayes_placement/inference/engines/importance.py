"""importance: in, draws from the prior; out, the same draws weighted by their likelihood.

Equations (27) and (28). Not known here: structures, placement.
"""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from arviz_stats.base import array_stats
from jax.scipy.special import logsumexp
from jaxtyping import Array, Float

from ..._types import InputError, Key, Progress
from ._engine import Draws, Engine, Posterior, in_batches

GOOD_PARETO_K = 0.7
LEAST_ESS = 10


class Importance(Engine):
    """Importance sampling from the prior, Eqs. (27) and (28).

    Parameters
    ----------
    draws
        Draws from the prior, n_sim,h of the paper.
    batch
        Draws evaluated at a time; bounds the memory.
    """

    draws: int = eqx.field(static=True, default=1000)
    batch: int = eqx.field(static=True, default=250)

    def run(self, posterior: Posterior, key: Key, progress: Progress) -> Draws:
        """Weight draws from the prior by their likelihood."""
        vectors = posterior.sample_prior(key, self.draws)
        batch = min(self.batch, self.draws)
        evaluate = jax.jit(jax.vmap(posterior.log_likelihood))
        likelihood = in_batches(evaluate, vectors, batch, progress)
        found = weighted(vectors, likelihood, jnp.full(self.draws, -jnp.log(self.draws)))
        return _diagnosed(found)

    def settings(self) -> dict[str, Any]:
        """Name and number of draws."""
        return {"engine": "Importance", "draws": self.draws}


def weighted(
    vectors: Float[Array, "draw unknown"],
    likelihood: Float[Array, "draw"],
    log_prior_weight: Float[Array, "draw"],
) -> Draws:
    """Posterior of points of the prior that carry prior weights summing to one."""
    log_weight = likelihood + log_prior_weight
    if not np.any(np.isfinite(likelihood)):
        raise InputError(
            "No draw from the prior has a finite likelihood, so nothing can be weighted. The model "
            "cannot produce these data, or the kernels are too narrow: check the units of the "
            "measurement, widen the priors, or give the experiment an output error."
        )
    evidence = logsumexp(log_weight)
    return Draws(
        position=vectors[None],
        log_likelihood=likelihood[None],
        log_weight=(log_weight - evidence)[None],
        log_evidence=float(evidence),
    )


def _diagnosed(found: Draws) -> Draws:
    share = np.exp(np.asarray(found.log_weight))
    relative = share * share.size
    k, ess = pareto_k(found.log_weight), float(1 / np.sum(share**2))
    attributes = {"weight_ess": ess, "pareto_k": k}
    complaint = (
        f"Importance sampling is unreliable here: {ess:.0f} of {share.size} draws are effective "
        f"and Pareto k = {k:.2f}, where {LEAST_ESS} draws and at most {GOOD_PARETO_K} are needed; "
        "use more draws, or engines.SMC()."
    )
    poor = k > GOOD_PARETO_K or ess < LEAST_ESS
    return dataclasses.replace(
        found,
        log_evidence_error=float(np.std(relative) / np.sqrt(share.size)),
        attributes=attributes,
        complaints=(complaint,) if poor else (),
    )


def pareto_k(log_weight: Any) -> float:
    """Shape of the tail of the weights; above 0.7 the estimates cannot be trusted.

    Zero for equal weights, which have no tail; infinite where nearly all of them vanish, so that
    no tail is left to be fitted.
    """
    finite = np.asarray(log_weight)[np.isfinite(log_weight)]
    if np.ptp(finite) < 1e-6:
        return 0.0
    with np.errstate(all="ignore"):  # a tail of zeros divides by zero
        k = float(array_stats.psislw(-finite)[1])  # it takes log likelihoods left out
    return k if np.isfinite(k) else float("inf")
