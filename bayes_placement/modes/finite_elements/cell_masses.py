"""Mass of a finite element model in cells of neighbouring nodes: it varies from cell to cell.

Regions are made for stiffness, and few. What is forgotten of the mass sits at a point, and modes of
half-waves as long as a region feel where in it.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..._shared.errors import InputError
from .matrices import Matrices
from .modal_model import ModalModel

CELLS = 36
"""Most cells."""

ROUNDING = 1e-9
"""Distance of nodes that share their place, over the length of the model."""


def cell_masses(matrices: Matrices, model: ModalModel) -> Float[np.ndarray, "cell mode mode"]:
    """Mass of each cell over the modes; that of all cells is the mass of the model."""
    cell = _cells(matrices.position)[matrices.node_index]
    inertia = matrices.mass @ model.shape
    masses = []
    for number in np.unique(cell):
        rows = cell == number
        product = model.shape[rows].T @ inertia[rows]
        # What couples nodes of two cells belongs to both by halves.
        masses.append((product + product.T) / 2)
    return np.stack(masses)


def checked_cell_masses(
    masses: np.ndarray | None, count: int
) -> Float[np.ndarray, "cell mode mode"]:
    """Return masses of cells over so many modes; by default all is one cell."""
    if masses is None:
        return np.eye(count)[None]
    if np.ndim(masses) != 3 or np.shape(masses)[1:] != (count, count) or not len(masses):
        raise InputError(
            f"cell_masses of shape {np.shape(masses)} was given; [cell, {count}, {count}] is "
            "needed, since the mass of each cell is over the modes: "
            "np.stack([shape.T @ part @ shape for part in parts])."
        )
    return np.asarray(masses)


def _cells(position: Float[np.ndarray, "node 3"]) -> Int[np.ndarray, "node"]:
    """Cell of each node: the longest cell is halved, until there are enough.

    By its length, not by the number of nodes: a mesh may be finer somewhere.
    """
    cells = [_Cell.of(np.arange(len(position)), position)]
    least = ROUNDING * cells[0].length
    while len(cells) < min(CELLS, len(position)):
        longest = int(np.argmax([cell.length for cell in cells]))
        if cells[longest].length <= least:  # the nodes that are left share their places
            break
        cells[longest : longest + 1] = [_Cell.of(half, position) for half in cells[longest].halves]
    cell_of_node = np.empty(len(position), dtype=int)
    for number, cell in enumerate(cells):
        cell_of_node[np.concatenate(cell.halves)] = number
    return cell_of_node


class _Cell(NamedTuple):
    """Length of the longest side of the box about some nodes [m], and these beside its middle."""

    length: float
    halves: tuple[Int[np.ndarray, "below"], Int[np.ndarray, "beyond"]]

    @classmethod
    def of(cls, nodes: Int[np.ndarray, "node"], position: Float[np.ndarray, "all 3"]) -> "_Cell":
        """Return the cell of some nodes."""
        low, high = position[nodes].min(axis=0), position[nodes].max(axis=0)
        side = int(np.argmax(high - low))
        is_beyond = position[nodes, side] > (low + high)[side] / 2
        return cls(float(high[side] - low[side]), (nodes[~is_beyond], nodes[is_beyond]))
