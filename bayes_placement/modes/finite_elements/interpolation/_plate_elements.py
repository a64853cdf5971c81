"""Bogner-Fox-Schmit rectangles of plates."""

import numpy as np
from jaxtyping import Bool, Float, Int

from ...._types import InputError, arguments_checked
from ._elements import HERMITE, Elements, all_exponents, build_elements
from ._interpolation import NodalModel, element_rows

_DIRECTIONS = (3, 4, 5, 7)


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
    rows = element_rows(model, elements, _DIRECTIONS)
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
) -> tuple[Float[np.ndarray, "element 4 4"], Float[np.ndarray, "element 4 4"]]:
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
