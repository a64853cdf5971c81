"""Any file of measured FRFs, or a folder with data, mapping and channel table, as a measurement."""

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from ..._shared.arguments import arguments_checked
from ..._shared.errors import InputError
from ..._shared.reprs import notebook_html
from ...experiment.measurement import Measurement, Position
from ...positions.channel import Channel
from .. import _contents, uff
from .._gate import path_of, reading
from ..arrays import NamedArrays, load
from . import _lines_needed, channel_table
from . import mapping as mappings
from ._headings import completed
from .channel_table import ChannelRow
from .mapping import Mapping
from .measurement import (
    CONJUGATED,
    ImportReport,
    check_axes,
    measurement_of,
    positions_of,
    report,
    unused_rows,
    unused_sensitivities,
)

__all__ = ["ChannelRow", "ImportReport", "Imported", "Mapping", "read", "read_measurement"]

_MAPPING_SUFFIX = ".toml"
_AGREEMENT = 1e-5  # of the greatest coordinate; universal files may keep six digits
_OF_ARRAYS = ("frf", "unit", "coherence", "frequency", "sensors", "actuators")


class Imported(NamedTuple):
    """What was read of a file.

    Parameters
    ----------
    measurement
        The measurement, in SI.
    report
        What was read, in which unit, and what was left out and why.
    channels
        Rows of the channel table; empty without one.
    mapping
        What the mapping says.

    Examples
    --------
    >>> bp.io.uff.write("measured.uff", measured)
    >>> bp.io.read("measured.uff").channels
    ()
    """

    measurement: Measurement
    report: ImportReport
    channels: tuple[ChannelRow, ...]
    mapping: Mapping

    def __repr__(self) -> str:
        """Say what was measured."""
        return f"Imported: {self.report.result}"

    def _repr_html_(self) -> str:
        import pandas as pd

        return notebook_html(repr(self), pd.DataFrame(self.channels), self.report.words())

    def __str__(self) -> str:
        """What was read and what was not, a sentence a line."""
        return str(self.report)


@arguments_checked
def read(path: str | Path, mapping: object = None) -> Imported:
    """Read measured FRFs of any file; its first bytes tell the format.

    Universal files, MATLAB 5 to 7.3, NumPy archives (.npz), HDF5, columns of text (CSV, TSV,
    blanks) and workbooks (.xlsx). What a file does not say, a mapping says, in TOML:

    - `file`, `channels`: names of the data and of a channel table in the folder of the mapping;
      `channels` may also be a table by name with `role`, `node`, `position` [m], `direction`,
      `tolerance` [m], `angle_tolerance` [rad], `sensitivity` and `unit`.
    - `frf`: a table with `array` (complex), or `real` and `imaginary`, or `magnitude` or `decibel`
      (re 1 unit) with `degrees` or `radians`; each names an array or the number of a column.
      `axes` lists `frequency`, `sensor` and `actuator` in the order of the array, `unit` is such
      as `(m/s^2)/N`, `g/N`, `mm/N`, or `V/V`, which the sensitivities of the channel table turn
      into SI. Or a list of tables, one for each pair, with `sensor`, `actuator` and `coherence`.
    - `frequency`: `array`, or `first` and `step`, numbers or names of arrays of one number; `unit`:
      Hz, kHz, rad/s or 1/min.
    - `sensors`, `actuators`: labels such as `s1+x` in their order, or the name of a text array.
    - `coherence`: an array, with the `axes` of the FRFs or its own. `averages`, `force_level`.
    - `length_unit`: of the nodes of a universal file that states none: 1e-3 for mm.
    - `convention`: `exp(-i w t)` where the file was made so.
    - `case`: what a case folder needs besides; see `io.case.write`.

    A file needs no mapping that has the arrays `frf` (sensor, actuator, frequency; SI), `frequency`
    [Hz], `sensors`, `actuators`, `quantity`, or columns with the headings `frequency [Hz]`,
    `s1+x/a1+x real [(m/s^2)/N]`, `s1+x/a1+x imaginary [(m/s^2)/N]`, `s1+x/a1+x coherence`.

    Parameters
    ----------
    path
        The file; a mapping that names it; or a folder with both.
    mapping
        Path of the mapping, or a dictionary of its fields.

    Raises
    ------
    FileNotFoundError
        If a file is missing.
    ValueError
        If a file is damaged, or neither file nor mapping says what it holds; the error then has
        the lines of the mapping that are needed.

    Examples
    --------
    >>> bp.io.uff.write("measured.uff", measured)
    >>> bp.io.read("measured.uff").measurement.quantity
    'mobility'
    """
    place = path_of(path)
    if mapping is None and place.suffix.lower() == _MAPPING_SUFFIX:
        return _by_mapping(mappings.read(place))
    if place.is_dir():
        return _of_folder(place, mapping)
    stated = mappings.read(mapping)
    return _of_file(place, stated, _table(stated, place.parent))


@arguments_checked
def read_measurement(path: str | Path, **options: Any) -> Measurement:
    """Read the measurement alone.

    Raises
    ------
    FileNotFoundError
        If a file is missing.
    ValueError
        As in `read`.

    Examples
    --------
    >>> bp.io.uff.write("measured.uff", measured)
    >>> bp.io.mapped.read_measurement("measured.uff").quantity
    'mobility'
    """
    return read(path, **options).measurement


def _by_mapping(mapping: Mapping) -> Imported:
    if mapping.file is None:
        raise InputError(
            f"{mapping.place} names no file; the name of the data is needed, since the mapping "
            'alone was given. Write file = "measured.mat" in it, or give both: '
            "bp.io.read(data, mapping)."
        )
    folder = mapping.folder or Path()
    return _of_file(folder / mapping.file, mapping, _table(mapping, folder))


