"""_linear_elements: in, the corners of simplices; out, the motion between them, linear in each.

Not known here: mode shapes, sensors, probability.
"""

import numpy as np
from jaxtyping import Int

from ...._types import InputError
from ._elements import Elements, elements
from ._interpolation import Nodes, element_rows


def linear_elements(
    nodes: Nodes, corners: Int[np.ndarray, "element corner"], axes: tuple[int, ...]
) -> Elements:
    """Linear shape functions on lines, triangles or tetrahedra."""
    count = corners.shape[1]
    if count not in (2, 3, 4):
        raise InputError(
            f"Elements with {count} corners were given; linear shape functions are those of 2, 3 "
            "or 4 corners (lines, triangles, tetrahedra). Split others: "
            "elements[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3) for quadrilaterals."
        )
    rows = element_rows(nodes, corners, axes)
    position = nodes.position[corners]
    term = np.hstack([np.eye(count)[:, :1], np.vstack([-np.ones(count - 1), np.eye(count - 1)])])
    coefficients = np.einsum("ct,ab->tacb", term, np.eye(len(axes)))
    exponents = np.vstack([np.zeros(count - 1, dtype=int), np.eye(count - 1, dtype=int)])
    return elements(
        axes,
        position[:, 0],
        (position[:, 1:] - position[:, :1]).mT,
        rows,
        coefficients.reshape(1, count, len(axes), -1),
        tuple(tuple(int(power) for power in one) for one in exponents),
        simplex=True,
        kind=np.zeros(len(corners), dtype=np.int64),
    )
