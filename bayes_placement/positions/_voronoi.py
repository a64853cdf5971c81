"""_voronoi: in, nodes and a region; out, the share of the region that is nearest to each node.

Exact along a line and in a plane, by clipping with the half-planes between nodes; by points in
space. Not known here: structures, sensors, probability.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.spatial import cKDTree

_FEW = 32  # neighbours looked up at first
_GRID = 33  # places along an axis at which the distance to the nodes is looked up
_TIE = 1e-12  # of the size of the region

Nodes = Float[np.ndarray, "node coordinate"]
Corners = Float[np.ndarray, "_ axis"]  # clipping changes how many there are


class Region(NamedTuple):
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

    def at(self, lengths: Float[np.ndarray, "*place axis"]) -> np.ndarray:
        """Places of given lengths along the directions [m]."""
        return self.origin + lengths @ self.directions

    def distance(self, places: Nodes) -> Float[np.ndarray, "node"]:
        """How far places are from the region [m]."""
        feet = np.clip((places - self.origin) @ self.directions.T, *self.limits.T)
        return np.linalg.norm(places - self.at(feet), axis=1)


def shares(nodes: Nodes, region: Region) -> Float[np.ndarray, "node"]:
    """Share of the length or area of a region that is nearest to each node; they sum to 1."""
    corners = region.corners()
    clip, measure = _OF_DIMENSION[corners.shape[1]]
    chosen = _near(nodes, region)
    near = nodes[chosen]
    tree = cKDTree(near)
    found = np.array([_share(place, near, tree, region, clip, measure) for place in near])
    return _spread(found / measure(corners), chosen)


def shares_by_points(
    nodes: Nodes, repeats: Sequence[np.ndarray]
) -> tuple[Float[np.ndarray, "node"], float]:
    """Share of points nearest to each node, and the greatest standard error of a share.

    Each repeat is a set of points of its own, evenly spread over the region.
    """
    chosen = _within_reach(nodes, np.concatenate(repeats))
    tree, count = cKDTree(nodes[chosen]), int(np.sum(chosen))
    each = [np.bincount(tree.query(one)[1], minlength=count) / len(one) for one in repeats]
    error = np.std(each, axis=0, ddof=1) / np.sqrt(len(repeats))
    return _spread(np.mean(each, axis=0), chosen), float(np.max(error))


def _spread(values: np.ndarray, chosen: Bool[np.ndarray, "node"]) -> np.ndarray:
    whole = np.zeros(len(chosen))
    whole[chosen] = values
    return whole


def _near(nodes: Nodes, region: Region) -> Bool[np.ndarray, "node"]:
    """Nodes that may be nearest to some place of a region.

    No place is farther from a node than the farthest of a grid, and half a cell of the grid.
    """
    chosen = _within_reach(nodes, region.at(region.corners()))
    axes = [np.linspace(low, high, _GRID) for low, high in region.limits]
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, len(axes))
    farthest = np.max(cKDTree(nodes[chosen]).query(region.at(grid))[0])
    half_cell = np.linalg.norm(np.ptp(region.limits, axis=1)) / (_GRID - 1) / 2
    chosen[chosen] = region.distance(nodes[chosen]) <= (farthest + half_cell) * (1 + 1e-9)
    return chosen


def _within_reach(nodes: Nodes, points: np.ndarray) -> Bool[np.ndarray, "node"]:
    """Nodes that may be nearest to some place in the hull of points.

    From every place some node is no farther than from the middle and the radius of the hull.
    """
    middle = np.mean(points, axis=0)
    radius = np.max(np.linalg.norm(points - middle, axis=1))
    distance = np.linalg.norm(nodes - middle, axis=1)
    return distance <= (np.min(distance) + 2 * radius) * (1 + 1e-9)


def _share(
    place: np.ndarray,
    nodes: Nodes,
    tree: cKDTree,
    region: Region,
    clip: Callable[[Corners, np.ndarray, float], Corners],
    measure: Callable[[Corners], float],
) -> float:
    """Length or area of the cell of one node; nodes that tie everywhere share theirs."""
    cell, alike = region.corners(), 1
    hair = _TIE * np.max(np.ptp(cell, axis=0))
    for other, distance in _neighbours(place, tree, nodes):
        seen = region.at(cell) - place
        if len(cell) == 0 or distance > 2 * np.max(np.linalg.norm(seen, axis=1)):
            break  # no node so far away is nearer to any place of the cell
        step = other - place
        normal = region.directions @ step
        level = float(step @ ((other + place) / 2 - region.origin))
        if np.linalg.norm(normal) > _TIE * distance and distance > hair:
            cell = clip(cell, normal, level)
        elif abs(level) <= hair * max(distance, hair):
            alike += 1
        elif level < 0:
            return 0.0
    return measure(cell) / alike


def _neighbours(
    place: np.ndarray, tree: cKDTree, nodes: Nodes
) -> Iterator[tuple[np.ndarray, float]]:
    """All other nodes and their distances, nearest first."""
    begin, itself = 0, True
    while begin < len(nodes):
        end = min(max(_FEW, 4 * begin), len(nodes))
        distance, index = tree.query(place, k=np.arange(begin + 1, end + 1))
        for one, far in zip(index, distance, strict=True):
            if itself and np.array_equal(nodes[one], place):
                itself = False
                continue
            yield nodes[one], float(far)
        begin = end


def _clip_stretch(cell: Corners, normal: np.ndarray, level: float) -> Corners:
    """Part of a stretch where normal * t <= level."""
    low, high = cell[0, 0], cell[-1, 0]
    end = level / normal[0]
    low, high = (low, min(high, end)) if normal[0] > 0 else (max(low, end), high)
    return np.array([[low], [high]]) if low < high else np.empty((0, 1))


def _clip_polygon(cell: Corners, normal: np.ndarray, level: float) -> Corners:
    """Part of a convex polygon where normal . t <= level (Sutherland and Hodgman 1974)."""
    beyond = cell @ normal - level
    kept = []
    for i, corner in enumerate(cell):
        before, here = beyond[i - 1], beyond[i]
        if (before > 0) != (here > 0):
            kept.append(cell[i - 1] + (corner - cell[i - 1]) * before / (before - here))
        if here <= 0:
            kept.append(corner)
    return np.array(kept).reshape(-1, 2)


def _length(cell: Corners) -> float:
    return float(cell[-1, 0] - cell[0, 0]) if len(cell) else 0.0


def _area(cell: Corners) -> float:
    x, y = cell.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2) if len(cell) else 0.0


_OF_DIMENSION = {1: (_clip_stretch, _length), 2: (_clip_polygon, _area)}
