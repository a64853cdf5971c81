"""What every engine is, what it may know of a posterior, and what it returns."""

import abc
from typing import Protocol, TypeAlias, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, Shaped

from ..._shared.compiled import compiled
from ..._shared.dimensions import Key
from ..._shared.progress import Progress
from ..._shared.reprs import with_short_repr
from .._quadrature_rules import Interval
from ..batches import affordable_batch, working_bytes
from ..estimates import Given
from .empirical_bayes import Hierarchy
from .least_squares import LeastSquares

Flat = Float[Array, "unknown"]
Scalar = Float[Array, ""]
Draws = Float[Array, "draw unknown"]
PerDraw = Float[Array, "draw"]
Positions = Float[Array, "chain draw unknown"]
Nodes = tuple[Float[Array, "node unknown"], Float[Array, "node"]]

Box = list[Interval]
"""Part of the prior of each unknown, by its cumulative probabilities."""

Settings: TypeAlias = dict[str, str | int | float]
"""Name and sizes of a method, as files of results hold them."""


@runtime_checkable
class PosteriorDensity(Protocol):
    """What an engine may know of a posterior: densities over one flat, unconstrained vector."""

    @property
    def dimension(self) -> int:
        """Length of the vector."""

    def least_squares(self) -> LeastSquares | None:
        """Likelihood as a problem of least squares; None where it is none."""

    def hierarchy(self) -> Hierarchy | None:
        """The same where errors have unknown sizes, whose joint mode with these means nothing."""

    def log_prior(self, flat: Flat) -> Scalar:
        """Log prior density."""

    def log_likelihood(self, flat: Flat) -> Scalar:
        """Log likelihood."""

    def log_jacobian(self, flat: Flat) -> Scalar:
        """Log volume of the named values per volume of the flat vector."""

    def symmetric_images(self, flat: Flat) -> list[Flat]:
        """Vectors that may explain the data as well, by maps that are their own inverse.

        The maps keep the volume of the named values. Not finite where a prior excludes an image.
        """

    def vector(self, values: Given) -> Flat:
        """Vector of values by name."""

    def sample_prior(self, key: Key, draws: int) -> Draws:
        """Draws from the prior."""

    def prior_quadrature(self, nodes: int, box: Box | None = None) -> Nodes:
        """Gauss nodes over (part of) the prior and the logs of their weights."""


class EngineDraws(eqx.Module):
    """What an engine returns."""

    position: Positions
    """Flat vectors [chain, draw, unknown]."""
    log_likelihood: Float[Array, "chain draw"]
    """Log likelihood of each draw [chain, draw]."""
    log_weight: Float[Array, "chain draw"] | None = None
    """Log weight of each draw [chain, draw]; None where all weigh the same."""
    lineage: Int[Array, "chain draw"] | None = None
    """Draws that descend from the same first particle carry the same number [chain, draw]; None
    where draws are independent or a Markov chain."""
    exact: bool = False
    """The draws are nodes of a quadrature; sums over them have no sampling error."""
    mode: Flat | None = None
    """Flat vector of the highest posterior density, where the engine looks for it."""
    log_evidence: float = float("nan")
    log_evidence_error: float = float("nan")
    """Log of the evidence and its standard error; NaN where the engine does not give them."""
    stats: dict[str, Shaped[Array, "chain draw"]] = eqx.field(default_factory=dict)
    """Statistics of each draw [chain, draw]."""
    attributes: dict[str, float | int] = eqx.field(default_factory=dict)
    """Statistics of the run."""
    warnings: tuple[str, ...] = ()
    """One sentence for each diagnostic that fails, with what to do."""


@with_short_repr
class Engine(eqx.Module):
    """A way to explore a posterior."""

    @abc.abstractmethod
    def run(self, posterior: PosteriorDensity, key: Key, progress: Progress) -> EngineDraws:
        """Explore a posterior, reporting the share done."""

    def check(self, dimension: int) -> None:
        """Refuse a posterior of so many unknowns that it cannot explore; none by default.

        Raises
        ------
        InfeasibleError
            If it cannot.
        """
        return

    def working_bytes(self, posterior: PosteriorDensity) -> int:
        """Memory [bytes] that it needs at least besides the draws: that of a single evaluation."""
        return working_bytes(
            compiled(log_likelihood).bound(posterior), jnp.zeros(posterior.dimension)
        )

    def settings(self) -> Settings:
        """Name, sizes and options, for the record; how much is done at once changes no result."""
        options = {name: value for name, value in vars(self).items() if name != "batch"}
        return {"engine": type(self).__name__, **options}


def log_likelihood(posterior: PosteriorDensity, vector: Flat) -> Scalar:
    """Log likelihood of a vector."""
    return posterior.log_likelihood(vector)


def log_likelihoods(posterior: PosteriorDensity, vectors: Draws) -> PerDraw:
    """Log likelihoods of many vectors at once."""
    return jax.vmap(posterior.log_likelihood)(vectors)


def log_likelihoods_in_batches(
    posterior: PosteriorDensity, vectors: Draws, batch: int, progress: Progress
) -> PerDraw:
    """Log likelihoods of many vectors, compiled for a batch of them that fits into memory."""
    evaluate = compiled(log_likelihoods).bound(posterior)
    batch = affordable_batch(compiled(log_likelihood).bound(posterior), vectors[0], batch)
    count = vectors.shape[0]
    # The last batch is filled up, so that a second shape need not be compiled.
    padding = jnp.repeat(vectors[:1], -count % batch, axis=0)
    padded = jnp.concatenate([vectors, padding])
    results = []
    for start in range(0, count, batch):
        results.append(np.asarray(evaluate(padded[start : start + batch])))
        progress(min(start + batch, count) / count)
    return jnp.asarray(np.concatenate(results)[:count])
