"""`bayes-placement init`: a commented model file to begin with, and its channels."""

from collections.abc import Sequence
from pathlib import Path

from .._files import write_atomically
from .._types import UsageError
from ..io._channel_row import ChannelRow
from ..io.mapped import channel_table

FILE = "model.py"

TEMPLATE = '''\
"""A model for bayes-placement: change what stands behind "CHANGE", then run

bayes-placement show {file}
bayes-placement improve {file}
"""

import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp

# CHANGE: the structure. A uniform bar here; bp.beams.beam bends, bp.finite_elements takes modes or
# matrices of your own code. A number that is not known is a distribution.
modes = bp.beams.bar(
    20,  # modes
    length=1.0,  # [m]
    area=1e-3,  # [m2]
    youngs_modulus=dist.Uniform(0.9e9, 1.1e9),  # [Pa]
    density=9000.0,  # [kg/m3]
    ends="fixed-fixed",
)
structure = bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.005, 0.08)))

# Where sensors and actuators were recorded [m], and how far they may be from there.
sensors = [
{sensors}
]
actuators = [
{actuators}
]

# CHANGE: what was measured; any of the formats that `bayes-placement import` reads.
# measurement = bp.io.read_measurement("measured.uff")

experiment = bp.Experiment(
    structure,
    sensors=sensors,
    actuators=actuators,
    frequency=np.arange(20.0, 1000.0, 10.0),  # CHANGE: measurement.frequency
    observe=bp.observe.Complex("acceleration"),
    # CHANGE: bp.noise.FromCoherence() where coherence and number of averages are in the file.
    noise=bp.noise.Relative(dist.LogUniform(1e-3, 0.2), dist.LogUniform(1e-4, 1.0)),
)
'''

EXAMPLE = (
    ChannelRow("s1", "sensor", position=(0.25, 0.0, 0.0), tolerance=(0.01, 0.0, 0.0)),
    ChannelRow("s2", "sensor", position=(0.6, 0.0, 0.0), tolerance=(0.01, 0.0, 0.0)),
    ChannelRow("a1", "actuator", position=(0.4, 0.0, 0.0), tolerance=(0.01, 0.0, 0.0)),
)
"""Channels where no table is given."""


def run(folder: Path, channels: Path | None) -> str:
    """Write a model file, and return what to do with it.

    Parameters
    ----------
    folder
        Folder of the file, which is made.
    channels
        Channel table: workbook or text; None for channels to be changed.

    Raises
    ------
    UsageError
        If the file is there already.
    """
    path = folder / FILE
    if path.exists():
        raise UsageError(
            f"{path} is there already; another folder is needed, since it would be replaced: "
            f"bayes-placement init {folder}-2."
        )
    rows = list(EXAMPLE) if channels is None else channel_table.read(channels)
    text = TEMPLATE.format(
        file=path,
        sensors=_lines("Sensor", [row for row in rows if row.role == "sensor"]),
        actuators=_lines("Actuator", [row for row in rows if row.role == "actuator"]),
    )
    write_atomically(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    return (
        f"A model was written to {path}: change it where it says CHANGE. Next: "
        f"bayes-placement show {path}"
    )


def _lines(kind: str, rows: Sequence[ChannelRow]) -> str:
    return "\n".join(_line(kind, row) for row in rows) or f"    # CHANGE: bp.{kind}(...)"


def _line(kind: str, row: ChannelRow) -> str:
    """A transducer: on a line along x, or in space, where its tolerance is a box."""
    place = row.position or (0.0, 0.0, 0.0)
    within = row.tolerance or (0.0, 0.0, 0.0)
    if any(place[1:]):
        at = f"bp.positions.Box({_numbers(place)}, within={_numbers(within)})"
    elif within[0] > 0:
        at = f"bp.positions.Segment({place[0]:g}, within={within[0]:g})"
    else:
        at = f"{place[0]:g}"
    directions = f", directions=({row.direction},)" if row.direction else ""
    remark = "" if row.position else "  # CHANGE: its position [m]"
    return f'    bp.{kind}("{row.name}", at={at}{directions}),{remark}'


def _numbers(point: Sequence[float]) -> str:
    return "(" + ", ".join(f"{coordinate:g}" for coordinate in point) + ")"
