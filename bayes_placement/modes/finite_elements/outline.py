"""Lines of a mesh, or its nodes, to draw a structure by."""

import itertools

import numpy as np

from ...positions.vectors import PointsInSpace
from ..modes import Modes
from .interpolation import Elements, Nearest, Scattered, reference_corners
from .nodal_modes import nodal_of

MOST_LINES = 20_000
"""Largest number of lines of a mesh; of a larger mesh, every n-th line is taken."""


def outline(modes: Modes) -> tuple[PointsInSpace, str]:
    """Lines of the mesh, separated by NaN, or nodes; and the format string to draw them."""
    nodal = nodal_of(modes)
    mesh = None if nodal is None else nodal.interpolation
    if isinstance(mesh, Nearest | Scattered):
        return np.asarray(mesh.centre), "."
    if isinstance(mesh, Elements):
        corners = reference_corners(mesh.edges.shape[2], mesh.simplex)
        return _lines(np.asarray(mesh.origin), np.asarray(mesh.edges), corners, mesh.simplex), "-"
    low, high = np.array(modes.bounds())
    box = reference_corners(3, simplex=False)
    return _lines(low[None], np.diag(high - low)[None], box, simplex=False), "-"


def _lines(
    origin: np.ndarray, edges: np.ndarray, corners: np.ndarray, simplex: bool
) -> PointsInSpace:
    """Edges of cells: of a simplex between all corners, else between neighbouring corners."""
    pairs = [
        pair
        for pair in itertools.combinations(range(len(corners)), 2)
        if simplex or np.abs(corners[pair[0]] - corners[pair[1]]).sum() == 1
    ]
    place = origin[:, None] + corners @ edges.mT
    ends = place[:, np.array(pairs)].reshape(-1, 2, 3)
    ends = ends[:: -(-len(ends) // MOST_LINES)]
    gaps = np.full((len(ends), 1, 3), np.nan)
    return np.concatenate([ends, gaps], axis=1).reshape(-1, 3)
