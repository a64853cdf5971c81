"""FRFs of a universal file (datasets 15, 58, 58b, 164, 2411) as a measurement in SI."""

from collections.abc import Collection, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..._shared.arguments import arguments_checked, check_kind
from ...experiment.measurement import Channel, Measurement, Position
from ...experiment.quantities import converted, frf_name
from .._gate import check_plausible, path_of, reading, usable_lines
from ._datasets import FUNCTION, VARIANCE_NOTE, Dataset, MeasurementFileError, described, load
from ._datasets import left_out as _datasets_left_out
from ._functions import Function, Node, entity, names_of_nodes
from ._mesh import node_positions
from ._units import FileUnits, check_abscissa, file_units, of_nodes, quantity_of, scale
from ._write import note_of

_GENERAL, _FRF, _COHERENCE = 0, 4, 6
_DECADES = 1e40


@arguments_checked
def read(
    path: str | Path,
    *,
    names: Mapping[int, str] | None = None,
    require_positions: bool = True,
    averages: int | None = None,
    quantity: str | None = None,
    only: Collection[int] | None = None,
    length_unit: float | int | None = None,
) -> Measurement:
    """Read the FRFs of a universal file (UFF), ASCII or binary, into a measurement in SI.

    FRFs (dataset 58, function type 4), their coherences (type 6) and the variances that `write`
    records are read, nodes from dataset 15 or 2411; other datasets are ignored.
    Values are in the units of their labels, else of dataset 164, else SI; coordinates in those of
    dataset 164, else of `length_unit`. Functions that are not asked for are skipped unread, so that
    a part of a large file is read in little memory.

    Parameters
    ----------
    path
        The file.
    names
        Name of the transducer by node number. A node without one is named as `write` recorded it
        (ID line 5), else by the name of its entity (record 6) where that is of this node alone,
        else by its number: `1`.
    require_positions
        Whether a node without coordinates is an error.
    averages
        Number of averages, for which the format has no field: without this argument it is known
        only where ID line 4 records it, as `write` does.
    quantity
        `receptance`, `mobility` or `accelerance` (or their motion), to which all FRFs are
        converted; needed where the file mixes them.
    only
        Numbers of the response nodes whose FRFs are read; None for all.
    length_unit
        What one unit of the coordinates is in metres, where no dataset 164 says it: 1e-3 for mm.
        Without either they are taken for metres, with a warning that says how large that is.

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

    Examples
    --------
    >>> bp.io.uff.write("measured.uff", measured)
    >>> names = {1: "s1", 101: "a1"}
    >>> bp.io.uff.read("measured.uff", names=names, require_positions=False).sensors
    (Channel(name='s1', direction=1),)
    """
    if names is not None:
        needed = "names by the number of the node are needed, since each node has one"
        check_kind("names", names, Mapping, needed, "uff.read(path, names={1: 's1', 101: 'a1'})")
    if quantity is not None:
        frf_name(quantity)
    with reading(path_of(path), "a universal file", "Export it again."):
        datasets = load(Path(path), wanted=partial(_is_wanted, only))
        units = file_units(datasets)
        frfs = _frfs(datasets, units, Path(path))
        transducers = names_of_nodes(frfs, names or {})
        places = _positions(datasets, transducers, require_positions)
        length = of_nodes(Path(path), units, [*places.values()], length_unit=length_unit).length
        positions = {
            transducers[node]: (length * x, length * y, length * z)
            for node, (x, y, z) in places.items()
        }
        measurement = _assembled(
            Path(path), datasets, frfs, transducers, positions, averages, quantity
        )
        _check_values(Path(path), measurement)
        return measurement


def _is_wanted(only: Collection[int] | None, head: Mapping[str, object]) -> bool:
    """Whether a function is an FRF, a coherence or a variance of one of the nodes."""
    kind = head["func_type"]
    known = kind in (_FRF, _COHERENCE) or (kind == _GENERAL and head["id4"] == VARIANCE_NOTE)
    return known and (only is None or head["rsp_node"] in only)


@arguments_checked
def left_out(path: str | Path) -> dict[str, int]:
    """Count what `read` leaves out of a universal file, in words.

    Raises
    ------
    MeasurementFileError
        If it is no universal file.

    Examples
    --------
    >>> bp.io.uff.write("measured.uff", measured)
    >>> bp.io.uff.left_out("measured.uff")
    {}
    """
    return _datasets_left_out(Path(path), (_FRF, _COHERENCE))


