"""Joints of a frame of beam elements, found in its matrices alone.

Assembled matrices and nodes come in, ends of elements that may turn against their nodes go out. No
list of elements, and no section, is known here.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..._shared.arguments import arguments_checked
from ..._shared.reprs import with_short_repr
from .interpolation._interpolation import rows_of
from .matrices import Matrices

MOST_JOINTS = 60
"""Joints of a frame that are tried where none are named."""

MOST_NODES = 20_000
"""Nodes of a model in which joints are looked for where none are named: no frame has more."""

IN_LINE = np.cos(np.radians(15.0))
"""Cosine of the angle up to which two elements are one member, which may be curved."""

SAME_SECTION = 0.25
"""Relative change of flexibility up to which two elements are one member, maybe tapered."""

_ROUNDING = 1e-4  # of stiffness; matrices may have few digits, and shells are far off
_ALMOST_EQUAL = 1e-8  # of stiffness, by which axes that bend alike are told apart
_WEAKEST = 1e-9  # of the stiffness at a node, below which an element is none

# Momenta at an end that turns over those at the other end.
_DEFLECTION, _BENDING, _TORSION = 22 / 13, -4 / 3, 2.0

DIRECTIONS = (1, 2, 3, 4, 5, 6)

Nodes = Int[np.ndarray, "end"]
Rows = Int[np.ndarray, "node 6"]
Blocks = Float[np.ndarray, "end 6 6"]
Vector = Float[np.ndarray, "6"]
Square = Float[np.ndarray, "3 3"]
InSpace = Float[np.ndarray, "3"]


@with_short_repr
class Joint(NamedTuple):
    """The end of a beam element, which may turn against its node about one axis.

    Parameters
    ----------
    node
        Number of the node.
    other
        Number of the node at the other end of the element.
    turn
        Motion of the rows of `dof` where this end turns by one radian.
    moment
        Moment in the joint under a unit motion of each row [N m/m, N m/rad].
    momentum
        Angular momentum of the element about it under a unit velocity of each row.

    Examples
    --------
    >>> bp.finite_elements.joints(matrices)["node 1 about z"].stiffness  # 4 * 70 N m2 / 0.25 m
    1120.0
    """

    node: int
    other: int
    turn: Float[np.ndarray, "dof"]
    moment: Float[np.ndarray, "dof"]
    momentum: Float[np.ndarray, "dof"]

    @property
    def stiffness(self) -> float:
        """Moment in the joint where this end alone turns by one radian [N m/rad]."""
        return float(self.turn @ self.moment)


class _Ends(NamedTuple):
    """Ends of elements, each at a node, of the element from there to another node."""

    node: Int[np.ndarray, "end"]
    other: Int[np.ndarray, "end"]
    own: Blocks
    """Forces at this end under unit motions of it alone."""
    opposite: Blocks
    """Forces at the other end under them."""

    def chosen(self, these: Bool[np.ndarray, "end"] | Int[np.ndarray, "chosen"]) -> "_Ends":
        """Only some ends."""
        return _Ends(*(field[these] for field in self))


@arguments_checked
def joints(matrices: Matrices) -> dict[str, Joint]:
    """Joints of a frame of beam elements, each of which may be looser than it was modelled.

    What couples two nodes is the element between them alone, and its rigid motions cost nothing:
    a block K_ij and the rigid motion T of node j with node i give its stiffness at i, -K_ij T
    (McGuire, Gallagher and Ziemian, Matrix Structural Analysis, ch. 4). It is symmetric and not
    negative in a frame, and in no shell.

    A joint is where elements meet at more than 15 degrees, where more than two meet, where
    flexibility in bending or torsion changes by more than a quarter, and where a rotation is held.
    Its axes are the principal ones of the end of an element: torsion and two of bending. The same
    moment passes through two elements that meet: one joint for each axis.

    Parameters
    ----------
    matrices
        Stiffness and mass.

    Returns
    -------
    dict[str, Joint]
        Joints by name, such as `node 3 about z`, or `node 3 to 7 about z` where several elements
        have a joint of their own; none if this is no frame of beam elements.

    Examples
    --------
    >>> list(bp.finite_elements.joints(matrices))  # a cantilever
    ['node 1 about z']
    """
    ends, table = _ends(matrices), rows_of(matrices, DIRECTIONS)
    is_held = np.isin(table, matrices.fixed) & (table >= 0)
    named = (
        (name, end, axis)
        for node in np.unique(ends.node)
        for name, end, axis in _at_node(matrices, ends.chosen(ends.node == node), is_held[node, 3:])
    )
    joints = {name: _joint(matrices, table, end, axis) for name, end, axis in named}
    return {name: joint for name, joint in joints.items() if _is_felt(matrices, joint)}


def _ends(matrices: Matrices) -> _Ends:
    """Ends of all elements that resist rotations; none if this is no frame."""
    ends = _coupled(matrices)
    of_node = np.zeros((len(matrices.node), 6))
    np.add.at(of_node, ends.node, np.abs(np.diagonal(ends.own, axis1=1, axis2=2)))
    unit = 1 / np.sqrt(np.where(of_node > 0, of_node, np.inf))[ends.node]
    relative = unit[:, :, None] * ends.own * unit[:, None]
    is_frame = (
        np.abs(relative - relative.mT).max(initial=0.0) < _ROUNDING
        and np.linalg.eigvalsh((relative + relative.mT) / 2).min(initial=0.0) > -_ROUNDING
    )
    turns = np.trace(relative[:, 3:, 3:], axis1=1, axis2=2) > _WEAKEST
    return ends.chosen(turns & is_frame)


def _coupled(matrices: Matrices) -> _Ends:
    """Both ends of whatever couples two nodes, where some have rotations and none a twist."""
    entries, count = matrices.stiffness.tocoo(), len(matrices.node)
    node, direction = matrices.node_index, matrices.dof[:, 1] - 1
    between = (node[entries.row] != node[entries.col]) & (3 <= direction.max() < 6)
    row, column = entries.row[between], entries.col[between]
    pair, end = np.unique(node[row] * count + node[column], return_inverse=True)
    here, there = np.divmod(pair, count)
    block = np.zeros((len(pair), 6, 6))
    block[end, direction[row], direction[column]] = entries.data[between]
    return _Ends(here, there, _own(matrices, here, there, block), block.mT)


def _own(matrices: Matrices, here: Nodes, there: Nodes, block: Blocks) -> Blocks:
    """Forces at one end under motions of it alone: minus those if the other end goes with it."""
    arm = matrices.position[there] - matrices.position[here]
    rigid = np.tile(np.eye(6), (len(here), 1, 1))
    rigid[:, :3, 3:] = np.moveaxis(np.cross(np.eye(3), arm[:, None]), 1, 2)  # e x arm
    has_row = rows_of(matrices, DIRECTIONS)[here] >= 0
    return -block @ rigid * has_row[:, None]


def _at_node(
    matrices: Matrices, ends: _Ends, is_held: Bool[np.ndarray, "3"]
) -> Iterator[tuple[str, _Ends, InSpace]]:
    """Joints at a node by name: ends of its elements, and axes."""
    count, node = len(ends.node), matrices.node[ends.node[0]]
    passing = count == 1 or (count == 2 and _is_one_member(matrices, ends))
    free = 0 if passing else 1 if count == 2 else count
    for number, other in enumerate(matrices.node[ends.other]):
        end = ends.chosen(np.array([number]))
        for axis in _axes(end.own[0, 3:, 3:]):
            sides = count if axis**2 @ is_held > 0.5 else free
            if number < sides:
                to = f" to {other}" if sides > 1 else ""
                yield f"node {node}{to} about {_in_words(axis)}", end, axis


def _is_one_member(matrices: Matrices, ends: _Ends) -> bool:
    """Tell whether two elements at a node are in line and bend and twist alike."""
    arm = matrices.position[ends.other] - matrices.position[ends.node]
    length = np.linalg.norm(arm, axis=1)
    # A constant moment turns an end by its length over E I, whatever it shears.
    turn = np.linalg.pinv(ends.own, rcond=1e-12, hermitian=True)[:, 3:, 3:]
    one, other = turn * length[::-1, None, None]
    ratios = [_greatest_ratio(one, other), _greatest_ratio(other, one)]
    is_straight = -arm[0] @ arm[1] > IN_LINE * length[0] * length[1]
    return bool(is_straight and max(ratios) < 1 + SAME_SECTION)


def _greatest_ratio(one: Square, other: Square) -> float:
    """Greatest ratio of two flexibilities about any axis in which they have one."""
    return float(np.linalg.eigvals(np.linalg.pinv(other, rcond=1e-9) @ one).real.max())


def _axes(stiffness: Square) -> list[InSpace]:
    """Principal axes of the stiffness of an end against rotations, but those that cost nothing."""
    size = np.trace(stiffness)
    values, axes = np.linalg.eigh(stiffness + _ALMOST_EQUAL * size * np.diag([0.0, 1.0, 2.0]))
    along = axes * np.sign(axes[np.abs(axes).argmax(axis=0), range(3)])
    return [axis for value, axis in zip(values, along.T, strict=True) if value > _ROUNDING * size]


def _in_words(axis: InSpace) -> str:
    """Name of an axis, or its components."""
    if axis.max() > 0.999:
        return "xyz"[int(np.argmax(axis))]
    return " ".join(f"{component:.2f}" for component in np.round(axis, 2) + 0.0)


def _joint(matrices: Matrices, table: Rows, end: _Ends, axis: InSpace) -> Joint:
    """Return the joint of one end about one axis."""
    here, there = table[end.node[0]], table[end.other[0]]
    turned, still = np.concatenate([np.zeros(3), axis]), np.zeros(6)
    coupled = matrices.mass[there][:, here].toarray() * np.outer(there >= 0, here >= 0) @ turned
    vectors = np.zeros((3, len(matrices.dof)))
    for rows, *at_node in (
        (here, turned, end.own[0] @ turned, _own_momentum(coupled, axis)),
        (there, still, end.opposite[0] @ turned, coupled),
    ):
        vectors[:, rows[rows >= 0]] = np.stack(at_node)[:, rows >= 0]
    numbers = matrices.node[[end.node[0], end.other[0]]].tolist()
    return Joint(*numbers, *vectors)


def _own_momentum(coupled: Vector, axis: InSpace) -> Vector:
    """Momentum at the end of an element that turns, from that at its other end.

    Of a uniform element with cubic shapes in bending, linear ones in torsion; none of a lumped one.
    """
    of_rotation = _BENDING if coupled[3:] @ axis < 0 else _TORSION
    return coupled * np.repeat([_DEFLECTION, of_rotation], 3)


def _is_felt(matrices: Matrices, joint: Joint) -> bool:
    """Tell whether a motion that is not held strains a joint."""
    size = np.sqrt(joint.stiffness * np.maximum(matrices.stiffness.diagonal(), 0.0))
    return bool(np.delete(np.abs(joint.moment) > _ROUNDING * size, matrices.fixed).any())
