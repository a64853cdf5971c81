"""Draws and evidence of a posterior about its mode.

Draws from a Gaussian a little wider than Laplace's are weighted. Where their weights cannot be
trusted, draws are made along the ridges of the posterior; where these cannot either, SMC goes on
from the Gaussian, unless it would have to follow gradients, which takes minutes.
"""

from collections.abc import Iterator
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import logsumexp

from ..._shared.dimensions import Key
from ..._shared.errors import InfeasibleError
from ..._shared.progress import no_progress
from .. import engines
from ..estimates import GOOD_PARETO_K, Given, effective_size, pareto_k
from .engine import Box, Draws, Engine, Flat, Nodes, Scalar
from .laplace import Laplace
from .least_squares import Evaluate, LeastSquares
from .levenberg_marquardt import Fit
from .randomised_maximum_likelihood import DRAWS as RANDOMISED_DRAWS
from .randomised_maximum_likelihood import Weighted, randomised_maximum_likelihood

WIDER, MUCH_WIDER = 1.2, 2.0
"""Standard deviation over that of Laplace's Gaussian: of draws that are weighted, and of those that
SMC begins with, which must reach the tails of the posterior and modes that are near."""

DRAWS, KEPT, BLOCK = 4096, 1600, 256
"""Draws that are weighted, those kept of them by their weights, and those evaluated together."""

LEAST_ESS = 400.0
"""Effective draws below which weights are not trusted."""

PARTICLES = ((400, 4), (1600, 8))
"""Particles and populations of SMC; the second ones where the evidence of the first is too
uncertain."""

FOLLOWS_GRADIENTS = 12
"""Unknowns from which SMC follows gradients, as `_trajectories.MANY` says."""

MOST_ERROR = 0.1
"""Standard error of the log evidence above which it is too uncertain: a tenth of the difference
from which on a mention is worth it (Kass and Raftery, doi:10.1080/01621459.1995.10476572)."""


class Reference(eqx.Module):
    """Posterior whose tempering begins at a wide Gaussian about the mode, not at the prior.

    What engines call the prior is that Gaussian; what they call the likelihood is the posterior
    density over it, so that the evidence is that of the model.
    """

    evaluate: Evaluate
    """Residuals over their standard deviations, and the sum of the logs of these."""
    gaussian: Laplace
    """The Gaussian."""
    dimension: int = eqx.field(static=True)
    count: int = eqx.field(static=True)
    """Number of unknowns and of data."""

    def least_squares(self) -> None:
        """Not over the Gaussian."""
        return

    def hierarchy(self) -> None:
        """Sizes of errors are numbers here."""
        return

    def log_prior(self, flat: Flat) -> Scalar:
        """Log density of the Gaussian."""
        mode, root = jnp.asarray(self.gaussian.mode), jnp.asarray(self.gaussian.root)
        normal = jax.scipy.linalg.solve_triangular(root, flat - mode, lower=True)
        log_volume = self._constants(self.dimension) + jnp.sum(jnp.log(jnp.diagonal(root)))
        return -0.5 * normal @ normal - log_volume

    def log_likelihood(self, flat: Flat) -> Scalar:
        """Log of the posterior density over that of the Gaussian, not normalised."""
        residual, log_scale = (value[0] for value in self.evaluate(flat[None], False))
        squares = residual @ residual + flat @ flat
        posterior = -0.5 * squares - log_scale - self._constants(self.count + self.dimension)
        return posterior - self.log_prior(flat)

    def _constants(self, count: int) -> float:
        return 0.5 * count * float(np.log(2 * np.pi))

    def log_jacobian(self, flat: Flat) -> Scalar:
        """Zero: the vector itself is what is named."""
        return jnp.zeros(())

    def symmetric_images(self, flat: Flat) -> list[Flat]:
        """None."""
        return []

    def vector(self, values: Given) -> Flat:
        """Refuse: the unknowns have no names here."""
        raise InfeasibleError(
            "Values by name were given to begin at, but what is sampled about a mode has no names. "
            "Use engines.SMC()."
        )

    def sample_prior(self, key: Key, draws: int) -> Draws:
        """Draws from the Gaussian."""
        normal = jax.random.normal(key, (draws, self.dimension))
        return jnp.asarray(self.gaussian.mode) + normal @ jnp.asarray(self.gaussian.root).T

    def prior_quadrature(self, nodes: int, box: Box | None = None) -> Nodes:
        """Refuse: there is no prior here to lay nodes over."""
        raise InfeasibleError(
            "engines.Grid was asked to sample about a mode, but it needs the prior itself. Use "
            "engines.SMC()."
        )


