"""_nodes: in, the datasets 15 and 2411 of a universal file; out, nodes with coordinates [m].

Not known here: what the nodes carry.
"""

from collections.abc import Container

from ._blocks import NODES, Block, MeasurementFileError
from ._units import FileUnits

Point = tuple[float, float, float]

_GLOBAL_SYSTEMS = (0, 1)  # both number the global Cartesian system in the wild


def node_positions(
    blocks: list[Block], units: FileUnits, wanted: Container[int]
) -> dict[int, Point]:
    """Coordinates [m] of those nodes among the wanted ones that the file places.

    Raises
    ------
    MeasurementFileError
        If one of them stands in a local system, or has two places.
    """
    points: dict[int, Point] = {}
    for block in blocks:
        if block.dataset in NODES:
            points |= _points(block, units, wanted, points)
    return points


def _points(
    block: Block, units: FileUnits, wanted: Container[int], earlier: dict[int, Point]
) -> dict[int, Point]:
    columns = [block.fields[key] for key in ("node_nums", "def_cs", "disp_cs", "x", "y", "z")]
    points: dict[int, Point] = {}
    for number, definition, displacement, *point in zip(*columns, strict=True):
        node = int(number)
        if node not in wanted:
            continue
        _check_global(block, node, definition, displacement)
        x, y, z = (float(value) * units.length for value in point)
        if points.get(node, earlier.get(node, (x, y, z))) != (x, y, z):
            raise MeasurementFileError(
                f"{block.place} gives node {node} other coordinates than before; one place is "
                "needed for each node, since either could be meant. Delete the wrong one."
            )
        points[node] = x, y, z
    return points


def _check_global(block: Block, node: int, definition: float, displacement: float) -> None:
    for system in (definition, displacement):
        if system not in _GLOBAL_SYSTEMS:
            raise MeasurementFileError(
                f"{block.place} gives node {node} in the local coordinate system {system:g}; the "
                "global Cartesian one (0 or 1) is needed, since directions and coordinates of all "
                "nodes are compared. Export the geometry in global coordinates."
            )
