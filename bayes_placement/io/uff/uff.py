"""uff: in, a universal file (datasets 15, 58, 58b, 164, 2411); out, a measurement; and back.

Not known here: structures, probability.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...experiment.measurement import Channel, Measurement, Position, derivative
from ._blocks import FUNCTION, Block, MeasurementFileError, load
from ._nodes import node_positions
from ._units import FileUnits, check_abscissa, file_units, quantity_of, scale
from ._write import write

__all__ = ["MeasurementFileError", "read", "write"]

_FRF, _COHERENCE = 4, 6
_Node = tuple[int, int]  # number and direction


class _Function(NamedTuple):
    """One FRF or coherence of the file, still by node."""

    place: str
    sensor: _Node
    actuator: _Node
    frequency: np.ndarray
    values: np.ndarray
    quantity: str
    notes: dict[str, Any]


def read(
    path: str | Path,
    *,
    names: Mapping[int, str] | None = None,
    require_positions: bool = True,
    averages: int | None = None,
    quantity: str | None = None,
) -> Measurement:
    """Read the FRFs of a universal file (UFF), ASCII or binary, into a measurement in SI.

    FRFs (dataset 58, function type 4) and their coherences (type 6) are read, nodes from dataset
    15 or 2411; all else is passed over, as are entity names. Values are in the units of their
    labels, else of dataset 164, else SI; coordinates in those of dataset 164, else metres.

    Parameters
    ----------
    path
        The file.
    names
        Name of the transducer by node number. Any other node is named as `write` recorded it (ID
        line 5), or else by its number: `1`.
    require_positions
        Whether a node without coordinates is an error.
    averages
        Number of averages, for which the format has no field: without this argument it is known
        only where ID line 4 records it, as `write` does.
    quantity
        `receptance`, `mobility` or `accelerance`, to which all FRFs are converted; needed where
        the file mixes them.

    Returns
    -------
    Measurement
        Channels in the order in which they first appear; pairs without FRF are NaN.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    MeasurementFileError
        (A ValueError.) If the file is malformed, or holds no single, unambiguous measurement.
    """
    blocks = load(Path(path))
    units = file_units(blocks)
    frfs = _frfs(blocks, units, Path(path))
    named = _names(frfs, names or {})
    positions = _positions(blocks, units, named, require_positions)
    return _assembled(blocks, frfs, named, positions, averages, quantity)


def _assembled(
    blocks: list[Block],
    frfs: list[_Function],
    named: dict[int, str],
    positions: dict[str, Position],
    averages: int | None,
    quantity: str | None,
) -> Measurement:
    _check_same_lines(frfs)
    quantity = quantity or _common_quantity(frfs)
    sensors = list(dict.fromkeys(frf.sensor for frf in frfs))
    actuators = list(dict.fromkeys(frf.actuator for frf in frfs))
    converted = [
        frf._replace(values=derivative(frf.values, frf.frequency, frf.quantity, quantity))
        for frf in frfs
    ]
    return Measurement.from_arrays(
        _arranged(converted, sensors, actuators),
        frfs[0].frequency,
        sensors=[Channel(named[node], direction) for node, direction in sensors],
        actuators=[Channel(named[node], direction) for node, direction in actuators],
        quantity=quantity,
        coherence=_coherence(blocks, frfs, sensors, actuators),
        averages=averages if averages is not None else _noted(frfs, "averages"),
        positions=positions,
        force_level=_noted(frfs, "force_level"),
    )


def _frfs(blocks: list[Block], units: FileUnits, path: Path) -> list[_Function]:
    functions = [block for block in blocks if block.dataset == FUNCTION]
    frfs = [block for block in functions if block.fields["func_type"] == _FRF]
    if not frfs:
        kinds = sorted({block.fields["func_type"] for block in functions})
        found = f"functions of type {kinds}" if kinds else "no function (dataset 58)"
        raise MeasurementFileError(
            f"{path} holds {found}; at least one FRF (dataset 58, function type 4) is needed, "
            "since a structure is updated by its FRFs. Export FRFs, not spectra or time histories."
        )
    return [_frf(block, units) for block in frfs]


def _frf(block: Block, units: FileUnits) -> _Function:
    if not np.iscomplexobj(block.fields["data"]):
        raise MeasurementFileError(
            f"{block.place} is an FRF of real numbers; complex ones (ordinate type 5 or 6) are "
            "needed, since the phase tells a resonance's sign and damping. Export real and "
            "imaginary part."
        )
    factor = scale(block, units)
    return _function(block, block.fields["data"] * factor, quantity_of(block))


def _function(block: Block, values: np.ndarray, quantity: str = "") -> _Function:
    check_abscissa(block)
    return _Function(
        place=block.place,
        sensor=_node(block, "rsp"),
        actuator=_node(block, "ref"),
        frequency=np.asarray(block.fields["x"], dtype=float),
        values=values,
        quantity=quantity,
        notes=_note(block, "id4") | _note(block, "id5"),
    )


def _node(block: Block, side: str) -> _Node:
    node, direction = block.fields[f"{side}_node"], block.fields[f"{side}_dir"]
    if abs(direction) > 3:
        raise MeasurementFileError(
            f"{block.place} has direction {direction} at node {node}, a rotation; a translation "
            "(+-1, +-2, +-3, or 0 where not stated) is needed, since FRFs here are motion in a "
            "direction per force. Leave rotations out of the export."
        )
    return int(node), int(direction)


def _note(block: Block, line: str) -> dict[str, Any]:
    """Read what `write` recorded in an ID line: a JSON object, and nothing but that."""
    text = block.fields[line].strip()
    try:
        note = json.loads(text) if text.startswith("{") else {}
    except json.JSONDecodeError:
        return {}  # a foreign ID line may say anything
    return note


def _noted(frfs: list[_Function], key: str) -> Any:
    found = {frf.notes.get(key): frf for frf in frfs}
    if len(found) > 1:
        raise MeasurementFileError(
            f"{list(found.values())[1].place} records {key}={list(found)[1]} and an earlier FRF "
            f"{key}={next(iter(found))}; one number is needed, since a measurement has one. Split "
            "the file by it."
        )
    return next(iter(found))


def _check_same_lines(functions: list[_Function]) -> None:
    first, *rest = functions
    for one in rest:
        same = one.frequency.shape == first.frequency.shape and np.allclose(
            one.frequency, first.frequency, rtol=1e-9, atol=0.0
        )
        if not same:
            raise MeasurementFileError(
                f"{one.place} has {_axis(one)} but {first.place} has {_axis(first)}; one frequency "
                "axis is needed for all, since a measurement has one. Export them on the same "
                "lines, or in files of their own."
            )


def _axis(function: _Function) -> str:
    low, high = function.frequency[[0, -1]]
    return f"{function.frequency.size} lines from {low:g} to {high:g} Hz"


def _common_quantity(frfs: list[_Function]) -> str:
    found = sorted({frf.quantity for frf in frfs})
    if len(found) > 1:
        raise MeasurementFileError(
            f"The file mixes {' and '.join(found)}; one quantity is needed, since a measurement "
            "has one. Say to which all are to be converted: "
            f"uff.read(path, quantity={found[0]!r})."
        )
    return found[0]


def _names(frfs: list[_Function], given: Mapping[int, str]) -> dict[int, str]:
    """Name every node of the FRFs: as given, else as recorded, else by its number."""
    recorded: dict[int, str] = {}
    for frf in frfs:
        nodes = (frf.sensor[0], frf.actuator[0])
        recorded |= dict(zip(nodes, frf.notes.get("names", map(str, nodes)), strict=True))
    named = {node: given.get(node, name) for node, name in recorded.items()}
    for node, name in named.items():
        others = [other for other in named if other < node and named[other] == name]
        if others:
            raise MeasurementFileError(
                f"Nodes {others[0]} and {node} would both be named {name!r}; each node needs a "
                f"name of its own, since it has its own position. Name both: names="
                f"{{{others[0]}: 's1', {node}: 's2'}}."
            )
    return named


def _arranged(
    functions: list[_Function], sensors: list[_Node], actuators: list[_Node]
) -> np.ndarray:
    """Put functions into an array of pairs, NaN where there is none."""
    lines = functions[0].frequency.size
    array = np.full((len(sensors), len(actuators), lines), np.nan, functions[0].values.dtype)
    filled: dict[tuple[_Node, _Node], str] = {}
    for one in functions:
        pair = one.sensor, one.actuator
        if pair in filled:
            raise MeasurementFileError(
                f"{one.place} and {filled[pair]} hold the same function for response node "
                f"{one.sensor[0]} (direction {one.sensor[1]}) and reference node {one.actuator[0]} "
                f"(direction {one.actuator[1]}); one for each pair is needed, since either could "
                "be meant. Delete one, or read repeated runs from files of their own."
            )
        filled[pair] = one.place
        array[sensors.index(one.sensor), actuators.index(one.actuator)] = one.values
    return array


def _coherence(
    blocks: list[Block], frfs: list[_Function], sensors: list[_Node], actuators: list[_Node]
) -> np.ndarray | None:
    pairs = {(frf.sensor, frf.actuator) for frf in frfs}
    every = [
        _function(block, np.real(block.fields["data"]))
        for block in blocks
        if block.dataset == FUNCTION and block.fields["func_type"] == _COHERENCE
    ]
    known = [one for one in every if (one.sensor, one.actuator) in pairs]
    if not known:
        return None
    _check_same_lines([frfs[0], *known])
    return _arranged(known, sensors, actuators)


def _positions(
    blocks: list[Block], units: FileUnits, named: dict[int, str], required: bool
) -> dict[str, Position]:
    """Coordinates [m] of the nodes of the FRFs, by name."""
    points = node_positions(blocks, units, named)
    missing = [node for node in named if node not in points]
    if missing and required:
        given = ", ".join(map(str, sorted(points))) or "none of its nodes"
        raise MeasurementFileError(
            f"FRFs refer to the nodes {', '.join(map(str, missing))} without coordinates; datasets "
            f"15 and 2411 place {given}. Recorded coordinates are needed, since the true "
            "places lie around them. Export the geometry with the FRFs, or state the places in "
            "the experiment: uff.read(path, require_positions=False)."
        )
    return {named[node]: point for node, point in points.items()}
