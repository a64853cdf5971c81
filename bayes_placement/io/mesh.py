"""Meshes of many formats, by meshio: nodes, elements and named sets of nodes."""

import importlib.util
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from .._types import InputError, MissingExtraError, arguments_checked, check_positive, warn
from ..modes.finite_elements.modal_model import ModalModel
from ..positions.reprs import with_short_repr
from . import _reader_process
from ._gate import check_plausible, existing, reading

_READER = Path(__file__).with_name("_mesh_process.py")
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

    Examples
    --------
    >>> mesh = bp.io.mesh.read("part.msh", length_unit=1e-3)  # doctest: +SKIP
    """
    check_positive("length_unit", length_unit, "mesh.read(path, length_unit=1e-3)")
    file = Path(path)
    if importlib.util.find_spec("meshio") is None:
        raise MissingExtraError(
            f"{path} cannot be read, since meshio is not installed, which knows the formats of "
            'meshes. Install it: pip install "bayes_placement[mesh]".'
        )
    with reading(file, "a mesh", _REMEDY):
        _check_end(existing(file, "a mesh"))
        content = _contents_of(file)
        mesh = _mesh(file, content, length_unit)
    if content.complaints:
        warn(
            f"{path} was read, but meshio says: {content.complaints} Check the number of nodes "
            "and elements, or convert the file."
        )
    return mesh


def _check_end(path: Path) -> None:
    """Refuse a file without the line at which meshio would stop: it would read for ever."""
    last = _LAST_LINES.get(path.suffix.lower())
    if last is None:
        return
    with path.open("rb") as file:
        if not any(line.split()[:1] == [last] for line in file):
            raise _refused(path, f"it has no line {last.decode()}")


class _Contents(NamedTuple):
    """What meshio read: points, elements by type, named sets of nodes from 0, its complaints."""

    points: np.ndarray
    elements: dict[str, np.ndarray]
    node_sets: dict[str, np.ndarray]
    complaints: str


def _contents_of(path: Path) -> _Contents:
    """Run meshio in a separate process, whose time and memory are limited."""
    result = _reader_process.run(_READER, path, "a mesh", lambda reason: _refused(path, reason))
    return _Contents(
        result.arrays["points"],
        _of_kind("elements ", result.arrays),
        _of_kind("set ", result.arrays),
        result.complaints,
    )


def _of_kind(kind: str, arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {
        name.removeprefix(kind): values for name, values in arrays.items() if name.startswith(kind)
    }


def _mesh(path: Path, content: _Contents, length_unit: float) -> Mesh:
    count = len(content.points)
    if not count:
        raise _refused(path, "it holds no node")
    position = np.zeros((count, 3))
    position[:, : content.points.shape[1]] = content.points * length_unit
    check_plausible(path, coordinates=position)
    for name, nodes in (*content.elements.items(), *content.node_sets.items()):
        if nodes.size and not (nodes.min() >= 0 and nodes.max() < count):
            raise _refused(path, f"{name} has a node that is not among its {count}")
    return Mesh(
        node=np.arange(1, count + 1),
        position=position,
        elements={name: _numbers(nodes) for name, nodes in content.elements.items()},
        node_sets={name: _numbers(nodes) for name, nodes in content.node_sets.items()},
    )


def _refused(path: Path, reason: str) -> InputError:
    return InputError(
        f"{path} cannot be read by meshio ({reason}); a mesh in a format that it tells by the "
        f"suffix is needed. {_REMEDY}"
    )


def _numbers(points: np.ndarray) -> np.ndarray:
    return np.asarray(points, dtype=np.int64) + 1


def _renumbered(nodes: np.ndarray, new: dict[int, int]) -> np.ndarray:
    return np.vectorize(new.__getitem__, otypes=[np.int64])(nodes)
