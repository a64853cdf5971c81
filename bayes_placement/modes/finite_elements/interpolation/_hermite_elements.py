"""Cubic elements: of straight members, what a tension adds to their stiffness, and of plates."""

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import sparse

from ...._shared.arguments import arguments_checked
from ...._shared.errors import InputError
from ._elements import HERMITE, Elements, all_exponents, build_elements
from ._interpolation import NodalModel, element_rows

Cubics = Float[np.ndarray, "element 4 4"]

Ends = Int[np.ndarray, "element 2"]

_OF_FRAME, _OF_PLATE = (1, 2, 3, 4, 5, 6), (3, 4, 5, 7)  # directions of degrees of freedom
_LINEAR = np.array([[1, -1, 0, 0], [0, 1, 0, 0]], dtype=float)
# Integrals over 0 to 1 of the products of the slopes of the four Hermite cubics.
_SLOPES = np.array([[36, 3, -36, 3], [3, 4, -3, -1], [-36, -3, 36, -3], [3, -1, -3, 4]]) / 30


@arguments_checked
def frame(model: NodalModel, elements: Ends) -> Elements:
    """Two-node Euler-Bernoulli elements in space, along x, y and z.

    Linear along the member, cubic across it: C1 along each member. The motion of a member's axis
    depends neither on its torsion nor on the axes of its section. A position off the axis is read
    at the closest position on it.

    Parameters
    ----------
    model
        Nodes and degrees of freedom, for example a `ModalModel`; the nodes of the elements need
        all of the directions 1 to 6.
    elements
        Indices into `model.node` of the two ends of each element.

    Raises
    ------
    InputError
        If an index is out of range, a degree of freedom is missing, or an element has no length.

    Examples
    --------
    >>> ends = {"node": [1, 2], "position": [(0, 0, 0), (2, 0, 0)]}
    >>> dof = [(node, axis) for node in ends["node"] for axis in range(1, 7)]
    >>> mode = {"shape": np.ones((12, 1)), "natural_frequency": [9.0], "modal_mass": 1.0}
    >>> model = bp.finite_elements.ModalModel.from_arrays(**ends, dof=dof, **mode)
    >>> bp.finite_elements.interpolation.frame(model, np.array([[0, 1]])).axes
    (1, 2, 3)
    """
    rows = element_rows(model, elements, _OF_FRAME)
    length, along, across = kinematics(model, elements)
    translation = np.einsum("ft,exd->eftxd", _LINEAR, along) + np.einsum(
        "ft,exd->eftxd", HERMITE[::2], across[:, :, :3]
    )
    # Both bendings have the same cubics, so that the axes of the section do not matter.
    rotation = np.einsum("ft,exd,e->eftxd", HERMITE[1::2], across[:, :, 3:], length)
    # Element, end, term, axis, direction.
    coefficients = np.concatenate([translation, rotation], axis=-1)
    coefficients = np.moveaxis(coefficients, 1, 3).reshape(len(elements), 4, 3, 12)
    start, finish = model.position[elements[:, 0]], model.position[elements[:, 1]]
    return build_elements(
        (1, 2, 3),
        start,
        (finish - start)[:, :, None],
        rows,
        coefficients,
        ((0,), (1,), (2,), (3,)),
        simplex=False,
    )


def kinematics(
    model: NodalModel, elements: Ends
) -> tuple[
    Float[np.ndarray, "element"], Float[np.ndarray, "element 3 3"], Float[np.ndarray, "element 3 6"]
]:
    """Lengths [m]; motion along the member by translations; motion across it and its slope.

    In the last, translations give the motion across, rotations the slope theta x e of the axis
    (dv/dx = theta_z, dw/dx = -theta_y in any local axes).
    """
    ends = model.position[elements]
    chord = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(chord, axis=1)
    if not (length > 0).all():
        element = int(np.argmin(length))
        start, end = model.node[elements[element]]
        raise InputError(
            f"Element {element} joins node {start} to node {end} at the same position; a length is "
            "needed to have a slope. Leave it out: "
            f"elements = np.delete(elements, {element}, axis=0)."
        )
    unit = chord / length[:, None]
    along = np.einsum("ex,ed->exd", unit, unit)
    slope = np.moveaxis(np.cross(np.eye(3), unit[:, None]), 1, 2)  # column d: e_d x unit
    return length, along, np.concatenate([np.eye(3) - along, slope], axis=2)


