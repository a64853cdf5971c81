"""Write a case folder: `case.json` and a universal file, from a measurement and its channels."""

import json
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from ..._shared.arguments import arguments_checked
from ..._shared.errors import InputError
from ..._shared.files import Json, write_atomically
from ...experiment.measurement import Measurement
from ...experiment.quantities import quantity_of
from ...positions.channel import Channel, match
from ..mapped.channel_table import ChannelRow
from ..uff import node_numbers
from ..uff import write as write_universal_file
from ._json_fields import CaseError
from .folder import read

SETUPS = {
    "roving": "one sensor roved over the positions, one run per position",
    "fixed": "all sensors mounted all the time",
}
_STATED = ("structure", "uncertain_parameters", "sensor_setup", "estimator")
_FURTHER = ("nominal_fe_model", "noise_level", "note")
_LINES = {
    "structure": '[case.structure]\ntype = "axial bar"\nlength_m = 1.0\narea_m2 = 1e-3\n'
    'boundary_conditions = "fixed at x=0 and x=L"\n'
    'motion = "axial displacement u(x), direction 1"\n'
    "youngs_modulus_Pa = 2.1e11\ndensity_kg_m3 = 7850.0\n"
    'damping = { model = "modal viscous, the same ratio for every mode", ratio = 0.01 }',
    "uncertain_parameters": '[[case.uncertain_parameters]]\nname = "modal_damping_ratio"\n'
    'prior = { type = "uniform", low = 0.005, high = 0.02 }',
    "sensor_setup": '[case]\nsensor_setup = "fixed"  # or "roving": one sensor, run after run',
    "estimator": '[case]\nestimator = "H1"',
}


@arguments_checked
def write(
    folder: str | Path,
    measurement: Measurement,
    channels: Sequence[ChannelRow],
    stated: Mapping[str, object],
) -> Path:
    """Write a case, which `read` reads back; it is complete before it replaces an earlier one.

    Parameters
    ----------
    folder
        The folder; `case.json` and `measured.uff` in it are replaced.
    measurement
        What was measured; its lines above 0 Hz make the band.
    channels
        Place, tolerance and direction of each channel.
    stated
        `structure` and `uncertain_parameters` as in `case.json`; `sensor_setup`, `fixed` or
        `roving`; `estimator`, H1. If wanted `nominal_fe_model`, `noise_level` and `note`.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    CaseError
        If something is missing that a case needs, or `read` refuses what is written.

    Examples
    --------
    >>> read = bp.io.read("measured.toml")  # doctest: +SKIP
    >>> case = read.mapping.case  # doctest: +SKIP
    >>> bp.io.case.write("case", read.measurement, read.channels, case)  # doctest: +SKIP
    """
    _check_stated(stated)
    lines = measurement.without(0.0, 0.0) if measurement.frequency[0] == 0 else measurement
    with tempfile.TemporaryDirectory() as parent:
        draft = Path(parent) / "case"
        draft.mkdir()
        named = _with_directions(lines, channels)
        write_universal_file(draft / "measured.uff", named, binary=True)
        content = json.dumps(_fields(named, channels, stated), indent=1, ensure_ascii=False)
        (draft / "case.json").write_text(f"{content}\n", encoding="utf-8")
        _check_readable(draft)
        for name in ("measured.uff", "case.json"):
            write_atomically(Path(folder) / name, partial(shutil.copy, draft / name))
    return Path(folder)


def _check_stated(stated: Mapping[str, object]) -> None:
    missing = [name for name in _STATED if name not in stated]
    unknown = [name for name in stated if name not in (*_STATED, *_FURTHER)]
    if unknown:
        raise CaseError(
            f"case.{unknown[0]} is not known; {', '.join((*_STATED, *_FURTHER))} are. Correct its "
            "name."
        )
    if missing:
        lines = "\n".join(_LINES[name] for name in missing)
        raise CaseError(
            f"Nothing says {', nor '.join(missing)}; a case needs them, since no file of measured "
            f"FRFs holds them and nothing is guessed. Add to the mapping, corrected:\n\n{lines}"
        )
    if stated["sensor_setup"] not in SETUPS:
        raise CaseError(
            f"case.sensor_setup is {stated['sensor_setup']!r}; one of {', '.join(SETUPS)} is "
            'needed there. Write sensor_setup = "fixed".'
        )


def _check_readable(draft: Path) -> None:
    """Refuse a case that would not be read, in the words of the reader but of the mapping."""
    try:
        read(draft)
    except InputError as error:
        words = str(error).replace(str(draft / "case.json"), "the case").replace(str(draft), "it")
        raise CaseError(f"{words} (Fields of the case stand in [case] of the mapping.)") from error


