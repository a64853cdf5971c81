"""interpolation: in, nodes and elements of a model; out, what reads mode shapes at any place.

Not known here: natural frequencies, damping, sensors, probability.
"""

from typing import Any

import numpy as np
from jaxtyping import Float, Int

from ._elements import Elements
from ._frame_elements import frame_elements
from ._geometric_stiffness import frame_geometric_stiffness
from ._interpolation import Interpolation, Nodes, Reading
from ._linear_elements import linear_elements
from ._plate_elements import plate_elements
from ._scattered import Nearest, Scattered, nearest_node, scattered_nodes
from ._scikit_fem_elements import basis_elements

__all__ = [
    "Elements",
    "Interpolation",
    "Nearest",
    "Nodes",
    "Reading",
    "Scattered",
    "frame",
    "frame_geometric_stiffness",
    "linear",
    "nearest",
    "plate",
    "scattered",
    "scikit_fem",
]


def frame(model: Nodes, elements: Int[np.ndarray, "element 2"]) -> Elements:
    """Two-node Euler-Bernoulli elements in space, along x, y and z.

    Linear along the member, cubic across it: C1 along each member. The motion of a member's axis
    depends neither on its torsion nor on the axes of its section. A place off the axis is read at
    the closest place on it.

    Parameters
    ----------
    model
        Nodes and degrees of freedom, for example a `ModalModel`; the nodes of the elements need
        all of the directions 1 to 6.
    elements
        Indices into `model.node` of the two ends of each element.

    Raises
    ------
    ValueError
        If an index is out of range, a degree of freedom is missing, or an element has no length.
    """
    return frame_elements(model, elements)


def plate(model: Nodes, elements: Int[np.ndarray, "element 4"]) -> Elements:
    """Bogner-Fox-Schmit rectangles of a plate in the x-y plane: its deflection, along z.

    Bicubic, C1 over the whole plate. The directions of each node are 3 (w), 4 (rx = w_y),
    5 (ry = -w_x) and 7 (w_xy).

    Parameters
    ----------
    model
        Nodes and degrees of freedom, for example a `ModalModel`.
    elements
        Indices into `model.node` of the four corners of each rectangle, in any order.

    Raises
    ------
    ValueError
        If an index is out of range, a degree of freedom is missing, or an element is no
        rectangle with sides along x and y.
    """
    return plate_elements(model, elements)


def linear(
    model: Nodes, elements: Int[np.ndarray, "element corner"], *, axes: tuple[int, ...] = (1, 2, 3)
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

    Raises
    ------
    ValueError
        If an index is out of range or a degree of freedom is missing.
    """
    return linear_elements(model, elements, axes)


def scikit_fem(
    basis: Any,
    *,
    axes: tuple[int, ...],
    origin: Float[np.ndarray, "3"] | None = None,
    directions: Float[np.ndarray, "3 local"] | None = None,
) -> Elements:
    """Shape functions of a scikit-fem basis as it stands; rows are its degrees of freedom.

    Any element with polynomial shape functions on cells mapped affinely: Lagrange elements,
    `ElementVector` of them, Morley, Argyris, Hermite and BFS elements.

    Parameters
    ----------
    basis
        A `skfem.CellBasis`.
    axes
        Axes of the components of the field: (3,) for the deflection of a plate, (1, 2, 3) for
        the displacement of a solid.
    origin
        Where the origin of the mesh lies in space [m]; by default at (0, 0, 0).
    directions
        Unit vectors along which the coordinates of the mesh lie, as columns; by default the
        first axes of space, so that the mesh of a plate lies at z = 0.

    Raises
    ------
    TypeError
        If something else than a `skfem.CellBasis` was given.
    ValueError
        If a cell is curved or not affine, a shape function is no polynomial, or the field has
        another number of components than `axes`.
    MissingExtraError
        If scikit-fem is not installed.
    """
    return basis_elements(basis, axes, origin, directions)


def scattered(model: Nodes, *, axes: tuple[int, ...] | None = None) -> Scattered:
    """Nodes without elements: moving least squares, smooth in position.

    Exact for fields that are linear in position. Nodes whose distance to each other is large
    against the wavelength of a mode smooth it out.

    Parameters
    ----------
    model
        Nodes and degrees of freedom, for example a `ModalModel` from a universal file.
    axes
        Axes along which the motion is read; nodes that lack one of them are not read. By
        default all translations that any node has.

    Raises
    ------
    ValueError
        If no node has all the axes, or all nodes lie at one place.
    """
    return scattered_nodes(model, axes)


def nearest(model: Nodes, *, axes: tuple[int, ...] | None = None) -> Nearest:
    """The nearest node in the place of the position, Eqs. (13) and (16) of the paper.

    Needs nothing but nodes; piecewise constant in position, so that it has no gradient.

    Parameters
    ----------
    model
        Nodes and degrees of freedom, for example a `ModalModel`.
    axes
        Axes along which the motion is read; nodes that lack one of them are not read. By
        default all translations that any node has.

    Raises
    ------
    ValueError
        If no node has all the axes.
    """
    return nearest_node(model, axes)
