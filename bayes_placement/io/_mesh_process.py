"""Reads a mesh by meshio, in a separate process: see `_child.py`."""

import meshio
import numpy as np


def read(path: str) -> tuple[dict[str, np.ndarray], dict[str, object]]:
    """Points, elements and sets of a mesh as arrays `KIND NAME`."""
    content = meshio.read(path)
    elements: dict[str, list[np.ndarray]] = {}
    for block in content.cells:
        elements.setdefault(block.type, []).append(np.asarray(block.data, dtype=np.int64))
    corners = {f"elements {name}": np.concatenate(blocks) for name, blocks in elements.items()}
    sets = {f"set {name}": nodes for name, nodes in _node_sets(content).items()}
    return {"points": np.asarray(content.points, dtype=float), **corners, **sets}, {}


def _node_sets(content: meshio.Mesh) -> dict[str, np.ndarray]:
    """Nodes, from 0, of each named set; of a set of elements all of their nodes."""
    sets = {
        name: np.unique(np.asarray(points, dtype=np.int64))
        for name, points in content.point_sets.items()
    }
    element_sets = {**_physical_groups(content), **content.cell_sets}
    for name, cells in element_sets.items():
        corners = [
            block.data[np.asarray(rows, dtype=int)].ravel()
            for block, rows in zip(content.cells, cells, strict=True)
            if rows is not None and len(rows)
        ]
        if corners and not name.startswith("gmsh:"):
            sets[name] = np.unique(np.concatenate(corners)).astype(np.int64)
    return sets


def _physical_groups(content: meshio.Mesh) -> dict[str, list[np.ndarray]]:
    """Elements of each physical group of Gmsh, which meshio gives as tags."""
    tags = content.cell_data.get("gmsh:physical")
    if tags is None:
        return {}
    return {
        name: [
            np.flatnonzero(tag == group) if block.dim == dimension else np.zeros(0, dtype=int)
            for block, tag in zip(content.cells, tags, strict=True)
        ]
        for name, (group, dimension) in content.field_data.items()
    }
