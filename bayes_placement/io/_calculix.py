"""Meshes of CalculiX results (.frd) as text: blocks 2C (nodes) and 3C (elements).

Wittig, CalculiX GraphiX user's manual, section "Result Format".
"""

from collections.abc import Iterable, Iterator
from pathlib import Path

from .._shared.errors import InputError
from ._contents import decoded
from ._mesh_contents import MeshContents, of_numbers, strict_integer
from .uff._decode import NUMBER, columns, real

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


def load(path: Path) -> MeshContents:
    """Read nodes and elements; results are left out."""
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