class SampledPosterior(NamedTuple):
    """Draws of a posterior about its mode [draw, unknown], and its log evidence with its error."""

    points: np.ndarray
    log_evidence: float
    log_evidence_error: float


def sampled_about(problem: LeastSquares, fit: Fit, seed: int = 0) -> SampledPosterior | None:
    """Sample the posterior about a fit, the prior being standard normal.

    None where draws about the mode cannot be trusted and there are many unknowns.
    """
    weighted = _from_gaussian(problem, fit.gaussian.widened(_wider(problem.dimension)), seed)
    sampled = _resampled(weighted, LEAST_ESS, seed)
    if sampled is None and problem.known_noise:
        along_ridges = randomised_maximum_likelihood(problem, fit, seed)
        sampled = _resampled(along_ridges, RANDOMISED_DRAWS / 2, seed)
    if sampled is not None:
        return sampled
    if problem.dimension >= FOLLOWS_GRADIENTS:
        return None
    begin = fit.gaussian.widened(MUCH_WIDER)
    reference = Reference(problem.traced, begin, problem.dimension, problem.count)
    for engine in _smc():
        draws = engine.run(reference, jax.random.PRNGKey(seed), no_progress)
        if draws.log_evidence_error < MOST_ERROR:
            break
    points = np.asarray(draws.position).reshape(-1, problem.dimension)
    return SampledPosterior(points, draws.log_evidence, draws.log_evidence_error)


def _smc() -> Iterator[Engine]:
    """SMC, imported here: few posteriors need it, and its libraries take an eighth of a second."""
    for particles, populations in PARTICLES:
        yield engines.SMC(particles=particles, populations=populations, moves=10, prior_draws=2)


def _wider(dimension: int) -> float:
    """Factor on deviations of draws that are weighted, so that half of them count at least.

    Of a Gaussian posterior the share of effective draws is (s^2 / sqrt(2 s^2 - 1))^-dimension.
    """
    each = 4.0 ** (1 / max(1, dimension))
    return min(WIDER, float(np.sqrt(each + np.sqrt(each**2 - each))))


def _from_gaussian(problem: LeastSquares, gaussian: Laplace, seed: int) -> Weighted:
    normal = np.random.default_rng(seed).standard_normal((DRAWS, problem.dimension))
    points = gaussian.points(normal)
    blocks = np.split(points, DRAWS // BLOCK)
    log_posterior = np.concatenate([problem.log_posterior(block) for block in blocks])
    log_weight = log_posterior - gaussian.log_density(normal)
    return Weighted(points, np.where(np.isfinite(log_weight), log_weight, -np.inf))


def _resampled(weighted: Weighted | None, least: float, seed: int) -> SampledPosterior | None:
    """Draws by their weights and the evidence; None where the weights cannot be trusted."""
    if weighted is None:
        return None
    count, log_weight = len(weighted.points), weighted.log_weight
    share = np.exp(log_weight - logsumexp(log_weight))
    if not pareto_k(log_weight) < GOOD_PARETO_K or not effective_size(log_weight) > least:
        return None
    evidence = float(logsumexp(log_weight) - np.log(count))
    steps = (np.arange(KEPT) + np.random.default_rng(seed + 1).uniform()) / KEPT
    drawn = np.minimum(np.searchsorted(np.cumsum(share), steps), count - 1)
    error = float(np.std(share * count) / np.sqrt(count))
    return SampledPosterior(weighted.points[drawn], evidence, error)
