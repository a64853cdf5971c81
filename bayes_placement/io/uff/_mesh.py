"""Contents of meshes, and those of universal files: nodes (15, 2411), elements (2412)."""

from collections.abc import Container, Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..._shared.errors import InputError
from ...positions.vectors import CartesianComponents
from ._datasets import NODES, UNITS, Dataset, MeasurementFileError, blocks_of, load
from ._units import file_units, of_nodes


class MeshContents(NamedTuple):
    """Nodes and elements of a file, in its unit.

    Numbers of nodes are None where they are counted from 1. Elements, by meshio's name of a type,
    and node sets hold rows of nodes, from 0. `complaints` says what was left out.
    """

    node: np.ndarray | None
    points: np.ndarray
    elements: dict[str, np.ndarray]
    node_sets: dict[str, np.ndarray]
    complaints: str = ""


def of_numbers(
    node: object, points: object, elements: Iterable[tuple[str, list[int]]], skipped: Iterable[str]
) -> MeshContents:
    """Make contents of elements that name nodes by number; skipped kinds are told."""
    numbers = np.array(node, dtype=np.int64)
    row = {number: place for place, number in enumerate(numbers.tolist())}
    if len(row) < len(numbers):
        raise InputError("a node occurs twice, and either could be meant; export it again.")
    by_type: dict[str, list[list[int]]] = {}
    for kind, corners in elements:
        unknown = [number for number in corners if number not in row]
        if unknown:
            raise InputError(
                f"an element names node {unknown[0]}, which is not there; all nodes are needed, "
                "since elements lie between them. Export nodes and elements together."
            )
        by_type.setdefault(kind, []).append([row[number] for number in corners])
    kinds = ", ".join(dict.fromkeys(skipped))
    return MeshContents(
        numbers,
        np.reshape(np.array(points, dtype=float), (-1, 3)),
        {kind: np.array(rows) for kind, rows in by_type.items()},
        {},
        f"elements of {kinds} are left out." if kinds else "",
    )


def strict_integer(text: str) -> int:
    """Return a whole number of digits alone."""
    plain = text.strip()
    if not plain.removeprefix("-").isdecimal() or not plain.isascii():
        raise InputError(f"{plain!r} stands where a whole number is needed; export it again.")
    return int(plain)


_GLOBAL_SYSTEMS = (0, 1)  # writers use either number for the global Cartesian system


def node_positions(
    datasets: list[Dataset], wanted: Container[int] | None = None
) -> dict[int, CartesianComponents]:
    """Coordinates of the wanted nodes, or of all, as far as the file states them, in its unit."""
    positions: dict[int, CartesianComponents] = {}
    for dataset in datasets:
        if dataset.number in NODES:
            positions |= _positions(dataset, wanted, positions)
    return positions


def _positions(
    dataset: Dataset,
    wanted: Container[int] | None,
    earlier: dict[int, CartesianComponents],
) -> dict[int, CartesianComponents]:
    columns = [dataset.fields[key] for key in ("node_nums", "def_cs", "disp_cs", "x", "y", "z")]
    positions: dict[int, CartesianComponents] = {}
    for number, definition, displacement, *coordinates in zip(*columns, strict=True):
        node = int(number)
        if wanted is not None and node not in wanted:
            continue
        _check_global(dataset, node, definition, displacement)
        x, y, z = map(float, coordinates)
        if positions.get(node, earlier.get(node, (x, y, z))) != (x, y, z):
            raise MeasurementFileError(
                f"{dataset.place} gives node {node} other coordinates than before; one position is "
                "needed for each node, since either could be meant. Delete the wrong one."
            )
        positions[node] = x, y, z
    return positions


def _check_global(dataset: Dataset, node: int, definition: int, displacement: int) -> None:
    for system in (definition, displacement):
        if system not in _GLOBAL_SYSTEMS:
            raise MeasurementFileError(
                f"{dataset.place} gives node {node} in the local coordinate system {system}; the "
                "global Cartesian one (0 or 1) is needed, since directions and coordinates of all "
                "nodes are compared. Export the geometry in global coordinates."
            )


ELEMENTS = 2412
_BEAMS = (11, 21, 22, 23, 24, 31, 32)
_CORNERS_FIRST = {
    "line3": (0, 2, 1),
    "triangle6": (0, 2, 4, 1, 3, 5),
    "quad8": (0, 2, 4, 6, 1, 3, 5, 7),
    "tetra10": (0, 2, 4, 9, 1, 3, 5, 6, 7, 8),
    "wedge15": (0, 2, 4, 9, 11, 13, 1, 3, 5, 10, 12, 14, 6, 7, 8),
    "hexahedron20": (0, 2, 4, 6, 12, 14, 16, 18, 1, 3, 5, 7, 13, 15, 17, 19, 8, 9, 10, 11),
}
"""Places of nodes in the file, which goes around the faces, in the order of meshio."""

_SOLIDS = {4: "tetra", 6: "wedge", 8: "hexahedron", 10: "tetra10", 15: "wedge15"}
_FAMILIES = (
    (_BEAMS, {2: "line", 3: "line3"}),
    (range(41, 100), {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8"}),
    (range(101, 119), _SOLIDS | {20: "hexahedron20"}),
)
"""Descriptors, and names of types by the number of their nodes; none of springs and masses."""


def load_mesh(path: Path, length_unit: float | int | None) -> MeshContents:
    """Read nodes and elements in metres, with the numbers of the file."""
    datasets = load(path, UNITS)
    positions = node_positions(datasets)
    if not positions:
        raise MeasurementFileError(
            f"{path} holds no nodes (dataset 15 or 2411); those of the mesh are needed. Export the "
            "geometry."
        )
    points = np.array([*positions.values()])
    length = of_nodes(path, file_units(datasets), points, length_unit=length_unit).length
    blocks = [block for block in blocks_of(path) if block.number == ELEMENTS]
    elements = [element for block in blocks for element in _elements(block.lines)]
    kept = [(kind, _corners_first(kind, nodes)) for _, kind, nodes in elements if kind]
    skipped = [f"FE descriptor {number}" for number, kind, _ in elements if not kind]
    return of_numbers([*positions], length * points, kept, skipped)


def _elements(lines: list[str]) -> Iterator[tuple[int, str, list[int]]]:
    """Descriptor, type (empty where none is known) and nodes of each element.

    It is a line of six numbers, for beams one of their orientation, then the nodes.
    """
    rows = iter([line.split() for line in lines if line.strip()])
    for row in rows:
        if len(row) != 6:
            raise InputError(f"an element begins with {' '.join(row)!r}; six numbers are needed.")
        _, descriptor, _, _, _, count = map(strict_integer, row)
        if descriptor in _BEAMS:
            next(rows, [])
        nodes: list[int] = []
        while len(nodes) < count and (further := next(rows, [])):
            nodes += map(strict_integer, further)
        if len(nodes) != count or not count:
            raise InputError(f"an element has {len(nodes)} nodes where {count} are announced.")
        types = next((types for known, types in _FAMILIES if descriptor in known), {})
        yield descriptor, types.get(count, ""), nodes


def _corners_first(kind: str, nodes: list[int]) -> list[int]:
    return [nodes[place] for place in _CORNERS_FIRST.get(kind, range(len(nodes)))]
