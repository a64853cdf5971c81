"""Linear elements on lines, triangles and tetrahedra."""

import numpy as np
from jaxtyping import Int

from ...._types import InputError, arguments_checked
from ._elements import Elements, build_elements
from ._interpolation import NodalModel, element_rows


@arguments_checked
def linear(
    model: NodalModel,
    elements: Int[np.ndarray, "element corner"],
    *,
    axes: tuple[int, ...] = (1, 2, 3),
) -> Elements:
    """Linear shape functions on lines, triangles or tetrahedra between nodes.

    For meshes of which only nodes and corners are known. Continuous, but with kinks: gradients
    in position jump from element to element.

    Parameters
    ----------
    model
        Nodes and degrees of freedom, for example a `ModalModel`.
    elements
        Indices into `model.node` of the two, three or four corners of each element.
    axes
        Axes along which the motion is read, of 1, 2, 3 for x, y, z.

    Returns
    -------
    Elements
        Shapes between nodes along `axes`.

    Raises
    ------
    InputError
        If an index is out of range or a degree of freedom is missing.

    Examples
    --------
    >>> triangles = np.array([[0, 1, 3], [1, 3, 4]])
    >>> np.asarray(bp.finite_elements.interpolation.linear(plane, triangles, axes=(3,)).rows)
    array([[ 2,  5, 11],
           [ 5, 11, 14]])
    """
    count = elements.shape[1]
    if count not in (2, 3, 4):
        raise InputError(
            f"Elements with {count} corners were given; linear shape functions are those of 2, 3 "
            "or 4 corners (lines, triangles, tetrahedra). Split others: "
            "elements[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3) for quadrilaterals."
        )
    if not axes or not set(axes) <= {1, 2, 3}:
        raise InputError(
            f"axes={axes} was given; at least one of 1, 2, 3 for x, y, z is needed, since the "
            "motion is read along them: axes=(3,)."
        )
    rows = element_rows(model, elements, axes)
    position = model.position[elements]
    term = np.hstack([np.eye(count)[:, :1], np.vstack([-np.ones(count - 1), np.eye(count - 1)])])
    coefficients = np.einsum("ct,ab->tacb", term, np.eye(len(axes)))
    exponents = np.vstack([np.zeros(count - 1, dtype=int), np.eye(count - 1, dtype=int)])
    return build_elements(
        axes,
        position[:, 0],
        (position[:, 1:] - position[:, :1]).mT,
        rows,
        coefficients.reshape(1, count, len(axes), -1),
        tuple(tuple(int(power) for power in powers) for powers in exponents),
        simplex=True,
        kind=np.zeros(len(elements), dtype=np.int64),
    )
