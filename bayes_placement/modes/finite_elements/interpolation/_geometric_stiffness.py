"""Geometric stiffness of frame elements: what a tension adds to the stiffness matrix."""

import numpy as np
from jaxtyping import Int
from scipy import sparse

from ...._types import arguments_checked
from ._frame_elements import DIRECTIONS, kinematics
from ._interpolation import NodalModel, element_rows


@arguments_checked
def frame_geometric_stiffness(
    model: NodalModel, elements: Int[np.ndarray, "element 2"]
) -> sparse.csc_array:
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
    rows = element_rows(model, elements, DIRECTIONS)
    length, _, across = kinematics(model, elements)
    value, slope = across[:, :, :3], across[:, :, 3:] * length[:, None, None]
    ends = np.zeros((len(elements), 4, 3, 12))  # value and slope times length at both ends
    ends[:, 0, :, 0:3], ends[:, 1, :, 3:6] = value, slope
    ends[:, 2, :, 6:9], ends[:, 3, :, 9:12] = value, slope
    blocks = np.einsum("efxi,fg,egxj,e->eij", ends, _SLOPES, ends, 1 / length)
    row, column = np.broadcast_arrays(rows[:, :, None], rows[:, None, :])
    shape = (len(model.dof), len(model.dof))
    return sparse.coo_array((blocks.ravel(), (row.ravel(), column.ravel())), shape).tocsc()


# Integrals over 0 to 1 of the products of the slopes of the four Hermite cubics.
_SLOPES = np.array([[36, 3, -36, 3], [3, 4, -3, -1], [-36, -3, 36, -3], [3, -1, -3, 4]]) / 30
