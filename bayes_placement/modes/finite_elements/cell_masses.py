"""Mass of a finite element model in cells of neighbouring nodes: it varies from cell to cell.

Regions are made for stiffness, and few. What is forgotten of the mass sits at a point, and modes of
half-waves as long as a region feel where in it.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ..._types import InputError
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
    least = ROUNDING * cells[0].length()
    while len(cells) < min(CELLS, len(position)):
        longest = int(np.argmax([cell.length() for cell in cells]))
        if cells[longest].length() <= least:  # the nodes that are left share their places
            break
        cells[longest : longest + 1] = cells[longest].halves(position)
    cell_of_node = np.empty(len(position), dtype=int)
    for number, cell in enumerate(cells):
        cell_of_node[cell.nodes] = number
    return cell_of_node


class _Cell(NamedTuple):
    """Nodes, and the ends of the box about them [m]."""

    nodes: Int[np.ndarray, "node"]
    low: Float[np.ndarray, "3"]
    high: Float[np.ndarray, "3"]

    @classmethod
    def of(cls, nodes: Int[np.ndarray, "node"], position: Float[np.ndarray, "all 3"]) -> "_Cell":
        """Return the cell of some nodes."""
        places = position[nodes]
        return cls(nodes, places.min(axis=0), places.max(axis=0))

    def length(self) -> float:
        """Length of the longest side [m]."""
        return float(np.max(self.high - self.low))

    def halves(self, position: Float[np.ndarray, "all 3"]) -> list["_Cell"]:
        """Return the cells on either side of the middle of the longest side."""
        side = int(np.argmax(self.high - self.low))
        is_beyond = position[self.nodes, side] > (self.low + self.high)[side] / 2
        return [self.of(self.nodes[half], position) for half in (~is_beyond, is_beyond)]
