"""_confirm: in, a fit and its Laplace approximation; out, draws and evidence sampled from there.

Not known here: candidates, what is claimed. Draws from a Gaussian a little wider than Laplace's are
weighted; where their weights cannot be trusted, SMC goes on from the same Gaussian.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import logsumexp

from .._types import InfeasibleError, Key, no_progress
from ..engines import SMC
from ..engines.importance import pareto_k
from ._descent import Fit
from ._problem import Problem

WIDER = 1.2
"""Standard deviation of the reference over that of Laplace's Gaussian."""

DRAWS, KEPT, BLOCK = 4096, 1600, 256
"""Draws that are weighted, those kept of them by their weights, and those evaluated together."""

GOOD_PARETO_K, LEAST_ESS = 0.7, 400.0
"""Weights are trusted whose tail is no heavier, and of which so many are effective."""

ENGINE = SMC(particles=400, populations=4, moves=10, prior_draws=2)


class Reference:
    """Posterior whose tempering begins at a wide Gaussian about the fit, not at the prior.

    What engines call the prior is that Gaussian; what they call the likelihood is the posterior
    density over it, so that the evidence is that of the model.
    """

    def __init__(self, problem: Problem, fit: Fit):
        self.problem = problem
        self.dimension = problem.dimension
        self.mode = jnp.asarray(fit.point)
        self.root = WIDER * jnp.linalg.cholesky(jnp.asarray(fit.covariance))
        self.log_volume = float(jnp.sum(jnp.log(jnp.diag(self.root))))
        self.constant = 0.5 * np.log(2 * np.pi)

    def log_prior(self, flat: Any) -> Any:
        """Log density of the Gaussian."""
        unit = jax.scipy.linalg.solve_triangular(self.root, flat - self.mode, lower=True)
        return -0.5 * unit @ unit - self.log_volume - self.dimension * self.constant

    def log_likelihood(self, flat: Any) -> Any:
        """Log of the posterior density over that of the Gaussian, not normalised."""
        residual, spread = self.problem.residual(flat, False)
        likelihood = -0.5 * residual @ residual - spread - self.problem.count * self.constant
        prior = -0.5 * flat @ flat - self.dimension * self.constant
        return likelihood + prior - self.log_prior(flat)

    def log_jacobian(self, flat: Any) -> Any:
        """Zero: the vector itself is what is named."""
        return jnp.zeros(())

    def alternatives(self, flat: Any) -> list[Any]:
        """None."""
        return []

    def sample_prior(self, key: Key, draws: int) -> Any:
        """Draws from the Gaussian."""
        return self.mode + jax.random.normal(key, (draws, self.dimension)) @ self.root.T

    def prior_quadrature(
        self, points: int, box: list[tuple[float, float]] | None = None
    ) -> tuple[Any, Any]:
        """Refuse: there is no prior here to lay nodes over."""
        raise InfeasibleError(
            "engines.Grid was asked to confirm a fit, but it needs the prior itself. Use "
            "engines.SMC()."
        )


class Confirmed(NamedTuple):
    """Draws of a posterior about a fit [draw, unknown], and its log evidence with its error."""

    points: np.ndarray
    log_evidence: float
    log_evidence_error: float


def confirmed(problem: Problem, fit: Fit, seed: int = 0) -> Confirmed:
    """Sample the posterior about a fit."""
    reference = Reference(problem, fit)
    weighted = _weighted(problem, reference, np.random.default_rng(seed))
    if weighted is not None:
        return weighted
    draws = ENGINE.run(reference, jax.random.PRNGKey(seed), no_progress)
    points = np.asarray(draws.position).reshape(-1, problem.dimension)
    return Confirmed(points, draws.log_evidence, draws.log_evidence_error)


def _weighted(problem: Problem, reference: Reference, rng: np.random.Generator) -> Confirmed | None:
    """Importance sampling; None where the weights cannot be trusted."""
    normal = rng.standard_normal((DRAWS, problem.dimension))
    points = np.asarray(reference.mode) + normal @ np.asarray(reference.root).T
    blocks = np.split(points, DRAWS // BLOCK)
    posterior = np.concatenate([_log_density(problem, block) for block in blocks])
    volume = reference.log_volume + problem.dimension * reference.constant
    log_weight = posterior + 0.5 * np.einsum("di,di->d", normal, normal) + volume
    log_weight = np.where(np.isfinite(log_weight), log_weight, -np.inf)
    share = np.exp(log_weight - logsumexp(log_weight))
    if not pareto_k(log_weight) < GOOD_PARETO_K or not 1 / np.sum(share**2) > LEAST_ESS:
        return None
    evidence = float(logsumexp(log_weight) - np.log(DRAWS))
    steps = (np.arange(KEPT) + rng.uniform()) / KEPT
    kept = np.minimum(np.searchsorted(np.cumsum(share), steps), DRAWS - 1)
    return Confirmed(points[kept], evidence, float(np.std(share * DRAWS) / np.sqrt(DRAWS)))


def _log_density(problem: Problem, points: np.ndarray) -> np.ndarray:
    """Log of prior times likelihood."""
    residual, spread = problem.residuals(points)
    squares = np.einsum("dn,dn->d", residual, residual) + np.einsum("di,di->d", points, points)
    constants = (problem.count + problem.dimension) * 0.5 * np.log(2 * np.pi)
    return -0.5 * squares - spread - constants
