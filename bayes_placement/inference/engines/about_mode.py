"""Draws and evidence of a posterior about its mode.

Draws from a Gaussian a little wider than Laplace's are weighted. Where their weights cannot be
trusted, draws are made along the ridges of the posterior; where these cannot either, SMC goes on
from the Gaussian, unless it would have to follow gradients or responses are slow, which takes
minutes.

Draws along ridges are weighted too: the data are randomised, then the squares minimised. Bardsley,
Solonen, Haario and Laine (2014, doi:10.1137/140964023). An angle about the axis along which a
sensor reads is hardly known, and others must follow it on a curve much narrower than it is long. No
Gaussian has that shape, and random walks do not get along it; least squares with randomised data
do.
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
from .least_squares import Evaluate, LeastSquares, ParameterPoints
from .levenberg_marquardt import LARGEST, Fit, Laplace

RIDGE_DRAWS, RIDGE_BLOCK = 192, 16
"""Draws, and those that are found together, at most."""

MOST_SLOPES = 2**25
"""Slopes of those that are found together: a quarter of a gigabyte."""

ROUNDS, CHORDS = 4, 3
"""Evaluations of the slopes, and steps that are made with those of each."""

ARRIVED = 0.01
"""Distance from its target, in standard deviations, at which a draw is found."""

LOST = 0.05
"""Share of draws that may be lost on the way."""


class Weighted(NamedTuple):
    """Draws [draw, unknown], and the log of posterior density over that of the draws [draw]."""

    points: np.ndarray
    log_weight: np.ndarray


class _State(NamedTuple):
    """Image of each point, the slopes of the image, and the log of the posterior density."""

    image: np.ndarray
    slopes: np.ndarray
    log_posterior: np.ndarray


class _Image:
    """Residuals and coordinates, prior included, seen along their slopes at the fit: Q^T F."""

    def __init__(self, problem: LeastSquares, fit: Fit):
        self.problem = problem
        slopes = problem.jacobian(fit.point[None]).slopes[0]
        jacobian = np.concatenate([np.eye(problem.dimension), slopes.T])
        self.axes, self.root = np.linalg.qr(jacobian)
        self.of_point, self.of_residual = np.split(self.axes, [problem.dimension])

    def image(self, points: ParameterPoints, residual: np.ndarray) -> np.ndarray:
        """Q^T F [point, unknown], a standard normal vector if the problem is linear."""
        return points @ self.of_point + residual @ self.of_residual

    def at(self, points: ParameterPoints) -> _State:
        """Image, slopes and density of points."""
        residual, log_scale, slopes, _ = self.problem.jacobian(points)
        slopes_of_image = self.of_point.T + (slopes @ self.of_residual).transpose(0, 2, 1)
        density = self.problem.log_density(points, residual, log_scale)
        return _State(self.image(points, residual), slopes_of_image, density)

    def chord(self, points: ParameterPoints, state: _State, target: np.ndarray) -> ParameterPoints:
        """Move points towards those that have the target as image, by slopes from nearby."""
        image = state.image
        for _ in range(CHORDS):
            step = np.linalg.solve(state.slopes, (target - image)[..., None])[..., 0]
            points = np.clip(points + np.nan_to_num(step), -2 * LARGEST, 2 * LARGEST)
            image = self.image(points, self.problem.residuals(points)[0])
        return points


def randomised_maximum_likelihood(problem: LeastSquares, fit: Fit, seed: int) -> Weighted | None:
    """Weighted draws about a fit of known noise; None where too many of them are not found."""
    image = _Image(problem, fit)
    target = np.random.default_rng(seed).standard_normal((RIDGE_DRAWS, problem.dimension))
    together = min(RIDGE_BLOCK, max(1, MOST_SLOPES // max(1, problem.dimension * problem.count)))
    parts = np.array_split(target, -(-RIDGE_DRAWS // together))
    blocks = [_solved(image, fit.point, block) for block in parts]
    points, log_weight = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
    if np.mean(np.isneginf(log_weight)) > LOST:
        return None
    return Weighted(points, log_weight)


def _solved(image: _Image, mode: np.ndarray, target: np.ndarray) -> Weighted:
    """Points whose image is the target."""
    points = mode + np.linalg.solve(image.root, target.T).T
    state = image.at(points)
    for _ in range(ROUNDS):
        if _distance(state, target).max() < ARRIVED:
            break
        points = image.chord(points, state, target)
        state = image.at(points)
    with np.errstate(invalid="ignore"):  # where the model is not finite no draw has arrived
        log_slope = np.linalg.slogdet(state.slopes)[1]
    volume = log_slope - 0.5 * target.shape[1] * np.log(2 * np.pi)
    log_density = volume - 0.5 * np.einsum("bi,bi->b", state.image, state.image)
    arrived = np.isfinite(state.log_posterior) & (_distance(state, target) < ARRIVED)
    return Weighted(points, np.where(arrived, state.log_posterior - log_density, -np.inf))


def _distance(state: _State, target: np.ndarray) -> np.ndarray:
    return np.nan_to_num(np.abs(state.image - target), nan=np.inf).max(axis=1)


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


def sampled_about(
    problem: LeastSquares, fit: Fit, *, is_slow: bool = False, seed: int = 0
) -> SampledPosterior | None:
    """Sample the posterior about a fit, the prior being standard normal.

    None where draws about the mode cannot be trusted, and there are many unknowns or each response
    is slow: SMC needs some hundred thousand.
    """
    weighted = _from_gaussian(problem, fit.gaussian.widened(_wider(problem.dimension)), seed)
    sampled = _resampled(weighted, LEAST_ESS, seed)
    if sampled is None and problem.known_noise:
        along_ridges = randomised_maximum_likelihood(problem, fit, seed)
        sampled = _resampled(along_ridges, RIDGE_DRAWS / 2, seed)
    if sampled is not None:
        return sampled
    if is_slow or problem.dimension >= FOLLOWS_GRADIENTS:
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
