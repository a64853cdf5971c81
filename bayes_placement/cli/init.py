"""`bayes-placement init`: a commented model file or mapping to begin with, and its channels."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from .._shared.errors import UsageError
from .._shared.files import write_atomically

if TYPE_CHECKING:
    from ..io.mapped.channel_table import ChannelRow

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

MAPPING, TABLE = "mapping.toml", "channels"

CASE_TEMPLATE = """\
# What a file of FRFs does not say. Put the file beside this one, change what stands behind CHANGE,
# then run
#
#     bayes-placement import {folder} --out {folder}/case
#     bayes-placement improve {folder}/case

file = "measured.uff"  # CHANGE: a universal file, .mat, .npz, HDF5, CSV or .xlsx
channels = "{table}"  # CHANGE there: names, nodes, places and tolerances
averages = 16  # CHANGE: of each FRF; with the coherence they tell the noise

# A universal file says the rest. For arrays, without the signs at the beginning:
# frf = {{ array = "H", axes = ["frequency", "sensor", "actuator"], unit = "(m/s^2)/N" }}
# frequency = {{ array = "f", unit = "Hz" }}
# coherence = "coherence"
# sensors = ["s1", "s2"]
# actuators = ["a1"]

[case]
sensor_setup = "fixed"  # CHANGE: "roving" where one sensor was moved from run to run
estimator = "H1"

[case.structure]
type = "axial bar"  # or "Euler-Bernoulli beam, bending", with width_m and height_m for area_m2
length_m = 1.0  # CHANGE, all of these
area_m2 = 1e-3
boundary_conditions = "fixed at x=0 and x=L"
motion = "axial displacement u(x), direction 1"
youngs_modulus_Pa = 1e9
density_kg_m3 = 9000.0
damping = {{ model = "modal viscous, the same ratio for every mode", ratio = 0.02 }}

# What is not known of it; positions are unknown within the tolerances of the channel table.
[[case.uncertain_parameters]]
name = "youngs_modulus_Pa"
prior = {{ type = "uniform", low = 0.9e9, high = 1.1e9 }}

[[case.uncertain_parameters]]
name = "modal_damping_ratio"
prior = {{ type = "uniform", low = 0.005, high = 0.08 }}
"""

EXAMPLE_TABLE = """\
name,role,node,x [mm],y [mm],z [mm],direction,tolerance [mm]
s1,sensor,1,250,0,0,+x,10
s2,sensor,2,600,0,0,+x,10
a1,actuator,3,400,0,0,+x,10
"""

EXAMPLE_SENSORS = """\
    bp.Sensor("s1", at=bp.positions.Segment(0.25, within=0.01)),
    bp.Sensor("s2", at=bp.positions.Segment(0.6, within=0.01)),"""

EXAMPLE_ACTUATORS = """\
    bp.Actuator("a1", at=bp.positions.Segment(0.4, within=0.01)),"""


NewFiles: TypeAlias = tuple[str, list[Path]]
"""A sentence on what to do with what was written to begin with, and the files."""


def run(folder: Path, channels: Path | None, as_case: bool = False) -> NewFiles:
    """Write a model file, or what a case folder is made of, and return what to do with it.

    Without a channel table, channels are to be changed. As a case it is a mapping for `import`.
    """
    if folder.is_file():
        raise UsageError(
            f"{folder} is a file; a folder is needed, which is made if it is not there: "
            f"bayes-placement init {folder.with_suffix('')}-model."
        )
    return _write_mapping(folder, channels) if as_case else _write_model(folder, channels)


def _free(path: Path) -> Path:
    """A path at which nothing is replaced."""
    if path.exists():
        raise UsageError(
            f"{path} is there already; another folder is needed, since it would be replaced: "
            f"bayes-placement init {path.parent}-2."
        )
    return path


def _write_mapping(folder: Path, channels: Path | None) -> NewFiles:
    """Write a mapping, and the channel table that it names."""
    path, table = _free(folder / MAPPING), "channels.csv"
    if channels is None:
        content = EXAMPLE_TABLE.encode()
    else:
        _rows(channels)  # what is none is refused here, not later
        content, table = channels.read_bytes(), f"{TABLE}{channels.suffix}"
    target = _free(folder / table)
    text = CASE_TEMPLATE.format(folder=folder, table=table)
    write_atomically(target, lambda temporary: temporary.write_bytes(content))
    write_atomically(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    sentence = (
        f"A mapping was written to {path}, and a channel table to {target}: change them where the "
        f"mapping says CHANGE, and put the file of FRFs beside them. Next: bayes-placement import "
        f"{folder} --out {folder / 'case'}"
    )
    return sentence, [path, target]


def _write_model(folder: Path, channels: Path | None) -> NewFiles:
    path = _free(folder / FILE)
    sensors, actuators = EXAMPLE_SENSORS, EXAMPLE_ACTUATORS
    if channels is not None:
        rows = _rows(channels)
        sensors = _lines("Sensor", [row for row in rows if row.role == "sensor"])
        actuators = _lines("Actuator", [row for row in rows if row.role == "actuator"])
    text = TEMPLATE.format(file=path, sensors=sensors, actuators=actuators)
    write_atomically(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    sentence = (
        f"A model was written to {path}: change it where it says CHANGE. Next: "
        f"bayes-placement show {path}"
    )
    return sentence, [path]


def _rows(channels: Path) -> "Sequence[ChannelRow]":
    """Rows of a channel table; only this needs the rooms that compute, which take seconds."""
    from ..io.mapped import channel_table

    return channel_table.read(channels)


def _lines(kind: str, rows: "Sequence[ChannelRow]") -> str:
    return "\n".join(_line(kind, row) for row in rows) or f"    # CHANGE: bp.{kind}(...)"


def _line(kind: str, row: "ChannelRow") -> str:
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