def _of_folder(folder: Path, mapping: object) -> Imported:
    """Read the data, the mapping and the channel table of a folder, each of which is there once."""
    files = sorted(file for file in folder.iterdir() if file.is_file() and file.name[0] != ".")
    mapping_files = [file for file in files if file.suffix.lower() == _MAPPING_SUFFIX]
    source = mapping if mapping is not None or len(mapping_files) != 1 else mapping_files[0]
    stated = mappings.read(source)
    other_files = [file for file in files if file not in mapping_files]
    tables = [file for file in other_files if _is_table(file)] if stated.channels is None else []
    data = [file for file in other_files if file not in tables and file.name != stated.channels]
    if stated.file is not None:
        data = [folder / stated.file]
    if len(data) != 1 or len(tables) > 1:
        raise _lines_needed.file_needed(folder, [file.name for file in files])
    rows = channel_table.read(tables[0]) if tables else _table(stated, folder)
    return _of_file(data[0], stated, rows)


def _is_table(path: Path) -> bool:
    kinds = (_contents.WORKBOOK, _contents.TEXT)
    return _contents.content_of(path) in kinds and channel_table.is_channel_table(path)


def _table(mapping: Mapping, folder: Path) -> list[ChannelRow]:
    if isinstance(mapping.channels, dict):
        return channel_table.of_mapping(mapping.place, mapping.channels)
    if mapping.channels is None:
        return []
    return channel_table.read((mapping.folder or folder) / mapping.channels)


def _of_file(path: Path, mapping: Mapping, rows: list[ChannelRow]) -> Imported:
    is_universal = path.is_file() and _contents.content_of(path) == _contents.UNIVERSAL
    if is_universal:
        measurement, import_report = _of_universal_file(path, mapping, rows)
    else:
        if mapping.length_unit is not None:
            raise InputError(
                f"{mapping.place} has the field length_unit, and {path} is no universal file; it "
                "is needed for its nodes alone, since a channel table is in m. Leave it out."
            )
        source = _loaded(path)
        if not mapping.frf and {"name", "role"} <= {*map(str.lower, source.arrays)}:
            channel_table.check_is_none(path)
        measurement, import_report = measurement_of(source, completed(mapping, source), rows)
    return Imported(measurement, import_report, tuple(rows), mapping)


def _loaded(path: Path) -> NamedArrays:
    try:
        return load(path)
    except InputError:
        channel_table.check_is_none(path)  # empty cells make it no table of numbers
        raise


def _of_universal_file(
    path: Path, mapping: Mapping, rows: list[ChannelRow]
) -> tuple[Measurement, ImportReport]:
    """Read a universal file, which says all but averages, sign, level and, often, places."""
    superfluous = [name for name in _OF_ARRAYS if getattr(mapping, name)]
    if superfluous:
        raise InputError(
            f"{mapping.place} has the field {superfluous[0]}, and {path} is a universal file, "
            "which says that itself; both could contradict each other. Leave it out of the mapping."
        )
    names = {row.node: str(row.node) for row in rows if row.node is not None}
    measurement = uff.read(
        path,
        names=names,
        require_positions=False,
        averages=mapping.averages,
        length_unit=mapping.length_unit,
    )
    named = _named_by_node(measurement, rows) if names else measurement
    if rows:
        with reading(path, "a universal file", "Correct the channel table."):
            check_axes(named, rows)
        named = replace(named, positions=_agreed(path, named.positions, positions_of(rows)))
    named = replace(
        named,
        frf=named.frf.conj() if mapping.conjugate else named.frf,
        force_level=named.force_level if mapping.force_level is None else mapping.force_level,
    )
    sign = f", {CONJUGATED}" if mapping.conjugate else ""
    sentences = [
        f"FRFs: {int(named.measured.sum())} functions (dataset 58), in SI by its units{sign}.",
        "Channels: named by the channel table, by node." if names else "Channels: as recorded.",
    ]
    datasets = {
        f"{what} ({count})": "it holds neither FRFs, coherences, nodes nor units"
        for what, count in uff.left_out(path).items()
    }
    left_out = {**datasets, **unused_rows(rows, named), **unused_sensitivities(rows)}
    return named, report(path, "a universal file", sentences, left_out, named)


def _named_by_node(measurement: Measurement, rows: list[ChannelRow]) -> Measurement:
    """Name channels by the table: sensors and actuators may share a node."""
    names = {
        role: {str(row.node): row.name for row in rows if row.role == role and row.node}
        for role in ("sensor", "actuator")
    }
    at_node = {
        node: {table[node] for table in names.values() if node in table} or {node}
        for node in measurement.positions
    }
    return replace(
        measurement,
        sensors=_renamed(measurement.sensors, names["sensor"]),
        actuators=_renamed(measurement.actuators, names["actuator"]),
        positions={
            name: place for node, place in measurement.positions.items() for name in at_node[node]
        },
    )


def _agreed(
    path: Path, recorded: dict[str, Position], stated: dict[str, Position]
) -> dict[str, Position]:
    """Positions of a universal file and of a channel table, which must agree."""
    largest = max((max(map(abs, point)) for point in stated.values()), default=0.0)
    for name, point in stated.items():
        recorded_point = recorded.get(name, point)
        if any(
            abs(a - b) > _AGREEMENT * largest for a, b in zip(point, recorded_point, strict=True)
        ):
            raise InputError(
                f"{path} places {name} at {recorded_point} m and the channel table at {point} m; "
                "both must agree, since either could be meant. Correct the one that is wrong."
            )
    return {**recorded, **stated}


def _renamed(channels: tuple[Channel, ...], names: dict[str, str]) -> tuple[Channel, ...]:
    return tuple(
        channel._replace(name=names.get(channel.name, channel.name)) for channel in channels
    )