def _check_values(path: Path, measurement: Measurement) -> None:
    """Refuse values that no structure and no instrument can have."""
    measured = measurement.frf[measurement.measured]
    coordinates = list(measurement.positions.values())
    check_plausible(path, frf=measured, frequency=measurement.frequency, coordinates=coordinates)
    sizes = np.abs(measured[measured != 0])
    if sizes.size and sizes.min() < sizes.max() / _DECADES:
        raise MeasurementFileError(
            f"{path} holds FRFs from {sizes.min():.3g} to {sizes.max():.3g}; less than 40 decades "
            "are needed, since no instrument has more: an exponent is damaged. Export it again."
        )


def _assembled(
    path: Path,
    datasets: list[Dataset],
    frfs: list[Function],
    transducers: dict[int, str],
    positions: dict[str, Position],
    averages: int | None,
    quantity: str | None,
) -> Measurement:
    _check_same_lines(frfs)
    quantity = quantity or _common_quantity(frfs)
    sensors = list(dict.fromkeys(frf.sensor for frf in frfs))
    actuators = list(dict.fromkeys(frf.actuator for frf in frfs))
    of_one_quantity = [
        frf._replace(values=converted(frf.values, frf.frequency, frf.quantity, quantity))
        for frf in frfs
    ]
    frf = _arranged(of_one_quantity, sensors, actuators)
    coherence = _coherence(datasets, frfs, sensors, actuators)
    variance = _variance(datasets, frfs, sensors, actuators, quantity)
    lines = usable_lines(path, frfs[0].frequency, frf, coherence)
    return Measurement.from_arrays(
        frf[..., lines],
        frfs[0].frequency[lines],
        sensors=[Channel(transducers[node], direction) for node, direction in sensors],
        actuators=[Channel(transducers[node], direction) for node, direction in actuators],
        quantity=quantity,
        coherence=None if coherence is None else coherence[..., lines],
        averages=averages if averages is not None else _noted(frfs, "averages"),
        positions=positions,
        force_level=_noted(frfs, "force_level"),
        variance=None if variance is None else variance[..., lines],
    )


def _frfs(datasets: list[Dataset], units: FileUnits, path: Path) -> list[Function]:
    functions = [dataset for dataset in datasets if dataset.number == FUNCTION]
    frfs = [dataset for dataset in functions if dataset.fields["func_type"] == _FRF]
    if not frfs:
        raise MeasurementFileError(
            f"{path} {described(path)}; at least one FRF (dataset 58, function type 4) is needed "
            "here, since a structure is updated by its FRFs. Export FRFs, or read what it holds."
        )
    return [_frf(dataset, units) for dataset in frfs]


def _frf(dataset: Dataset, units: FileUnits) -> Function:
    if not np.iscomplexobj(dataset.fields["data"]):
        raise MeasurementFileError(
            f"{dataset.place} is an FRF of real numbers; complex ones (ordinate type 5 or 6) are "
            "needed, since the phase holds the sign and the damping of a resonance. Export real "
            "and imaginary part."
        )
    factor = scale(dataset, units)
    return _function(dataset, dataset.fields["data"] * factor, quantity_of(dataset))


def _function(dataset: Dataset, values: np.ndarray, quantity: str = "") -> Function:
    check_abscissa(dataset)
    return Function(
        place=dataset.place,
        sensor=_node(dataset, "rsp"),
        actuator=_node(dataset, "ref"),
        frequency=np.asarray(dataset.fields["x"], dtype=float),
        values=values,
        quantity=quantity,
        notes=note_of(dataset, "id4") | note_of(dataset, "id5"),
        entities=(entity(dataset, "rsp"), entity(dataset, "ref")),
    )


def _node(dataset: Dataset, side: str) -> Node:
    node, direction = dataset.fields[f"{side}_node"], dataset.fields[f"{side}_dir"]
    if abs(direction) > 3:
        raise MeasurementFileError(
            f"{dataset.place} has direction {direction} at node {node}, a rotation; a translation "
            "(+-1, +-2, +-3, or 0 where not stated) is needed, since FRFs here are motion in a "
            "direction per force. Leave rotations out of the export."
        )
    return int(node), int(direction)


def _noted(frfs: list[Function], key: str) -> Any:
    noted = {frf.notes.get(key): frf for frf in frfs}
    if len(noted) > 1:
        raise MeasurementFileError(
            f"{list(noted.values())[1].place} records {key}={list(noted)[1]} and an earlier FRF "
            f"{key}={next(iter(noted))}; one number is needed, since a measurement has one. Split "
            "the file by it."
        )
    return next(iter(noted))


