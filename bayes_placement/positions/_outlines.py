"""Outlines of the places that a position may take, to draw a tolerance by."""

import itertools

import numpy as np
from jaxtyping import Float

from .._shared.ranges import reach
from .._shared.sites import is_unknown
from .bounds import Bounds, in_space
from .places import AtNode, InBall, Straight

Points = Float[np.ndarray, "point 3"]

ANGLES = np.linspace(0.0, 2 * np.pi, 73)
"""Angles of the points of a circle [rad]."""


def outline_of(position: object, bounds: Bounds) -> Points:
    """Lines around the places that a position may take [m], separated by NaN; none if it is known.

    Of a segment or a member the stretch itself, of a box or a patch its edges, of a ball its
    circles along the axes, of nodes each as a line without length. Nothing is drawn beyond the
    structure. On a line y and z are 0.
    """
    if isinstance(position, AtNode):
        lines = _nodes(position) if is_unknown(position.node) else []
    elif isinstance(position, InBall):
        lines = _circles(position) if any(map(is_unknown, position.share)) else []
    elif isinstance(position, Straight):
        lines = _edges(position)
    else:
        lines = [_on_a_line(position)] if is_unknown(position) and np.ndim(bounds[0]) == 0 else []
    low, high = (_corner(end) for end in bounds)
    gap = np.full((1, 3), np.nan)
    parts = [part for line in lines for part in (np.clip(line, low, high), gap)]
    return np.concatenate(parts) if parts else np.zeros((0, 3))


def _corner(end: object) -> np.ndarray:
    return np.asarray(end, dtype=float) if in_space((end, end)) else np.array([end, 0.0, 0.0])


def _on_a_line(position: object) -> Points:
    return np.array([[end, 0.0, 0.0] for end in reach(position)])


def _nodes(position: AtNode) -> list[Points]:
    """The nodes, each as a line from it to itself."""
    probability = np.asarray(position.node.probs)  # type: ignore[union-attr]
    nodes = np.asarray(position.position, dtype=float)[probability > 0]
    padded = nodes if nodes.ndim == 2 else np.pad(nodes[:, None], ((0, 0), (0, 2)))
    return [np.stack([node, node]) for node in padded]


def _edges(position: Straight) -> list[Points]:
    """Edges of what lies between the ends of each length that is not known."""
    origin, directions, values = position.frame()
    sides = [reach(value) if is_unknown(value) else (value,) for value in values.values()]
    corners = list(itertools.product(*(range(len(side)) for side in sides)))
    pairs = (pair for pair in itertools.combinations(corners, 2) if _are_neighbours(*pair))

    def place(corner: tuple[int, ...]) -> np.ndarray:
        lengths = [side[number] for side, number in zip(sides, corner, strict=True)]
        return np.asarray(origin + np.array(lengths, dtype=float) @ directions)

    return [np.stack([place(first), place(second)]) for first, second in pairs]


def _are_neighbours(corner: tuple[int, ...], other: tuple[int, ...]) -> bool:
    return int(np.abs(np.subtract(corner, other)).sum()) == 1


def _circles(position: InBall) -> list[Points]:
    """Circles about the centre in each plane of two axes along which the structure extends."""
    centre, radius = np.array(position.middle()), position.cut.radius
    free = [number for number, extends in enumerate(position.axes) if extends]
    if len(free) == 1:
        step = radius * np.eye(3)[free[0]]
        return [np.stack([centre - step, centre + step])]
    circles = []
    for across, up in itertools.combinations(free, 2):
        directions = np.eye(3)[[across, up]]
        turned = np.stack([np.cos(ANGLES), np.sin(ANGLES)], axis=1)
        circles.append(centre + radius * turned @ directions)
    return circles