@arguments_checked
def frame_geometric_stiffness(model: NodalModel, elements: Ends) -> sparse.csc_array:
    """Geometric stiffness per unit tension [1/m] of frame elements, on all degrees of freedom.

    The consistent one, of the integral of v'^2 + w'^2 over the elements with cubic shape
    functions (Przemieniecki 1968, Theory of Matrix Structural Analysis, chapter 15). Times the
    tension [N], negative for a compression, it adds to the stiffness matrix.

    Parameters
    ----------
    model
        Nodes and degrees of freedom, for example a `ModalModel`; all of the directions 1 to 6.
    elements
        Indices into `model.node` of the two ends of each element under tension.

    Returns
    -------
    scipy.sparse.csc_array
        Matrix of shape (dof, dof).

    Raises
    ------
    InputError
        If an index is out of range, a degree of freedom is missing, or an element has no length.

    Examples
    --------
    >>> ends = {"node": [1, 2], "position": [(0, 0, 0), (2, 0, 0)]}
    >>> dof = [(node, axis) for node in ends["node"] for axis in range(1, 7)]
    >>> mode = {"shape": np.ones((12, 1)), "natural_frequency": [9.0], "modal_mass": 1.0}
    >>> model = bp.finite_elements.ModalModel.from_arrays(**ends, dof=dof, **mode)
    >>> element = np.array([[0, 1]])
    >>> stiffness = bp.finite_elements.interpolation.frame_geometric_stiffness(model, element)
    >>> float(stiffness[1, 1])  # 6 / (5 * 2 m)
    0.6
    """
    rows = element_rows(model, elements, _OF_FRAME)
    length, _, across = kinematics(model, elements)
    value, slope = across[:, :, :3], across[:, :, 3:] * length[:, None, None]
    ends = np.zeros((len(elements), 4, 3, 12))  # value and slope times length at both ends
    ends[:, 0, :, 0:3], ends[:, 1, :, 3:6] = value, slope
    ends[:, 2, :, 6:9], ends[:, 3, :, 9:12] = value, slope
    blocks = np.einsum("efxi,fg,egxj,e->eij", ends, _SLOPES, ends, 1 / length)
    row, column = np.broadcast_arrays(rows[:, :, None], rows[:, None, :])
    shape = (len(model.dof), len(model.dof))
    return sparse.coo_array((blocks.ravel(), (row.ravel(), column.ravel())), shape).tocsc()


@arguments_checked
def plate(model: NodalModel, elements: Int[np.ndarray, "element 4"]) -> Elements:
    """Bogner-Fox-Schmit rectangles of a plate in the x-y plane: its deflection, along z.

    Bicubic, C1 over the entire plate. The directions of each node are 3 (w), 4 (rx = w_y),
    5 (ry = -w_x) and 7 (w_xy).

    Parameters
    ----------
    model
        Nodes and degrees of freedom, for example a `ModalModel`.
    elements
        Indices into `model.node` of the four corners of each rectangle, in any order.

    Raises
    ------
    InputError
        If an index is out of range, a degree of freedom is missing, or an element is no
        rectangle with sides along x and y.

    Examples
    --------
    >>> corner = {"node": [1, 2, 3, 4], "position": [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]}
    >>> dof = [(node, axis) for node in corner["node"] for axis in (3, 4, 5, 7)]
    >>> mode = {"shape": np.ones((16, 1)), "natural_frequency": [9.0], "modal_mass": 1.0}
    >>> model = bp.finite_elements.ModalModel.from_arrays(**corner, dof=dof, **mode)
    >>> bp.finite_elements.interpolation.plate(model, np.array([[0, 1, 2, 3]])).axes
    (3,)
    """
    rows = element_rows(model, elements, _OF_PLATE)
    position = model.position[elements]
    low, side = position.min(axis=1), np.ptp(position, axis=1)
    high = position[:, :, :2] > (low + side / 2)[:, None, :2]
    _check_rectangles(position, low, side, high)
    x, y = (_value_and_slope(high[:, :, axis], side[:, axis]) for axis in (0, 1))
    pairs = [(x[0], y[0]), (x[0], y[1]), (-x[1], y[0]), (x[1], y[1])]
    products = [np.einsum("ecm,ecn->emnc", *pair) for pair in pairs]
    coefficients = np.stack(products, axis=-1).reshape(len(elements), 16, 1, 16)
    edges = np.einsum("el,dl->edl", side[:, :2], np.eye(3)[:, :2])
    return build_elements(
        (3,), low, edges, rows, coefficients, all_exponents(2, 3, False), simplex=False
    )


def _value_and_slope(
    high: Bool[np.ndarray, "element 4"], side: Float[np.ndarray, "element"]
) -> tuple[Cubics, Cubics]:
    """Cubics of one coordinate at each corner: of its value, and of its slope [m]."""
    first = 2 * high.astype(int)
    return HERMITE[first], HERMITE[first + 1] * side[:, None, None]


def _check_rectangles(
    position: Float[np.ndarray, "element 4 3"],
    low: Float[np.ndarray, "element 3"],
    side: Float[np.ndarray, "element 3"],
    high: Bool[np.ndarray, "element 4 2"],
) -> None:
    expected = low[:, None, :].repeat(4, axis=1)
    expected[:, :, :2] += high * side[:, None, :2]
    deviation = np.abs(position - expected).max(axis=(1, 2))
    corner = np.sort(high @ np.array([1, 2]), axis=1)
    bad = (deviation > 1e-6 * side.max(axis=1)) | (corner != np.arange(4)).any(axis=1)
    if bad.any():
        raise InputError(
            f"The four corners of element {np.argmax(bad)} are no rectangle with sides along x "
            "and y in a plane of constant z; that is needed, since its degrees of freedom are "
            "derivatives in x and y. For other plates use a scikit-fem basis: "
            "interpolation.scikit_fem(basis, axes=(3,))."
        )
