"""Gauss grid over the prior: the exact posterior of few unknowns."""

import dataclasses
import itertools

import equinox as eqx
import numpy as np
from scipy.special import logsumexp

from ..._shared.arguments import check_count
from ..._shared.dimensions import Key
from ..._shared.errors import MORE_NODES, SMC, InfeasibleError
from ..._shared.progress import Progress
from .._quadrature_rules import Interval, legendre
from ..estimates import LEAST_NODES, effective_size
from .engine import Box, Engine, EngineDraws, PosteriorDensity, log_likelihoods_in_batches
from .importance import weighted

MOST_NODES = 1_000_000
NEGLIGIBLE = -25.0
"""Log of the weight, relative to the largest, that a node outside the box may have."""

LEAST_REDUCTION = 0.8
"""The box is refined as long as a side shrinks below this share of itself."""


class Grid(Engine):
    """Gauss quadrature over the prior of a few independent unknowns: the reference for the others.

    The grid is first laid over the entire prior, then over the box that carries the posterior,
    until the box no longer shrinks.

    Parameters
    ----------
    nodes
        Gauss nodes for each unknown.
    batch
        Nodes evaluated at a time; bounds the memory.

    Raises
    ------
    InfeasibleError
        If there are more than a million nodes.

    Examples
    --------
    >>> bp.engines.Grid(nodes=16).settings()
    {'engine': 'Grid', 'nodes': 16}
    """

    nodes: int = eqx.field(static=True, default=32)
    batch: int = eqx.field(static=True, default=64)

    def __check_init__(self) -> None:
        """Refuse a grid without nodes."""
        check_count("nodes", self.nodes, 1, "engines.Grid(nodes=32)")
        check_count("batch", self.batch, 1, "engines.Grid(batch=64)")

    def run(self, posterior: PosteriorDensity, key: Key, progress: Progress) -> EngineDraws:
        """Weight every node by its prior weight and its likelihood."""
        self.check(posterior.dimension)
        box: Box = [(0.0, 1.0)] * posterior.dimension
        for level in itertools.count():
            part = _part_of_progress(progress, level)
            vectors, log_weight = posterior.prior_quadrature(self.nodes, box)
            likelihood = log_likelihoods_in_batches(posterior, vectors, self.batch, part)
            draws = weighted(vectors, likelihood, log_weight)
            cube = np.asarray(draws.log_weight).reshape((self.nodes,) * posterior.dimension)
            refined = [self._refined(cube, axis, part) for axis, part in enumerate(box)]
            if not _shrinks(refined, box):
                break
            box = refined
        progress(1.0)
        return _diagnosed(draws, cube)

    def check(self, dimension: int) -> None:
        """Refuse more nodes than are affordable."""
        size = self.nodes**dimension
        if size > MOST_NODES:
            raise InfeasibleError(
                f"engines.Grid({self.nodes}) over {dimension} unknowns has {size:.0e} nodes; at "
                f"most {MOST_NODES:.0e} are affordable. Use marginals.Quadrature(), which takes "
                "the positions out, or engines.SMC()."
            )

    def _refined(self, cube: np.ndarray, axis: int, part: Interval) -> Interval:
        """Part of an unknown's prior that carries the posterior, a node to spare on either side."""
        along = _marginal_weight(cube, axis)
        carrying = np.flatnonzero(along > along.max() + NEGLIGIBLE)
        first, last = max(carrying[0] - 1, -1), min(carrying[-1] + 1, self.nodes)
        node = (legendre(self.nodes)[0] + 1) / 2
        edges = np.concatenate([node, [1.0, 0.0]])  # the places -1 and n stand for the ends
        low, high = part
        return tuple(low + (high - low) * edges[[first, last]])  # type: ignore[return-value]


def _part_of_progress(progress: Progress, level: int) -> Progress:
    """Report half of what is left at each level: how many there will be is not known."""
    remaining = 0.5**level
    return lambda share: progress(1 - remaining * (1 - 0.5 * share))


def _marginal_weight(cube: np.ndarray, axis: int) -> np.ndarray:
    """Log weight [node] along one unknown, summed over the others."""
    return logsumexp(cube, axis=tuple(other for other in range(cube.ndim) if other != axis))


def _shrinks(refined: Box, box: Box) -> bool:
    sides = zip(np.ptp(refined, axis=1), np.ptp(box, axis=1), strict=True)
    return any(new < LEAST_REDUCTION * old for new, old in sides)


def _diagnosed(draws: EngineDraws, cube: np.ndarray) -> EngineDraws:
    sizes = [effective_size(_marginal_weight(cube, axis)) for axis in range(cube.ndim)]
    least = float(min(sizes))
    warning = (
        f"The grid does not resolve the posterior: {least:.1f} nodes carry it along one unknown, "
        f"where {LEAST_NODES} are needed; use more, {MORE_NODES.python}, or {SMC.python}."
    )
    return dataclasses.replace(
        draws,
        exact=True,
        attributes={"grid_node_ess": least},
        warnings=(warning,) if least < LEAST_NODES else (),
    )
