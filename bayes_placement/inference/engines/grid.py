"""grid: in, a Gauss grid over the prior; out, the exact posterior of few unknowns.

Not known here: structures, placement.
"""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import numpy as np
from scipy.special import logsumexp

from ..._types import InfeasibleError, Key, Progress
from ._engine import Draws, Engine, Posterior, in_batches
from .importance import weighted

LIMIT = 1_000_000
NEGLIGIBLE = -25.0
"""Log of the weight, relative to the largest, that a node outside the box may have."""

SMALLEST_GAIN = 0.8
"""A box is zoomed into as long as a side shrinks below this share of itself."""

LEAST_NODES = 2.5

Box = list[tuple[float, float]]


class Grid(Engine):
    """Gauss quadrature over the prior of a few independent unknowns: the reference for the others.

    The grid is first laid over the whole prior, then over the box that carries the posterior,
    until the box no longer shrinks.

    Parameters
    ----------
    points
        Gauss nodes for each unknown.
    batch
        Nodes evaluated at a time; bounds the memory.

    Raises
    ------
    InfeasibleError
        If there are more than a million nodes.
    """

    points: int = eqx.field(static=True, default=32)
    batch: int = eqx.field(static=True, default=64)

    def run(self, posterior: Posterior, key: Key, progress: Progress) -> Draws:
        """Weight every node by its prior weight and its likelihood."""
        self._check(posterior.dimension)
        box: Box = [(0.0, 1.0)] * posterior.dimension
        evaluate = jax.jit(jax.vmap(posterior.log_likelihood))
        while True:
            vectors, log_weight = posterior.prior_quadrature(self.points, box)
            likelihood = in_batches(evaluate, vectors, self.batch, progress)
            found = weighted(vectors, likelihood, log_weight)
            cube = np.asarray(found.log_weight).reshape((self.points,) * posterior.dimension)
            smaller = [self._zoom(cube, axis, part) for axis, part in enumerate(box)]
            if not _gains(smaller, box):
                return _diagnosed(found, cube)
            box = smaller

    def _check(self, dimension: int) -> None:
        size = self.points**dimension
        if size > LIMIT:
            raise InfeasibleError(
                f"engines.Grid({self.points}) over {dimension} unknowns has {size:.0e} nodes; at "
                f"most {LIMIT:.0e} are affordable. Use marginals.Quadrature(), which takes the "
                "positions out, or engines.SMC()."
            )

    def _zoom(self, cube: np.ndarray, axis: int, part: tuple[float, float]) -> tuple[float, float]:
        """Part of an unknown's law that carries the posterior, a node to spare on either side."""
        others = tuple(other for other in range(cube.ndim) if other != axis)
        along = logsumexp(cube, axis=others)
        carrying = np.flatnonzero(along > along.max() + NEGLIGIBLE)
        first, last = max(carrying[0] - 1, -1), min(carrying[-1] + 1, self.points)
        node = (np.polynomial.legendre.leggauss(self.points)[0] + 1) / 2
        edges = np.concatenate([node, [1.0, 0.0]])  # the places -1 and n stand for the ends
        low, high = part
        return tuple(low + (high - low) * edges[[first, last]])  # type: ignore[return-value]

    def settings(self) -> dict[str, Any]:
        """Name and number of nodes."""
        return {"engine": "Grid", "points": self.points}


def _gains(smaller: Box, box: Box) -> bool:
    sides = zip(np.ptp(smaller, axis=1), np.ptp(box, axis=1), strict=True)
    return any(new < SMALLEST_GAIN * old for new, old in sides)


def _diagnosed(found: Draws, cube: np.ndarray) -> Draws:
    axes = range(cube.ndim)
    along = [logsumexp(cube, axis=tuple(a for a in axes if a != axis)) for axis in axes]
    least = min(float(np.exp(2 * logsumexp(one) - logsumexp(2 * one))) for one in along)
    complaint = (
        f"The grid does not resolve the posterior: {least:.1f} nodes carry it along one unknown, "
        f"where {LEAST_NODES} are needed; use more, Grid(points=96), or engines.SMC()."
    )
    return dataclasses.replace(
        found,
        exact=True,
        attributes={"grid_node_ess": least},
        complaints=(complaint,) if least < LEAST_NODES else (),
    )
