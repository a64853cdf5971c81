"""A process of its own that reads a mesh by meshio: `python _mesh_process.py MESH RESULT.npz`.

Damaged meshes make some of meshio's readers run for ever, exit or take all memory. Nothing of this
package is imported here.
"""

import json
import sys
import warnings

import meshio
import numpy as np

MEMORY_BYTES = 8 << 30


def main(path: str, result: str) -> None:
    """Write what a mesh holds as arrays, and the names of its elements and sets as JSON."""
    _limit_memory()
    warnings.simplefilter("ignore")  # of other libraries; meshio prints its own complaints
    content = meshio.read(path)
    elements: dict[str, list[np.ndarray]] = {}
    for block in content.cells:
        elements.setdefault(block.type, []).append(np.asarray(block.data, dtype=np.int64))
    kinds = {
        "elements": {name: np.concatenate(blocks) for name, blocks in elements.items()},
        "set": _node_sets(content),
    }
    arrays = {
        f"{kind} {number}": values
        for kind, named in kinds.items()
        for number, values in enumerate(named.values())
    }
    names = json.dumps({kind: list(named) for kind, named in kinds.items()})
    arrays |= {"names": np.array(names), "points": np.asarray(content.points, dtype=float)}
    np.savez(result, **arrays)  # type: ignore[arg-type]


def _limit_memory() -> None:
    try:
        import resource
    except ImportError:  # not on this system
        return
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    wanted = MEMORY_BYTES if most == resource.RLIM_INFINITY else min(MEMORY_BYTES, most)
    resource.setrlimit(resource.RLIMIT_AS, (wanted, most))


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


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except (Exception, SystemExit) as error:  # noqa: BLE001, readers of meshio raise any exception
        sys.exit(f"{type(error).__name__}: {error}")