def _check_same_lines(functions: list[Function]) -> None:
    first, *further = functions
    for function in further:
        agree = function.frequency.shape == first.frequency.shape and np.allclose(
            function.frequency, first.frequency, rtol=1e-9, atol=0.0
        )
        if not agree:
            raise MeasurementFileError(
                f"{function.place} has {_axis(function)} but {first.place} has {_axis(first)}; one "
                "frequency axis is needed for all, since a measurement has one. Export them on the "
                "same lines, or in files of their own."
            )


def _axis(function: Function) -> str:
    low, high = function.frequency[[0, -1]]
    return f"{function.frequency.size} lines from {low:g} to {high:g} Hz"


def _common_quantity(frfs: list[Function]) -> str:
    quantities = sorted({frf.quantity for frf in frfs})
    if len(quantities) > 1:
        raise MeasurementFileError(
            f"The file mixes {' and '.join(quantities)}; one quantity is needed, since a "
            "measurement has one. Say to which all FRFs are to be converted: "
            f"uff.read(path, quantity={quantities[0]!r})."
        )
    return quantities[0]


def _arranged(functions: list[Function], sensors: list[Node], actuators: list[Node]) -> np.ndarray:
    """Values of functions, [sensor, actuator, frequency]; NaN for a pair without a function."""
    lines = functions[0].frequency.size
    array = np.full((len(sensors), len(actuators), lines), np.nan, functions[0].values.dtype)
    filled: dict[tuple[Node, Node], str] = {}
    for function in functions:
        pair = function.sensor, function.actuator
        if pair in filled:
            raise MeasurementFileError(
                f"{function.place} and {filled[pair]} hold the same function for response node "
                f"{pair[0][0]} (direction {pair[0][1]}) and reference node {pair[1][0]} "
                f"(direction {pair[1][1]}); one for each pair is needed, since either could "
                "be meant. Delete one, or read repeated runs from files of their own."
            )
        filled[pair] = function.place
        array[sensors.index(function.sensor), actuators.index(function.actuator)] = function.values
    return array


def _coherence(
    datasets: list[Dataset], frfs: list[Function], sensors: list[Node], actuators: list[Node]
) -> np.ndarray | None:
    coherences = [dataset for dataset in datasets if _type(dataset) == _COHERENCE]
    functions = _of_frfs(coherences, frfs)
    return _arranged(functions, sensors, actuators) if functions else None


def _variance(
    datasets: list[Dataset],
    frfs: list[Function],
    sensors: list[Node],
    actuators: list[Node],
    quantity: str,
) -> np.ndarray | None:
    """Variance of each FRF as `write` records it, in SI of the quantity of the FRF."""
    variances = [
        dataset
        for dataset in datasets
        if _type(dataset) == _GENERAL and dataset.fields["id4"].strip() == VARIANCE_NOTE
    ]
    stated = {(frf.sensor, frf.actuator): frf.quantity for frf in frfs}
    functions = []
    for function in _of_frfs(variances, frfs):
        source = stated[function.sensor, function.actuator]
        unity = np.ones(function.frequency.size)
        factor = np.abs(converted(unity, function.frequency, source, quantity)) ** 2
        functions.append(function._replace(values=function.values * factor))
    return _arranged(functions, sensors, actuators) if functions else None


def _type(dataset: Dataset) -> int | None:
    """Type of a function; None for another dataset."""
    return dataset.fields["func_type"] if dataset.number == FUNCTION else None


def _of_frfs(datasets: list[Dataset], frfs: list[Function]) -> list[Function]:
    """Functions of real numbers that belong to one of the FRFs, on the same lines."""
    pairs = {(frf.sensor, frf.actuator) for frf in frfs}
    functions = [_function(dataset, np.real(dataset.fields["data"])) for dataset in datasets]
    of_frfs = [function for function in functions if (function.sensor, function.actuator) in pairs]
    if of_frfs:
        _check_same_lines([frfs[0], *of_frfs])
    return of_frfs


def _positions(
    datasets: list[Dataset], transducers: dict[int, str], required: bool
) -> dict[int, Position]:
    """Coordinates of the nodes of the FRFs, in the unit of the file."""
    positions = node_positions(datasets, transducers)
    missing = [node for node in transducers if node not in positions]
    if missing and required:
        placed = ", ".join(map(str, sorted(positions))) or "none of its nodes"
        raise MeasurementFileError(
            f"FRFs refer to the nodes {', '.join(map(str, missing))} without coordinates; datasets "
            f"15 and 2411 place {placed}. Recorded coordinates are needed, since the true "
            "positions lie around them. Export the geometry with the FRFs, or state the positions "
            "in the experiment: uff.read(path, require_positions=False)."
        )
    return positions
