"""grid: in, a Gauss grid over the prior; out, the exact posterior of few unknowns.

Not known here: structures, placement.
"""

import dataclasses
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jax.scipy.special import logsumexp

from .._types import Key, Progress
from ._engine import Draws, Engine, Posterior, in_batches
from .importance import weighted

LIMIT = 1_000_000


class Grid(Engine):
    """Gauss quadrature over the prior of a few independent unknowns: the reference for the others.

    Parameters
    ----------
    points
        Gauss nodes for each unknown.
    batch
        Nodes evaluated at a time; bounds the memory.

    Raises
    ------
    ValueError
        If there are more than a million nodes.
    """

    points: int = eqx.field(static=True, default=48)
    batch: int = eqx.field(static=True, default=72)

    def run(self, posterior: Posterior, key: Key, progress: Progress) -> Draws:
        """Weight every node by its prior weight and its likelihood."""
        size = self.points**posterior.dimension
        if size > LIMIT:
            raise ValueError(
                f"engines.Grid({self.points}) over {posterior.dimension} unknowns has {size:.0e} "
                f"nodes; at most {LIMIT:.0e} are affordable. Use marginals.Quadrature(), which "
                "takes the positions out, or engines.SMC()."
            )
        vectors, log_prior_weight = posterior.prior_quadrature(self.points)
        batch = min(self.batch, size)
        likelihood = in_batches(posterior.log_likelihood, vectors, batch, progress)
        found = weighted(vectors, likelihood, log_prior_weight)
        ess = float(jnp.exp(-logsumexp(2 * found.log_weight)))
        return dataclasses.replace(found, exact=True, attributes={"weight_ess": ess})

    def settings(self) -> dict[str, Any]:
        """Name and number of nodes."""
        return {"engine": "Grid", "points": self.points}
