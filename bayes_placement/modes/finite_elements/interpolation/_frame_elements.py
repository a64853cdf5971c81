"""_frame_elements: in, the ends of straight members; out, the motion of their axes, by entries.

Not known here: sections, materials, mode shapes, sensors, probability.
"""

import numpy as np
from jaxtyping import Float, Int

from ...._types import InputError
from ._elements import HERMITE, Elements, elements
from ._interpolation import Nodes, element_rows

DIRECTIONS = (1, 2, 3, 4, 5, 6)
_LINEAR = np.array([[1, -1, 0, 0], [0, 1, 0, 0]], dtype=float)


def frame_elements(nodes: Nodes, ends: Int[np.ndarray, "element 2"]) -> Elements:
    """Euler-Bernoulli elements: linear along the member, cubic across it.

    Both bendings have the same cubics, so that it does not matter which axes the section has.
    """
    rows = element_rows(nodes, ends, DIRECTIONS)
    length, along, across = kinematics(nodes, ends)
    move = np.einsum("ft,exd->eftxd", _LINEAR, along) + np.einsum(
        "ft,exd->eftxd", HERMITE[::2], across[:, :, :3]
    )
    turn = np.einsum("ft,exd,e->eftxd", HERMITE[1::2], across[:, :, 3:], length)
    coefficients = np.concatenate([move, turn], axis=-1)  # element, end, term, axis, direction
    coefficients = np.moveaxis(coefficients, 1, 3).reshape(len(ends), 4, 3, 12)
    start, finish = nodes.position[ends[:, 0]], nodes.position[ends[:, 1]]
    return elements(
        (1, 2, 3),
        start,
        (finish - start)[:, :, None],
        rows,
        coefficients,
        ((0,), (1,), (2,), (3,)),
        simplex=False,
    )


def kinematics(
    nodes: Nodes, ends: Int[np.ndarray, "element 2"]
) -> tuple[
    Float[np.ndarray, "element"],
    Float[np.ndarray, "element 3 3"],
    Float[np.ndarray, "element 3 6"],
]:
    """Lengths [m]; motion along the member by translations; motion across it and its slope.

    The last: translations give the motion across, rotations the slope theta x e of the axis, in
    space (dv/dx = theta_z, dw/dx = -theta_y in any local axes).

    Raises
    ------
    ValueError
        If an element has no length.
    """
    chord = nodes.position[ends[:, 1]] - nodes.position[ends[:, 0]]
    length = np.linalg.norm(chord, axis=1)
    if not (length > 0).all():
        one = int(np.argmin(length))
        raise InputError(
            f"Element {one} joins node {nodes.node[ends[one, 0]]} to node "
            f"{nodes.node[ends[one, 1]]} at the same place; a length is needed to have a slope. "
            f"Leave it out: elements = np.delete(elements, {one}, axis=0)."
        )
    unit = chord / length[:, None]
    along = np.einsum("ex,ed->exd", unit, unit)
    slope = np.moveaxis(np.cross(np.eye(3), unit[:, None]), 1, 2)  # column d: e_d x unit
    return length, along, np.concatenate([np.eye(3) - along, slope], axis=2)
