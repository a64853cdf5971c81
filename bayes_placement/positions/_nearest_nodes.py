"""_nearest_nodes: in, nodes and the law of a place; out, the law of the node nearest to it.

Not known here: sensors, mode shapes.
"""

from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpyro.distributions import Categorical, Uniform
from scipy.stats import qmc

from .._sites import is_unknown
from . import _voronoi
from .places import AtNode, InBall, Straight

_NOTHING = 1e-12  # share of a node that is touched through rounding only

POWER = 13
REPEATS = 8
"""Where shares are found by points: sets of 2^13 of them, each scrambled by itself."""


def at_nodes(
    position: Float[np.ndarray, "node *coordinate"], chosen: Bool[np.ndarray, "node"], law: Any
) -> AtNode:
    """Law of the node nearest to a place.

    Parameters
    ----------
    position
        Where the nodes are [m].
    chosen
        Which of them may be taken.
    law
        Law of the place; None for nodes alike.
    """
    rows = np.flatnonzero(chosen)
    weight, error = _weights(position[rows], law)
    kept = weight > _NOTHING
    rows, weight = rows[kept], weight[kept] / np.sum(weight[kept])
    node = Categorical(probs=weight) if len(rows) > 1 else 0
    return AtNode(node, position[rows], rows, error)


def _weights(position: np.ndarray, law: Any) -> tuple[np.ndarray, float]:
    if law is None:
        return np.full(len(position), 1 / len(position)), 0.0
    nodes = position.reshape(len(position), -1)
    if isinstance(law, InBall):
        return _voronoi.shares_by_points(nodes, _drawn(law))
    region = _region(law)
    axes = len(region.limits)
    if axes <= 2:
        return _voronoi.shares(nodes, region), 0.0
    lengths = region.limits[:, 0] + _cube(axes) * np.ptp(region.limits, axis=1)
    return _voronoi.shares_by_points(nodes, list(region.at(lengths)))


def _region(law: Uniform | Straight) -> _voronoi.Region:
    """Where the uniform law of a place extends."""
    if isinstance(law, Uniform):
        return _voronoi.Region(np.zeros(1), np.eye(1), np.array([[law.low, law.high]]))
    origin, directions, values = law.frame()
    free = np.array([is_unknown(value) for value in values.values()])
    known = np.array([0.0 if is_unknown(value) else value for value in values.values()])
    limits = [(one.low, one.high) for one in values.values() if is_unknown(one)]
    return _voronoi.Region(origin + known @ directions, directions[free], np.array(limits))


def _drawn(law: InBall) -> list[np.ndarray]:
    """Sobol points of the cube about a ball cut by a box that lie in the ball."""
    low, high = law.cut.box()
    steps = low + _cube(len(low)) * (high - low)
    points = np.broadcast_to(law.bounds[0], (*steps.shape[:2], 3)).copy()
    extends = np.array(law.axes)
    points[..., extends] = np.array(law.centre)[extends] + steps
    inside = np.sum(steps**2, axis=-1) <= law.cut.radius**2
    return [one[kept] for one, kept in zip(points, inside, strict=True)]


def _cube(axes: int) -> np.ndarray:
    """Sobol points in the unit cube, each repeat scrambled by itself, [repeat, point, axis]."""
    return np.stack([qmc.Sobol(axes, seed=seed).random_base2(POWER) for seed in range(REPEATS)])
