"""case: in, a folder with case.json and UFF files; out, the experiment and what was measured.

Not known here: how fields are checked, how universal files are written, inference.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from ...experiment.experiment import Experiment
from ...experiment.noise import FromCoherence
from ...experiment.observe import FRF_OF, Complex
from ...experiment.transducers import Actuator, Sensor
from ...positions.channel import Channel, checked
from ..model import Study
from . import _line as _case_structure
from . import _transducers as _case_places
from ._json_fields import CaseError, Fields, Rule, distinct, load, one_of, whole
from ._measurement import Mounted, measurements, setup

__all__ = ["CaseError", "read"]

Kind = TypeVar("Kind", Sensor, Actuator)

_MOUNTED = {
    "one sensor roved over the positions, one run per position": "roving",
    "all sensors mounted all the time": "fixed",
}


def read(folder: str | Path) -> Study:
    """Read a case: the nominal structure, its uncertainties and the measured FRFs.

    The folder holds `case.json` (SI units; fields that are not named here are ignored) and
    `measured.uff`, with a further `measured_level2.uff`, ... for each further force level.

    - `structure`: `type` (`axial bar`, or `Euler-Bernoulli beam, bending`), `length_m`, `area_m2`
      of a bar or `width_m` and `height_m` of a rectangular beam, `boundary_conditions`, `motion`,
      `youngs_modulus_Pa`, `density_kg_m3`, `damping` (`model`, `ratio`); `suspension`, a list of
      springs with `x_m` and `stiffness_N_per_m`. It lies along x from 0 to its length.
    - `nominal_fe_model`: null, or a folder with `nominal.npz` (nodes, degrees of freedom, elements,
      modes), `model.json`, `K.npz`, `M.npz` and `K_region_00.npz`, ...: a space frame or a plate.
    - `sensors`, `actuators`: lists with `id`, `uff_node`, `position_m`, `tolerance_m`,
      `directions`, `angle_tolerance_rad`; tolerances are uniform, plus and minus.
    - `uncertain_parameters`: a list with `name` (`youngs_modulus_Pa`, `density_kg_m3` or
      `modal_damping_ratio`) and `prior`: `type` `uniform` with `low` and `high`, `normal` with
      `mean` and `standard_deviation`, or `lognormal` with `median` and `log_standard_deviation`.
    - `frequency`: `band_hz`, `n_lines`, the lines of the files that are used.
    - `measurement`: `quantity`, `units`, `convention`, `estimator`, `n_averages`, `out_channels`,
      `in_channels`, `sensor_setup`, `force_levels_N` (null, or one amplitude [N] for each file).

    Parameters
    ----------
    folder
        The folder of the case.

    Returns
    -------
    Study
        Experiment and measurement: with force levels a tuple of measurements, in their order.
        Channels of the files that the case does not name are left out.

    Raises
    ------
    FileNotFoundError
        If the folder or a file is missing.
    CaseError
        (A ValueError.) If a field is missing or wrong, or the files contradict it.
    """
    case = load(Path(folder) / "case.json")
    drawn = _case_structure.drawn(case)
    sensors, actuators = (_recorded(case, side, drawn) for side in ("sensors", "actuators"))
    _check_distinct(sensors, actuators)
    stated = setup(case, sensors, actuators)
    mounting = case.inside("measurement").take("sensor_setup", one_of(*_MOUNTED))
    structure = _case_structure.structure(case, drawn, stated.band[1])
    measured = measurements(Path(folder), stated)
    experiment = Experiment(
        structure,
        sensors=[_transducer(Sensor, one, drawn) for one in sensors],
        actuators=[_transducer(Actuator, one, drawn) for one in actuators],
        frequency=measured[0].frequency,
        observe=Complex(next(word for word, frf in FRF_OF.items() if frf == stated.quantity)),
        noise=FromCoherence(),
        force_levels=stated.force_levels,
        sensors_mounted=_MOUNTED[mounting],
    )
    return Study(experiment, measured if stated.force_levels else measured[0], None, {})


def _recorded(case: Fields, side: str, drawn: _case_structure.Drawn) -> list[Mounted]:
    return [_mounted(one, drawn) for one in case.each(side, least=1)]


def _mounted(fields: Fields, drawn: _case_structure.Drawn) -> Mounted:
    name = fields.take("id", _NAME)
    node = fields.take("uff_node", whole(1, 1))
    position = tuple(map(float, fields.take("position_m", _case_places.position(drawn))))
    directions = fields.take("directions", _case_places.directions(drawn))
    channels = tuple(Channel(name, int(direction)) for direction in directions)
    return Mounted(fields, channels, node, position)


def _transducer(kind: Callable[..., Kind], mounted: Mounted, drawn: _case_structure.Drawn) -> Kind:
    return kind(
        mounted.name,
        at=_case_places.at(mounted, drawn),
        directions=tuple(channel.direction for channel in mounted.channels),
        angles=_case_places.angles(mounted, drawn),
    )


def _check_distinct(sensors: list[Mounted], actuators: list[Mounted]) -> None:
    """Refuse a name that two transducers bear, and a node that two of one side share."""
    distinct("id", [one.fields for one in (*sensors, *actuators)])
    for side in (sensors, actuators):
        distinct("uff_node", [one.fields for one in side])


def _is_name(value: Any) -> bool:
    try:
        return isinstance(value, str) and checked(Channel(value)).name == value
    except ValueError:
        return False


_NAME = Rule(
    "a name without blanks around it that does not end in a direction such as +x", "s1", _is_name
)
