"""Meshes of many formats, by meshio: nodes, elements and named sets of nodes."""

import contextlib
import io
import warnings
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from .._types import InputError, MissingExtraError
from ..modes.finite_elements.modal_model import ModalModel


@dataclass(frozen=True, eq=False)
class Mesh:
    """Nodes, elements and named sets of nodes.

    Parameters
    ----------
    node
        Number of each node.
    position
        Its coordinates [m].
    elements
        Nodes of each element, by meshio's name of its type: `line`, `quad`, `tetra` and so on.
    node_sets
        Nodes of each named set; for a set of elements, all nodes of its elements.
    """

    node: Int[np.ndarray, "node"]
    position: Float[np.ndarray, "node 3"]
    elements: dict[str, np.ndarray]
    node_sets: dict[str, np.ndarray]

    def numbered_as(self, model: ModalModel, *, tolerance: float = 1e-6) -> "Mesh":
        """Give each node the number that the node at the same position has in a model.

        Parameters
        ----------
        model
            The model whose numbers are wanted.
        tolerance
            Largest distance between the two positions, as a share of the size of the model.

        Raises
        ------
        ValueError
            If a node has no counterpart in the model.
        """
        from scipy.spatial import KDTree

        size = float(np.linalg.norm(np.ptp(model.position, axis=0)))
        distance, index = KDTree(model.position).query(self.position)
        if (distance > tolerance * size).any():
            worst = int(np.argmax(distance))
            raise InputError(
                f"Node {self.node[worst]} of the mesh at {self.position[worst]} m is "
                f"{distance[worst]:.3g} m from the nearest node of the model; the same positions "
                f"are needed (within {tolerance:g} of the size {size:.3g} m), since nodes are "
                "matched by position. Check the unit: mesh.read(path, length_unit=1e-3) for mm."
            )
        number = model.node[index]
        new = dict(zip(self.node.tolist(), number.tolist(), strict=True))
        return replace(
            self,
            node=number,
            elements={name: _renumbered(nodes, new) for name, nodes in self.elements.items()},
            node_sets={name: _renumbered(nodes, new) for name, nodes in self.node_sets.items()},
        )


def read(path: str | Path, *, length_unit: float = 1.0) -> Mesh:
    """Read a mesh by meshio: Abaqus, Gmsh, Nastran bulk data, VTK, MED and others.

    Nodes are numbered 1, 2, 3 and so on in the order of the file, since meshio does not keep the
    numbers of the file; `Mesh.numbered_as` takes those of a model. Sets are point sets,
    cell sets and the physical groups of Gmsh.

    Parameters
    ----------
    path
        The file; its suffix tells the format.
    length_unit
        What one unit of its coordinates is in metres: 1e-3 for mm.

    Raises
    ------
    MissingExtraError
        If meshio is not installed.
    FileNotFoundError
        If there is no such file.
    ValueError
        If meshio cannot read the file.

    Warns
    -----
    UserWarning
        If meshio left something out, such as the end of a truncated file.
    """
    content = _read_by_meshio(Path(path))
    position = np.zeros((len(content.points), 3))
    position[:, : content.points.shape[1]] = content.points * length_unit
    elements: dict[str, list[np.ndarray]] = {}
    for block in content.cells:
        elements.setdefault(block.type, []).append(_numbers(block.data))
    return Mesh(
        node=np.arange(1, len(position) + 1),
        position=position,
        elements={name: np.concatenate(blocks) for name, blocks in elements.items()},
        node_sets=_node_sets(content),
    )


def _read_by_meshio(path: Path) -> Any:
    try:
        import meshio
    except ImportError as error:
        raise MissingExtraError(
            f"{path} cannot be read, since meshio is not installed, which knows the formats of "
            'meshes. Install it: pip install "bayes_placement[mesh]".'
        ) from error
    if not path.is_file():
        raise FileNotFoundError(
            f"There is no file {path}; a mesh is needed. Check the folder: Path(...).resolve()."
        )
    complaints = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaints):  # where meshio reports what it cannot read
            content = meshio.read(path)
    except (Exception, SystemExit) as error:  # its readers raise any exception, or exit
        raise InputError(
            f"{path} cannot be read by meshio ({error or type(error).__name__}); a mesh in a "
            "format that it tells by the suffix is needed. Convert it, or give node numbers and "
            "coordinates as arrays."
        ) from error
    if complaints.getvalue().strip():
        warnings.warn(
            f"{path} was read, but meshio says: {' '.join(complaints.getvalue().split())} Check "
            "the "
            "number of nodes and elements, or convert the file.",
            stacklevel=3,
        )
    return content


def _node_sets(content: Any) -> dict[str, np.ndarray]:
    sets = {name: np.unique(_numbers(points)) for name, points in content.point_sets.items()}
    element_sets = {**_physical_groups(content), **content.cell_sets}
    for name, cells in element_sets.items():
        corners = [
            block.data[np.asarray(rows, dtype=int)].ravel()
            for block, rows in zip(content.cells, cells, strict=True)
            if rows is not None and len(rows)
        ]
        if corners and not name.startswith("gmsh:"):
            sets[name] = np.unique(_numbers(np.concatenate(corners)))
    return sets


def _physical_groups(content: Any) -> dict[str, list[np.ndarray]]:
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


def _numbers(points: np.ndarray) -> np.ndarray:
    return np.asarray(points, dtype=np.int64) + 1


def _renumbered(nodes: np.ndarray, new: dict[int, int]) -> np.ndarray:
    return np.vectorize(new.__getitem__, otypes=[np.int64])(nodes)
