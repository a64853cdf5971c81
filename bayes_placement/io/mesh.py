"""Meshes: universal files, CalculiX, and by meshio many formats: nodes, elements, node sets."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from .._shared.arguments import arguments_checked, check_positive
from .._shared.errors import InputError, warn
from .._shared.reprs import with_short_repr
from ..modes.finite_elements.modal_model import ModalModel
from . import _calculix, _reader_process
from . import _contents as content
from ._gate import UnreadableError, check_plausible, existing, reading
from ._mesh_contents import MeshContents
from .uff._mesh import load_mesh

_REMEDY = "Convert it, or give node numbers and coordinates as arrays."
_LAST_LINES = {".ply": b"end_header", **dict.fromkeys((".bdf", ".fem", ".nas"), b"ENDDATA")}


@with_short_repr
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

    Examples
    --------
    >>> mesh = bp.io.mesh.Mesh(np.array([1, 2]), np.eye(3)[:2], {"line": np.array([[1, 2]])}, {})
    >>> mesh.elements["line"]
    array([[1, 2]])
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


@arguments_checked
def read(path: str | Path, *, length_unit: float | int | None = None) -> Mesh:
    """Read a mesh: universal files, CalculiX (.frd), and by meshio Abaqus, Gmsh, Nastran, VTK, MED.

    Universal files (nodes of dataset 15 or 2411, elements of 2412) and CalculiX keep the numbers of
    their nodes. Otherwise nodes are numbered 1, 2, 3 and so on in the order of the file, since
    meshio does not keep its numbers; `Mesh.numbered_as` takes those of a model. Sets are point
    sets, cell sets and the physical groups of Gmsh.

    Parameters
    ----------
    path
        The file; its first bytes or its suffix tell the format.
    length_unit
        What one unit of its coordinates is in metres: 1e-3 for mm; by default 1, or what a
        universal file states.

    Raises
    ------
    MissingExtraError
        If meshio is not installed, or what it needs for a format.
    FileNotFoundError
        If there is no such file.
    ValueError
        If meshio cannot read the file.

    Warns
    -----
    UserWarning
        If meshio left something out, such as the end of a truncated file.

    Examples
    --------
    >>> mesh = bp.io.mesh.read("part.msh", length_unit=1e-3)  # doctest: +SKIP
    """
    if length_unit is not None:
        check_positive("length_unit", length_unit, "mesh.read(path, length_unit=1e-3)")
    file = existing(Path(path), "a mesh")
    with reading(file, "a mesh", _REMEDY):
        kind = content.content_of(file)
        if kind == content.UNIVERSAL:
            contents = load_mesh(file, length_unit)
        else:
            contents = _calculix.load(file) if kind == content.CALCULIX else _by_meshio(file)
            contents = contents._replace(points=contents.points * (length_unit or 1.0))
        mesh = _mesh(file, contents)
    if contents.complaints:
        warn(
            f"{path} was read, but its reader says: {contents.complaints} Check the number of "
            "nodes and elements, or convert the file."
        )
    return mesh


def _by_meshio(path: Path) -> MeshContents:
    """Run meshio in a separate process, whose time and memory are limited."""
    _check_end(path)
    result = _reader_process.run_library(path, _reader_process.ReaderLibrary("meshio", "mesh"))
    return MeshContents(
        None,
        result.arrays["points"],
        _of_kind("elements ", result.arrays),
        _of_kind("set ", result.arrays),
        f"meshio says: {result.complaints}" if result.complaints else "",
    )


def _check_end(path: Path) -> None:
    """Refuse a file without the line at which meshio would stop: it would read for ever."""
    last = _LAST_LINES.get(path.suffix.lower())
    if last is None:
        return
    with path.open("rb") as file:
        if not any(line.split()[:1] == [last] for line in file):
            raise UnreadableError(f"it has no line {last.decode()}")


def _of_kind(kind: str, arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {
        name.removeprefix(kind): values for name, values in arrays.items() if name.startswith(kind)
    }


def _mesh(path: Path, contents: MeshContents) -> Mesh:
    count = len(contents.points)
    if not count:
        raise UnreadableError("it holds no node")
    position = np.zeros((count, 3))
    position[:, : contents.points.shape[1]] = contents.points
    check_plausible(path, coordinates=position)
    for name, nodes in (*contents.elements.items(), *contents.node_sets.items()):
        if nodes.size and not (nodes.min() >= 0 and nodes.max() < count):
            raise UnreadableError(f"{name} has a node that is not among its {count}")
    node = np.arange(1, count + 1) if contents.node is None else contents.node
    return Mesh(
        node=node,
        position=position,
        elements={name: node[nodes] for name, nodes in contents.elements.items()},
        node_sets={name: node[nodes] for name, nodes in contents.node_sets.items()},
    )


def _renumbered(nodes: np.ndarray, new: dict[int, int]) -> np.ndarray:
    return np.vectorize(new.__getitem__, otypes=[np.int64])(nodes)
