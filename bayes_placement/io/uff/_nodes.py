"""Coordinates of nodes from the datasets 15 and 2411 of a universal file."""

from collections.abc import Container

from ...positions.vectors import CartesianComponents
from ._datasets import NODES, Dataset, MeasurementFileError

_GLOBAL_SYSTEMS = (0, 1)  # writers use either number for the global Cartesian system


def node_positions(
    datasets: list[Dataset], wanted: Container[int]
) -> dict[int, CartesianComponents]:
    """Coordinates of the wanted nodes as far as the file states them, in its unit."""
    positions: dict[int, CartesianComponents] = {}
    for dataset in datasets:
        if dataset.number in NODES:
            positions |= _positions(dataset, wanted, positions)
    return positions


def _positions(
    dataset: Dataset,
    wanted: Container[int],
    earlier: dict[int, CartesianComponents],
) -> dict[int, CartesianComponents]:
    columns = [dataset.fields[key] for key in ("node_nums", "def_cs", "disp_cs", "x", "y", "z")]
    positions: dict[int, CartesianComponents] = {}
    for number, definition, displacement, *coordinates in zip(*columns, strict=True):
        node = int(number)
        if node not in wanted:
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
