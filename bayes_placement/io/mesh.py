"""Meshes: universal files, CalculiX, and by meshio many formats: nodes, elements, node sets."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from .._shared.arguments import arguments_checked, check_positive
from .._shared.errors import InputError, warn
from .._shared.reprs import with_short_repr
from ..modes.finite_elements.modal_model import ModalModel
from . import _contents as content
from ._contents import decoded
from ._gate import UnreadableError, check_plausible, existing, reading
from ._reader_process import run_library
from .uff._decode import NUMBER, columns, real
from .uff._mesh import MeshContents, load_mesh, of_numbers, strict_integer

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
            contents = _calculix(file) if kind == content.CALCULIX else _by_meshio(file)
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
    result = run_library(path, "mesh")
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


_TYPES = {
    1: ("hexahedron", range(8)),
    2: ("wedge", range(6)),
    3: ("tetra", range(4)),
    4: ("hexahedron20", (*range(12), *range(16, 20), *range(12, 16))),
    5: ("wedge15", (*range(9), *range(12, 15), *range(9, 12))),
    6: ("tetra10", range(10)),
    7: ("triangle", range(3)),
    8: ("triangle6", range(6)),
    9: ("quad", range(4)),
    10: ("quad8", range(8)),
    11: ("line", range(2)),
    12: ("line3", range(3)),
}
"""Name of a type, and the places of its nodes in the file in the order of meshio."""

_FORMAT, _SHORT, _LONG = 73, "0", "1"
_WIDTHS = {_SHORT: 5, _LONG: 10}


def _calculix(path: Path) -> MeshContents:
    """Read nodes (blocks 2C) and elements (3C) of results as text (.frd), without the results.

    Wittig, CalculiX GraphiX user's manual, section "Result Format".
    """
    lines = decoded(path.read_bytes()).splitlines()
    node, points = [], []
    for width, line in _records(lines, "2C"):
        _, number, *coordinates = columns(line.ljust(60), (3, width, 12, 12, 12))
        if not all(map(NUMBER.fullmatch, coordinates)):
            raise InputError(f"{line!r} holds no three coordinates; export it again.")
        node.append(strict_integer(number))
        points.append([real(text) for text in coordinates])
    return of_numbers(node, points, _elements(lines), ())


def _elements(lines: list[str]) -> Iterator[tuple[str, list[int]]]:
    """Type and nodes of each element: a line with the key -1, then those with -2."""
    kind, corners = 0, list[int]()
    for width, line in [*_records(lines, "3C"), (_WIDTHS[_LONG], " -1")]:
        if line[:3].strip() == "-1":
            if kind:
                yield _arranged(kind, corners)
            kind, corners = strict_integer(line[3 + width : 8 + width] or "0"), []
        else:
            row = line[3:].rstrip()
            texts = columns(row, (width,) * -(-len(row) // width))
            corners += [strict_integer(text) for text in texts]


def _arranged(kind: int, corners: list[int]) -> tuple[str, list[int]]:
    if kind not in _TYPES or len(_TYPES[kind][1]) != len(corners):
        raise InputError(f"an element of type {kind} has {len(corners)} nodes; export it again.")
    name, places = _TYPES[kind]
    return name, [corners[place] for place in places]


def _records(lines: Iterable[str], block: str) -> Iterator[tuple[int, str]]:
    """Lines of all blocks of a kind, with the width of their numbers."""
    width = 0
    for line in lines:
        if line[:6].strip() == block:
            form = line[_FORMAT : _FORMAT + 1].strip() or _SHORT
            if form not in _WIDTHS:
                raise InputError(
                    f"its block {block} is in format {form}; text (0 or 1) is needed, since that "
                    "is read. Write it as text: *NODE FILE, not *NODE OUTPUT in binary."
                )
            width = _WIDTHS[form]
        elif width and line[:3].strip() == "-3":
            width = 0
        elif width:
            if line[:3] not in (" -1", " -2"):
                raise InputError(f"{line[:40]!r} stands in its block {block}; export it again.")
            yield width, line
    if width:
        raise InputError(f"its block {block} has no end (-3); copy or export it again.")
