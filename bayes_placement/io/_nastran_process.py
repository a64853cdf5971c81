"""Reads files of Nastran by pyyeti, in a separate process: see `_child.py`."""

import warnings

import numpy as np
import pandas as pd
import scipy.sparse
from pyyeti.nastran import n2p, op2, op4

SHAPE_TABLES = ("oug", "bophig")


def read(path: str, names: list[str]) -> tuple[dict[str, np.ndarray], dict[str, object]]:
    """Entries of matrices by their names, or nodes and modes where none is named."""
    return _matrices(path, names) if names else _modes(path)


def _matrices(path: str, names: list[str]) -> tuple[dict[str, np.ndarray], dict[str, object]]:
    """Entries of matrices, and the names of all in the file."""
    in_file = op4.dir(path, verbose=False)[0]
    content = op4.read(path, names, sparse=(True, scipy.sparse.coo_array))
    arrays: dict[str, np.ndarray] = {}
    for name, matrix in content.items():
        arrays |= {f"{name} row": matrix.row, f"{name} column": matrix.col}
        arrays |= {f"{name} value": matrix.data, f"{name} size": np.array(matrix.shape)}
    return arrays, {"in file": in_file}


def _modes(path: str) -> tuple[dict[str, np.ndarray], dict[str, object]]:
    """Nodes and eigenvectors in the basic system, and the table of eigenvalues."""
    warnings.filterwarnings("error", message="(?s).*garbled")
    with op2.OP2(path) as file:
        content = file.rdparampost(get_mats=False, get_ougs=True, get_dr_tables=False)
    shapes = [key for key in content if key.startswith(SHAPE_TABLES) and content[key] is not None]
    found = {"eigenvectors": shapes, "nodes": "uset" in content, "unplaced": []}
    if len(shapes) != 1 or not found["nodes"]:
        return {}, found
    node, motion, frequency = _eigenvectors(content[shapes[0]])
    known = content["uset"].index.get_level_values("id")
    found["unplaced"] = node[~np.isin(node, known)].tolist()
    if found["unplaced"]:
        return {}, found
    position, rotation = grids(content["uset"], node)
    motion[:, :3] = rotated(motion[:, :3], rotation)
    motion[:, 3:] = rotated(motion[:, 3:], rotation)
    arrays = {"node": node, "position": position, "shape": motion, "frequency": frequency}
    lama = [content[key] for key in content if key.startswith("lama")]
    return arrays | ({"eigenvalues": lama[-1]} if lama else {}), found


def _eigenvectors(table: pd.DataFrame) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers of the grid points, their motion in their own systems, and frequencies [Hz]."""
    grid = table.index.get_level_values("DOF").to_numpy() > 0  # scalar points have no direction
    number = table.index.get_level_values("Node").to_numpy()[grid][::6].astype(np.int64)
    motion = table.to_numpy()[grid].reshape(number.size, 6, -1)
    return number, motion, table.columns.get_level_values(1).to_numpy().astype(float)


def grids(uset: pd.DataFrame, number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions in the basic system, and the rotation of motion into that system."""
    points = uset[uset.index.get_level_values("dof") > 0]
    points = points[points.index.get_level_values("id").isin(number)]
    points = points.assign(nasset=n2p.mkusetmask("b"))  # pyyeti gives zeros for some other sets
    known = points.index.get_level_values("id").to_numpy()[::6]
    row = np.argsort(known)[np.searchsorted(np.sort(known), number)]
    table = points[["x", "y", "z"]].to_numpy().reshape(-1, 6, 3)
    rotation = np.broadcast_to(np.eye(3), (known.size, 3, 3))
    if table[:, 1, 0].any():  # a displacement system is not the basic system
        rotation = n2p.rbgeom_uset(points)[:, :3].reshape(-1, 6, 3)[:, :3]
    return table[row, 0], rotation[row]


def rotated(motion: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Motion [node, axis, mode] turned by the rotation of each node."""
    return np.einsum("nji,njm->nim", rotation.astype(motion.dtype), motion)
