"""_confirm: in, a fit and its Laplace approximation; out, draws and evidence sampled from there.

Not known here: candidates, what is claimed. Draws from a Gaussian a little wider than Laplace's are
weighted. Where their weights cannot be trusted, draws are made along the ridges of the posterior;
where these cannot either, SMC goes on from the Gaussian.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import logsumexp

from ..._types import InfeasibleError, Key, no_progress
from ...inference.engines import SMC
from ...inference.weights import GOOD_PARETO_K, pareto_k
from ._descent import Fit
from ._problem import Problem
from ._randomised import DRAWS as ALONG_RIDGES
from ._randomised import Weighted, randomised

WIDER = 1.2
"""Standard deviation of the reference over that of Laplace's Gaussian."""

DRAWS, KEPT, BLOCK = 4096, 1600, 256
"""Draws that are weighted, those kept of them by their weights, and those evaluated together."""

LEAST_ESS = 400.0
"""Weights are trusted of which so many are effective, and whose tail is not too heavy."""

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

    def symmetric_images(self, flat: Any) -> list[Any]:
        """None."""
        return []

    def sample_prior(self, key: Key, draws: int) -> Any:
        """Draws from the Gaussian."""
        return self.mode + jax.random.normal(key, (draws, self.dimension)) @ self.root.T

    def prior_quadrature(
        self, nodes: int, box: list[tuple[float, float]] | None = None
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
    found = _trusted(_from_gaussian(problem, reference, seed), LEAST_ESS, seed)
    if found is None and problem.known_noise:
        found = _trusted(randomised(problem, fit, seed), ALONG_RIDGES / 2, seed)
    if found is not None:
        return found
    draws = ENGINE.run(reference, jax.random.PRNGKey(seed), no_progress)
    points = np.asarray(draws.position).reshape(-1, problem.dimension)
    return Confirmed(points, draws.log_evidence, draws.log_evidence_error)


def _from_gaussian(problem: Problem, reference: Reference, seed: int) -> Weighted:
    normal = np.random.default_rng(seed).standard_normal((DRAWS, problem.dimension))
    points = np.asarray(reference.mode) + normal @ np.asarray(reference.root).T
    blocks = np.split(points, DRAWS // BLOCK)
    posterior = np.concatenate([_log_density(problem, block) for block in blocks])
    volume = reference.log_volume + problem.dimension * reference.constant
    log_weight = posterior + 0.5 * np.einsum("di,di->d", normal, normal) + volume
    return Weighted(points, np.where(np.isfinite(log_weight), log_weight, -np.inf))


def _trusted(weighted: Weighted | None, least: float, seed: int) -> Confirmed | None:
    """Draws by their weights and the evidence; None where the weights cannot be trusted."""
    if weighted is None:
        return None
    count, log_weight = len(weighted.points), weighted.log_weight
    share = np.exp(log_weight - logsumexp(log_weight))
    if not pareto_k(log_weight) < GOOD_PARETO_K or not 1 / np.sum(share**2) > least:
        return None
    evidence = float(logsumexp(log_weight) - np.log(count))
    steps = (np.arange(KEPT) + np.random.default_rng(seed + 1).uniform()) / KEPT
    kept = np.minimum(np.searchsorted(np.cumsum(share), steps), count - 1)
    error = float(np.std(share * count) / np.sqrt(count))
    return Confirmed(weighted.points[kept], evidence, error)


def _log_density(problem: Problem, points: np.ndarray) -> np.ndarray:
    """Log of prior times likelihood."""
    residual, spread = problem.residuals(points)
    squares = np.einsum("dn,dn->d", residual, residual) + np.einsum("di,di->d", points, points)
    constants = (problem.count + problem.dimension) * 0.5 * np.log(2 * np.pi)
    return -0.5 * squares - spread - constants
