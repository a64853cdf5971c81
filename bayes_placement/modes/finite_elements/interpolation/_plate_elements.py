"""_plate_elements: in, the corners of rectangles in x and y; out, the deflection within them.

Not known here: thickness, material, mode shapes, sensors, probability.
"""

import numpy as np
from jaxtyping import Bool, Float, Int

from ...._types import InputError
from ._elements import HERMITE, Elements, all_exponents, elements
from ._interpolation import Nodes, element_rows

_DIRECTIONS = (3, 4, 5, 7)


def plate_elements(nodes: Nodes, corners: Int[np.ndarray, "element 4"]) -> Elements:
    """Bogner-Fox-Schmit rectangles with w, rx = w_y, ry = -w_x and w_xy at each corner."""
    rows = element_rows(nodes, corners, _DIRECTIONS)
    position = nodes.position[corners]
    low, side = position.min(axis=1), np.ptp(position, axis=1)
    high = position[:, :, :2] > (low + side / 2)[:, None, :2]
    _check_rectangles(position, low, side, high)
    x, y = (_value_and_slope(high[:, :, axis], side[:, axis]) for axis in (0, 1))
    pairs = [(x[0], y[0]), (x[0], y[1]), (-x[1], y[0]), (x[1], y[1])]
    products = [np.einsum("ecm,ecn->emnc", *pair) for pair in pairs]
    coefficients = np.stack(products, axis=-1).reshape(len(corners), 16, 1, 16)
    edges = np.einsum("el,dl->edl", side[:, :2], np.eye(3)[:, :2])
    return elements((3,), low, edges, rows, coefficients, all_exponents(2, 3, False), simplex=False)


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
    off = np.abs(position - expected).max(axis=(1, 2))
    which = np.sort(high @ np.array([1, 2]), axis=1)
    bad = (off > 1e-6 * side.max(axis=1)) | (which != np.arange(4)).any(axis=1)
    if bad.any():
        raise InputError(
            f"The four corners of element {np.argmax(bad)} are no rectangle with sides along x "
            "and y in a plane of constant z; that is needed, since its degrees of freedom are "
            "derivatives in x and y. For other plates hand over a scikit-fem basis: "
            "interpolation.scikit_fem(basis, axes=(3,))."
        )
