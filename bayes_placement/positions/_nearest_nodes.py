"""Distribution of the node that is nearest to an uncertain position.

Along a line and in a plane the share of a region that is nearest to a node is exact, by clipping
with the half-planes between nodes; `scipy.spatial.Voronoi` neither stops at the edge of a region
nor takes nodes that lie off its plane. In space, shares are those of Sobol points.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from numpyro.distributions import Categorical, Uniform
from scipy.spatial import cKDTree

from .._shared.sites import is_unknown
from .places import AtNode, InBall, Straight

POWER = 13
REPEATS = 8
"""Shares by points use eight sets of 2^13 Sobol points, each scrambled independently."""

_NO_SHARE = 1e-12  # share of a node that the region touches through rounding only
_NEIGHBOURS = 32  # looked up at first
_GRID = 33  # points along an axis at which the distance to the nodes is looked up
_TIE = 1e-12  # of the size of the region

NodePositions = Float[np.ndarray, "node coordinate"]
Corners = Float[np.ndarray, "_ axis"]  # clipping changes how many there are


def at_nearest_node(
    position: Float[np.ndarray, "node *coordinate"],
    allowed: Bool[np.ndarray, "node"],
    place: object,
) -> AtNode:
    """Distribution of the node nearest to a position.

    It may be read at allowed ones alone. Without a distribution of the position all are equally
    likely.
    """
    rows = np.flatnonzero(allowed)
    weight, error = _weights(position[rows], place)
    has_share = weight > _NO_SHARE
    rows, weight = rows[has_share], weight[has_share] / np.sum(weight[has_share])
    node = Categorical(probs=weight) if len(rows) > 1 else 0
    return AtNode(node, position[rows], rows, error)


def _weights(position: np.ndarray, place: object) -> tuple[np.ndarray, float]:
    if place is None:
        return np.full(len(position), 1 / len(position)), 0.0
    nodes = position.reshape(len(position), -1)
    if isinstance(place, InBall):
        return shares_by_points(nodes, _points_in_ball(place))
    region = _region(place)
    dimension = len(region.limits)
    if dimension <= 2:
        return shares(nodes, region), 0.0
    lengths = region.limits[:, 0] + _sobol_points(dimension) * np.ptp(region.limits, axis=1)
    return shares_by_points(nodes, list(region.at(lengths)))


class Rectangle(NamedTuple):
    """A stretch of a line or a rectangle: origin [m], orthonormal directions, limits [m]."""

    origin: Float[np.ndarray, "coordinate"]
    directions: Float[np.ndarray, "axis coordinate"]
    limits: Float[np.ndarray, "axis 2"]

    def corners(self) -> Corners:
        """Corners, in order around it, by their lengths along the directions [m]."""
        if len(self.limits) == 1:
            return self.limits.T
        (left, right), (low, high) = self.limits
        return np.array([[left, low], [right, low], [right, high], [left, high]])

    def at(self, lengths: Float[np.ndarray, "*point axis"]) -> np.ndarray:
        """Points at some lengths along the directions [m]."""
        return self.origin + lengths @ self.directions

    def distance(self, points: NodePositions) -> Float[np.ndarray, "node"]:
        """Distance of points from the region [m]."""
        feet = np.clip((points - self.origin) @ self.directions.T, *self.limits.T)
        return np.linalg.norm(points - self.at(feet), axis=1)


def _region(place: Uniform | Straight) -> Rectangle:
    """Where the uniform distribution of a position extends."""
    if isinstance(place, Uniform):
        return Rectangle(np.zeros(1), np.eye(1), np.array([[place.low, place.high]]))
    origin, directions, values = place.frame()
    free = np.array([is_unknown(value) for value in values.values()])
    known = np.array([0.0 if is_unknown(value) else value for value in values.values()])
    limits = [(value.low, value.high) for value in values.values() if is_unknown(value)]
    return Rectangle(origin + known @ directions, directions[free], np.array(limits))


def _points_in_ball(place: InBall) -> list[np.ndarray]:
    """Sobol points in a ball cut by a box: those of the box about it that lie in it."""
    low, high = place.cut.box()
    steps = low + _sobol_points(len(low)) * (high - low)
    points = np.broadcast_to(place.bounds[0], (*steps.shape[:2], 3)).copy()
    extends = np.array(place.axes)
    points[..., extends] = np.array(place.centre)[extends] + steps
    inside = np.sum(steps**2, axis=-1) <= place.cut.radius**2
    return [repeat[in_ball] for repeat, in_ball in zip(points, inside, strict=True)]


def _sobol_points(dimension: int) -> Float[np.ndarray, "repeat point axis"]:
    """Sobol points in the unit cube, each repeat scrambled independently."""
    from scipy.stats import qmc  # it takes long to import

    return np.stack(
        [qmc.Sobol(dimension, seed=seed).random_base2(POWER) for seed in range(REPEATS)]
    )


def shares(nodes: NodePositions, region: Rectangle) -> Float[np.ndarray, "node"]:
    """Share of the length or area of a region that is nearest to each node; they sum to 1."""
    corners = region.corners()
    clip, measure = _OF_DIMENSION[corners.shape[1]]
    candidates = _candidates(nodes, region)
    near = nodes[candidates]
    tree = cKDTree(near)
    cells = np.array([_cell_measure(node, near, tree, region, clip, measure) for node in near])
    return _on_all_nodes(cells / measure(corners), candidates)


def shares_by_points(
    nodes: NodePositions, repeats: Sequence[np.ndarray]
) -> tuple[Float[np.ndarray, "node"], float]:
    """Share of points nearest to each node, and the greatest standard error of a share.

    Each repeat is an independent set of points, evenly spread over the region.
    """
    candidates = _within_reach(nodes, np.concatenate(repeats))
    tree, count = cKDTree(nodes[candidates]), int(np.sum(candidates))
    by_repeat = [
        np.bincount(tree.query(points)[1], minlength=count) / len(points) for points in repeats
    ]
    error = np.std(by_repeat, axis=0, ddof=1) / np.sqrt(len(repeats))
    return _on_all_nodes(np.mean(by_repeat, axis=0), candidates), float(np.max(error))


def _on_all_nodes(values: np.ndarray, candidates: Bool[np.ndarray, "node"]) -> np.ndarray:
    full = np.zeros(len(candidates))
    full[candidates] = values
    return full


def _candidates(nodes: NodePositions, region: Rectangle) -> Bool[np.ndarray, "node"]:
    """Nodes that may be nearest to some point of a region.

    No point is farther from a node than the farthest of a grid, and half a cell of the grid.
    """
    candidates = _within_reach(nodes, region.at(region.corners()))
    axes = [np.linspace(low, high, _GRID) for low, high in region.limits]
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, len(axes))
    farthest = np.max(cKDTree(nodes[candidates]).query(region.at(grid))[0])
    half_cell = np.linalg.norm(np.ptp(region.limits, axis=1)) / (_GRID - 1) / 2
    distance = region.distance(nodes[candidates])
    candidates[candidates] = distance <= (farthest + half_cell) * (1 + 1e-9)
    return candidates


def _within_reach(nodes: NodePositions, points: np.ndarray) -> Bool[np.ndarray, "node"]:
    """Nodes that may be nearest to some point in the hull of points.

    From every point some node is no farther than from the middle and the radius of the hull.
    """
    middle = np.mean(points, axis=0)
    radius = np.max(np.linalg.norm(points - middle, axis=1))
    distance = np.linalg.norm(nodes - middle, axis=1)
    return distance <= (np.min(distance) + 2 * radius) * (1 + 1e-9)


def _cell_measure(
    node: np.ndarray,
    nodes: NodePositions,
    tree: cKDTree,
    region: Rectangle,
    clip: Callable[[Corners, np.ndarray, float], Corners],
    measure: Callable[[Corners], float],
) -> float:
    """Length or area of the cell of one node; nodes at the same distance everywhere share it."""
    cell, sharing = region.corners(), 1
    margin = _TIE * np.max(np.ptp(cell, axis=0))
    for neighbour, distance in _neighbours(node, tree, nodes):
        corners = region.at(cell) - node
        if len(cell) == 0 or distance > 2 * np.max(np.linalg.norm(corners, axis=1)):
            break  # no node so far away is nearer to any point of the cell
        step = neighbour - node
        normal = region.directions @ step
        level = float(step @ ((neighbour + node) / 2 - region.origin))
        if np.linalg.norm(normal) > _TIE * distance and distance > margin:
            cell = clip(cell, normal, level)
        elif abs(level) <= margin * max(distance, margin):
            sharing += 1
        elif level < 0:
            return 0.0
    return measure(cell) / sharing


def _neighbours(
    node: np.ndarray, tree: cKDTree, nodes: NodePositions
) -> Iterator[tuple[np.ndarray, float]]:
    """All other nodes and their distances, nearest first."""
    begin, is_itself = 0, True
    while begin < len(nodes):
        end = min(max(_NEIGHBOURS, 4 * begin), len(nodes))
        distances, indices = tree.query(node, k=np.arange(begin + 1, end + 1))
        for index, distance in zip(indices, distances, strict=True):
            if is_itself and np.array_equal(nodes[index], node):
                is_itself = False
                continue
            yield nodes[index], float(distance)
        begin = end


def _clip_stretch(cell: Corners, normal: np.ndarray, level: float) -> Corners:
    """Part of a stretch where normal * t <= level."""
    low, high = cell[0, 0], cell[-1, 0]
    end = level / normal[0]
    low, high = (low, min(high, end)) if normal[0] > 0 else (max(low, end), high)
    return np.array([[low], [high]]) if low < high else np.empty((0, 1))


def _clip_polygon(cell: Corners, normal: np.ndarray, level: float) -> Corners:
    """Part of a convex polygon where normal . t <= level (Sutherland and Hodgman 1974)."""
    excess = cell @ normal - level
    clipped = []
    for i, corner in enumerate(cell):
        if (excess[i - 1] > 0) != (excess[i] > 0):
            crossing = excess[i - 1] / (excess[i - 1] - excess[i])
            clipped.append(cell[i - 1] + (corner - cell[i - 1]) * crossing)
        if excess[i] <= 0:
            clipped.append(corner)
    return np.array(clipped).reshape(-1, 2)


def _length(cell: Corners) -> float:
    return float(cell[-1, 0] - cell[0, 0]) if len(cell) else 0.0


def _area(cell: Corners) -> float:
    x, y = cell.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2) if len(cell) else 0.0


_OF_DIMENSION = {1: (_clip_stretch, _length), 2: (_clip_polygon, _area)}
