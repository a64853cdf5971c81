"""How soft supports move: on springs, as rotations of a clamped node, along an edge."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.linalg import null_space

from ..._shared.arguments import arguments_checked
from ..._shared.errors import InputError
from ..._shared.reprs import with_short_repr
from ...positions.vectors import Vector, direction_of, vector
from .interpolation._interpolation import rows_of
from .matrices import Matrices

Rows = Int[np.ndarray, "row"]
InSpace = Float[np.ndarray, "3"]
Motions = Float[np.ndarray, "motion motion"]

ROTATION, TRANSLATION, ALONG_AN_EDGE = "rad/(N m)", "m/N", "m2/N"
"""Units of the compliance of a support."""

ANY_UNIT = f"{ROTATION}, {TRANSLATION} or {ALONG_AN_EDGE}"
"""What is written where the motion of a support is not known."""

_ROUNDING = 1e-9  # of the length of an edge
_ROTATIONS = (4, 5, 6)


@with_short_repr
class SupportMotion(NamedTuple):
    """How a soft support moves, and against which springs.

    Parameters
    ----------
    rows
        Held rows of `dof` that move.
    motion
        Displacement of the rows [m or rad] in each motion.
    pattern
        Stiffness of a unit spring against these motions: of 1 N m/rad in a rotation, 1 N/m in a
        translation, 1 N/m per metre along an edge.
    compliance_unit
        Unit of the inverse of that stiffness.

    Examples
    --------
    >>> foot = bp.finite_elements.soft_supports.springs(matrices, [1])
    >>> foot.rows, foot.pattern, foot.compliance_unit
    (array([1]), array([[1.]]), 'rad/(N m)')
    """

    rows: Rows
    motion: Float[np.ndarray, "row motion"]
    pattern: Motions
    compliance_unit: str = ANY_UNIT


@arguments_checked
def springs(matrices: Matrices, rows: Rows | Sequence[int] | int) -> SupportMotion:
    """Put some held rows on springs, all of one stiffness.

    Parameters
    ----------
    matrices
        The model.
    rows
        Rows of its `dof`.

    Raises
    ------
    InputError
        If a row is not held.

    Examples
    --------
    >>> bp.finite_elements.soft_supports.springs(matrices, [0, 1]).motion
    array([[1., 0.],
           [0., 1.]])
    """
    support_rows = np.atleast_1d(np.asarray(rows))
    free = np.setdiff1d(support_rows, matrices.fixed)
    if not support_rows.size or free.size:
        what = f"row {free[0]}, which is free" if free.size else "no row"
        raise InputError(
            f"soft_supports.springs was given {what}; rows that are held are needed, since only "
            "what a support holds can become soft. Take rows of matrices.fixed."
        )
    unit = np.eye(support_rows.size)
    turns = np.isin(matrices.dof[support_rows, 1], _ROTATIONS)
    units = dict.fromkeys(ROTATION if turning else TRANSLATION for turning in turns)
    return SupportMotion(support_rows, unit, unit, " or ".join(units))


@arguments_checked
def rotations(matrices: Matrices, node: int, *, along: Vector | None = None) -> SupportMotion:
    """Let a clamped node rotate against a spring: the foot of a frame.

    Parameters
    ----------
    matrices
        The model.
    node
        Number of the node.
    along
        Direction of the member that is clamped there; only its two bending rotations, about the
        axes across it, are released. By default all rotations are.

    Returns
    -------
    SupportMotion
        Rows that are released, for `soft` of `modes`.

    Raises
    ------
    InputError
        If no rotation is held there.

    Examples
    --------
    >>> foot = bp.finite_elements.soft_supports.rotations(matrices, node=1)
    >>> foot.rows
    array([1])
    """
    fixed_rows = matrices.fixed[matrices.dof[matrices.fixed, 0] == node]
    rows = np.sort(fixed_rows[np.isin(matrices.dof[fixed_rows, 1], _ROTATIONS)])
    axis = np.eye(3)[matrices.dof[rows, 1] - 4]
    motion = (
        np.eye(rows.size)
        if along is None
        else _across(axis, np.array(direction_of("rotations(along=...)", along)))
    )
    if not motion.size:
        raise InputError(
            f"soft_supports.rotations was given node {node}, at which "
            f"{'no' if not rows.size else 'no bending'} rotation is held; only what a support "
            "holds can become soft. Name a clamped node: matrices.dof[matrices.fixed, 0] has them."
        )
    return SupportMotion(rows, motion, np.eye(motion.shape[1]), ROTATION)


@arguments_checked
def edge(matrices: Matrices, start: Vector, end: Vector, *, direction: int = 3) -> SupportMotion:
    """Let a straight edge of a plate move across its plane against a line spring.

    Where the slope along the edge is held as well, the deflection between nodes is cubic, else
    linear. An end that another edge also holds does not move.

    Parameters
    ----------
    matrices
        The model.
    start, end
        Ends of the edge [m].
    direction
        Direction of the deflection, 1, 2 or 3 for x, y, z.

    Returns
    -------
    SupportMotion
        Rows that are released, for `soft` of `modes`.

    Raises
    ------
    InputError
        If fewer than two nodes are held along the edge.

    Examples
    --------
    >>> rows = {"dof": [(node, 3) for node in range(1, 10)], "fixed": np.array([0, 3, 6])}
    >>> supported = bp.finite_elements.Matrices(
    ...     stiffness=1e3 * np.eye(9), mass=np.eye(9), position=plane.position, **rows
    ... )
    >>> bp.finite_elements.soft_supports.edge(supported, (0.0, 0.0, 0.0), (0.0, 0.8, 0.0)).rows
    array([0, 3, 6])
    """
    first, last = (
        np.array(vector(f"edge({word}=...)", at)) for word, at in (("start", start), ("end", end))
    )
    if direction not in (1, 2, 3):
        raise InputError(
            f"direction={direction} was given; 1, 2 or 3 for x, y, z is needed, since the edge "
            "moves along it: direction=3."
        )
    nodes, distance = _along(matrices, first, last)
    table = rows_of(matrices, tuple(range(8)))[nodes]
    table = np.where(np.isin(table, matrices.fixed), table, -1)
    is_held = table[:, direction] >= 0
    if np.count_nonzero(is_held) < 2:
        raise InputError(
            f"soft_supports.edge was given {first.tolist()} to {last.tolist()} m, along which "
            f"{np.count_nonzero(is_held)} nodes are held in direction {direction}; at least two "
            "are needed, since only what a support holds can become soft. Give both ends of a held "
            "edge."
        )
    table, step = table[is_held], np.diff(distance[is_held])
    slope, sign = _slope(first, last, direction)
    cubic = slope > 0 and bool((table[:, slope] >= 0).all())
    free = ~_held_by_others(table)
    kind = _CUBIC if cubic else _LINEAR
    rows = table[:, [direction, slope][: kind.per_node]].ravel()
    moving = np.stack([free, np.ones_like(free)][: kind.per_node], axis=1).ravel()
    motion = np.diag(np.tile([1.0, sign][: kind.per_node], len(table)))
    chosen = np.ix_(moving, moving)
    pattern = _line_spring(step, kind)[chosen]
    return SupportMotion(rows[moving], motion[chosen], pattern, ALONG_AN_EDGE)


def _across(axis: Float[np.ndarray, "row 3"], along: InSpace) -> Float[np.ndarray, "row motion"]:
    """Combinations of rotations about axes that do not rotate about a direction."""
    about = axis @ (along / np.linalg.norm(along))
    # Where all are across it, each by itself.
    return null_space(about[None]) if (np.abs(about) > _ROUNDING).any() else np.eye(len(axis))


def _along(
    matrices: Matrices, first: InSpace, last: InSpace
) -> tuple[Int[np.ndarray, "node"], Float[np.ndarray, "node"]]:
    """Indices of the nodes on a line, in order, and their distances along it [m]."""
    length = float(np.linalg.norm(last - first))
    step = matrices.position - first
    distance = step @ (last - first) / length
    foot = np.clip(distance, 0.0, length)[:, None] * (last - first) / length
    on_line = np.flatnonzero(np.linalg.norm(step - foot, axis=1) < _ROUNDING * length)
    order = on_line[np.argsort(distance[on_line])]
    return order, distance[order]


def _slope(first: InSpace, last: InSpace, direction: int) -> tuple[int, float]:
    """Direction of the rotation that is the slope along an edge, and its sign; 0 where none is."""
    along = (last - first) / np.linalg.norm(last - first)
    about = np.cross(along, np.eye(3)[direction - 1])
    axis = int(np.argmax(np.abs(about)))
    return (4 + axis, float(np.sign(about[axis]))) if abs(about[axis]) > 1 - _ROUNDING else (0, 0.0)


def _held_by_others(table: Int[np.ndarray, "node 8"]) -> Bool[np.ndarray, "node"]:
    """Tell which ends of an edge are held in more directions than the nodes between."""
    is_shared = np.zeros(len(table), dtype=bool)
    if len(table) > 2:
        between = (table[1:-1] >= 0).all(axis=0)
        is_shared[[0, -1]] = ((table[[0, -1]] >= 0) & ~between).any(axis=1)
    return is_shared


def _line_spring(step: Float[np.ndarray, "element"], kind: "_LineElement") -> Motions:
    """Stiffness of a line spring of 1 N/m per metre, by nodes."""
    size = kind.per_node * (len(step) + 1)
    stiffness = np.zeros((size, size))
    for number, length in enumerate(step):
        rows = slice(kind.per_node * number, kind.per_node * (number + 2))
        scale = length ** np.tile(np.arange(kind.per_node), 2)
        stiffness[rows, rows] += length * np.outer(scale, scale) * kind.products
    return stiffness


class _LineElement(NamedTuple):
    """Integrals over 0 to 1 of the products of shape functions of both ends."""

    per_node: int
    products: Motions


_LINEAR = _LineElement(1, np.array([[2.0, 1.0], [1.0, 2.0]]) / 6)
_CUBIC = _LineElement(
    2, np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420
)
