"""What readers of meshes return: numbered nodes, elements by type, named sets of nodes."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from .._shared.errors import InputError


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