def _with_directions(measurement: Measurement, channels: Sequence[ChannelRow]) -> Measurement:
    """Name the direction of each channel, which a case states."""
    sensors = [_stated(channel, channels, "sensor") for channel in measurement.sensors]
    actuators = [_stated(channel, channels, "actuator") for channel in measurement.actuators]
    return measurement.channels(sensors, actuators)


def _stated(channel: Channel, channels: Sequence[ChannelRow], role: str) -> Channel:
    row = _row(channel, channels, role)
    direction = channel.direction or row.direction
    if not direction:
        raise _missing(channel.name, "direction")
    return Channel(channel.name, direction)


def _row(channel: Channel, channels: Sequence[ChannelRow], role: str) -> ChannelRow:
    of_role = [row for row in channels if row.role == role]
    if not of_role:
        raise _missing(channel.name, "row")
    known = tuple(Channel(row.name, row.direction) for row in of_role)
    return of_role[match(channel, known, role).number]


def _missing(name: str, what: str) -> CaseError:
    return CaseError(
        f"The channel table states no {what} of {name}; position, tolerance and direction of each "
        "channel are needed, since a case treats them as unknown within their tolerance. Add them "
        f'to the table, or to the mapping: [channels.{name}] with role = "sensor", position = '
        '[0.25, 0.0, 0.0], tolerance = [0.01, 0.0, 0.0], direction = "+x".'
    )


def _fields(
    measurement: Measurement, channels: Sequence[ChannelRow], stated: Mapping[str, object]
) -> Json:
    nodes = node_numbers(measurement)
    low, high = measurement.frequency[[0, -1]].tolist()
    on_line = stated.get("nominal_fe_model") is None
    further = {name: stated[name] for name in ("note",) if name in stated}
    return {
        **further,
        "structure": stated["structure"],
        "nominal_fe_model": stated.get("nominal_fe_model"),
        "sensors": _transducers(measurement.sensors, channels, "sensor", nodes, on_line),
        "actuators": _transducers(measurement.actuators, channels, "actuator", nodes, on_line),
        "uncertain_parameters": stated["uncertain_parameters"],
        "frequency": {"band_hz": [low, high], "n_lines": measurement.frequency.size},
        "measurement": _measured(measurement, stated),
    }


def _measured(measurement: Measurement, stated: Mapping[str, object]) -> Json:
    if measurement.averages is None:
        raise CaseError(
            "Nothing says of how many averages the FRFs are; a case needs the number, since the "
            "noise follows from it and the coherence. Write averages = 16 at the top of the "
            "mapping."
        )
    noise = {"noise_level": stated["noise_level"]} if "noise_level" in stated else {}
    level = measurement.force_level
    return {
        "quantity": measurement.quantity,
        "units": quantity_of(measurement.quantity).ascii_unit,
        "convention": "exp(+i w t)",
        "estimator": stated["estimator"],
        "n_averages": int(measurement.averages),
        "out_channels": [[channel.name, channel.direction] for channel in measurement.sensors],
        "in_channels": [[channel.name, channel.direction] for channel in measurement.actuators],
        "sensor_setup": SETUPS[str(stated["sensor_setup"])],
        "force_levels_N": None if level is None else [level],
        **noise,
    }


def _transducers(
    measured: Sequence[Channel],
    channels: Sequence[ChannelRow],
    role: str,
    nodes: Mapping[str, int],
    on_line: bool,
) -> list[Json]:
    """One object for each transducer, with all of its measured directions."""
    transducers = []
    for name in dict.fromkeys(channel.name for channel in measured):
        of_name = [channel for channel in measured if channel.name == name]
        row = _row(of_name[0], channels, role)
        for field in ("position", "tolerance"):
            if getattr(row, field) is None:
                raise _missing(name, field)
        transducers.append(
            {
                "id": name,
                "uff_node": nodes[name],
                "position_m": list(row.position or ()),
                "tolerance_m": _tolerance(row, on_line),
                "directions": [channel.direction for channel in of_name],
                "angle_tolerance_rad": row.angle_tolerance or 0.0,
            }
        )
    return transducers


def _tolerance(row: ChannelRow, on_line: bool) -> list[float]:
    """Tolerances along x, y and z; across a bar or beam there is nowhere to go."""
    along, *across = row.tolerance or (0.0, 0.0, 0.0)
    return [along, 0.0, 0.0] if on_line else [along, *across]
