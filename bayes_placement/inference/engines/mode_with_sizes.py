"""Mode and draws of a posterior whose errors have unknown sizes: these by the evidence.

The joint mode over errors and their sizes lies at sizes of zero and means nothing.
"""

from functools import partial
from typing import NamedTuple

import jax
import numpy as np
from jaxtyping import Array, Float

from ..._shared.sites import Unknown
from ..coordinates import Coordinates
from .empirical_bayes import Ends, Hierarchy, Sized, bounds_of_log, log_density
from .least_squares import ParameterPoints, evolved
from .levenberg_marquardt import minimise

NEAR, STEPS, FOLLOWED = 10, 100, 6
"""Steps along logarithmic residuals, those after them, and descents that are followed."""


class ModeWithSizes(NamedTuple):
    """A mode at the sizes of greatest evidence, and draws about it."""

    mode: np.ndarray
    """Coordinates of all unknowns, sizes among them [unknown]."""
    points: np.ndarray
    """Draws of these [draw, unknown]."""
    log_density: np.ndarray
    """Log density by which the draws were made [draw]."""
    log_evidence: float
    """Log evidence by Laplace's method."""
    is_flat: bool
    """Whether the posterior is flat along some direction."""


def mode_with_sizes(sized: Sized, draws: int, seed: int) -> ModeWithSizes:
    """Mode of all unknowns from a fit, and draws about it."""
    points, log_density = _drawn(sized, draws, np.random.default_rng(seed))
    at_mode = {name: np.array([size]) for name, size in sized.problem.sizes.items()}
    return ModeWithSizes(
        mode=sized.problem.with_sizes(sized.fit.point[None], at_mode)[0],
        points=points,
        log_density=log_density,
        log_evidence=sized.fit.log_evidence,
        is_flat=sized.fit.gaussian.is_flat,
    )


def evolved_without_errors(
    problem: Hierarchy, starts: ParameterPoints, seed: int
) -> Float[np.ndarray, "1 unknown"]:
    """Evolve a population of starts of the exact model to a single one [1, unknown]."""
    is_error = np.zeros(starts.shape[1], dtype=bool)
    for size in problem.unknown_sizes:
        is_error[problem.errors_of(size)] = True
    cost = problem.squares.objective().cost

    def exact(points: np.ndarray) -> np.ndarray:
        vectors = np.zeros((len(points), starts.shape[1]))
        vectors[:, ~is_error] = points
        return vectors

    return exact(evolved(lambda points: cost(exact(points)), starts[:, ~is_error], seed)[None])


def near_modes(problem: Hierarchy, starts: ParameterPoints) -> Ends:
    """The best ends of descents from some starts [start, unknown without sizes], at first sizes.

    They go along logarithmic residuals first, which find resonances from afar.
    """
    squares = problem.squares
    starts, _ = minimise(squares.objective(logarithmic=True), starts, steps=NEAR)
    ends, normal = minimise(squares.objective(), starts, steps=STEPS)
    return ends[np.argsort(np.nan_to_num(normal.cost, nan=np.inf))[:FOLLOWED]]


def _drawn(sized: Sized, draws: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Draws of all unknowns, and the log density by which they were made.

    What the data determine of an error is its product with the size; what they do not, is standard
    normal. The draws of a size move the errors accordingly.
    """
    problem, gaussian = sized.problem, sized.fit.gaussian
    normal = random.standard_normal((draws, gaussian.mode.size))
    points, log_density = gaussian.points(normal), gaussian.log_density(normal)
    sizes = {}
    for size in problem.unknown_sizes:
        log_size, of_size = _log_sizes(sized, size, draws, random)
        places = problem.errors_of(size)
        share = np.clip(1 - np.diag(gaussian.covariance)[places], 0.0, 1.0)
        change = (np.log(problem.sizes[size.name]) - log_size)[:, None] * share
        points[:, places] *= np.exp(change)
        sizes[size.name] = np.exp(log_size)
        log_density += of_size - change.sum(axis=1)
    return problem.with_sizes(points, sizes), log_density


def _log_sizes(
    sized: Sized, size: Unknown, draws: int, random: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Draws of the log of a size within its prior, and their log density by its coordinate."""
    from scipy.stats import norm, truncnorm  # it takes long to import

    middle, deviation = np.log(sized.problem.sizes[size.name]), sized.deviations[size.name]
    ends = (np.array(bounds_of_log(size)) - middle) / deviation
    proposal = truncnorm(*ends, loc=middle, scale=deviation)
    drawn = proposal.rvs(draws, random_state=random)
    score = np.asarray(jax.vmap(partial(_score, size))(np.exp(drawn)))
    prior = log_density(size, np.exp(drawn))
    return drawn, proposal.logpdf(drawn) - prior + norm.logpdf(score)


def _score(size: Unknown, value: Float[Array, ""]) -> Float[Array, ""]:
    """Standard normal coordinate of a size."""
    return Coordinates({size.name: size.distribution}).vector({size.name: value})[0]
