"""A case folder, `case.json` and universal files, as an experiment and its measurement."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpyro.distributions import Normal, Uniform

from ..._shared.dimensions import Parameter
from ...experiment.experiment import Experiment, Measurements
from ...experiment.observe import Complex
from ...experiment.transducers import Actuator, Sensor
from ...positions.at import At
from ...positions.channel import Channel
from ...positions.tolerances import Box, Segment
from .._gate import is_number, path_of, reading
from ..model import Study
from ._bar_or_beam import NominalStructure, nominal_structure, structure
from ._effects import NAME, with_effects
from ._finite_elements import FiniteElementStructure
from ._json_fields import (
    FieldRule,
    JsonObject,
    between,
    check_distinct,
    check_known,
    choice,
    integer,
    load,
    numbers,
)
from ._measurement import RecordedTransducer, settings
from ._runs import Runs, inside, read_runs

SensorOrActuator = TypeVar("SensorOrActuator", Sensor, Actuator)

_SENSOR_SETUPS = {
    "one sensor roved over the positions, one run per position": "roving",
    "all sensors mounted all the time": "fixed",
}


def read(folder: str | Path) -> Study:
    """Read a case: the nominal structure, its uncertainties and the measured FRFs.

    The folder holds `case.json` (SI units) and `measured.uff`, with `measured_level2.uff` and so on
    for each further force level.

    - `structure`: `type` (`axial bar`, or `Euler-Bernoulli beam, bending`), `length_m`, `area_m2`
      of a bar or `width_m` and `height_m` of a rectangular beam, `boundary_conditions`, `motion`,
      `youngs_modulus_Pa`, `density_kg_m3`, `damping` (`model`, `ratio`); `suspension`, a list of
      springs with `x_m` and `stiffness_N_per_m`. It lies along x from 0 to its length.
    - `nominal_fe_model`: null, or a folder with `nominal.npz` (nodes, degrees of freedom, elements,
      modes), `model.json`, `K.npz`, `M.npz` and `K_region_00.npz`, ...: a space frame or a plate.
    - `sensors`, `actuators`: lists with `id`, `uff_node`, `position_m`, `tolerance_m`,
      `directions`, `angle_tolerance_rad`; tolerances are uniform, plus and minus. If wanted,
      `gain_tolerance` and `delay_tolerance_s`: standard deviations of a gain about 1 and of a delay
      about 0.
    - `uncertain_parameters`: a list with `name` (`youngs_modulus_Pa`, `density_kg_m3` or
      `modal_damping_ratio`) and `prior`: `type` `uniform` with `low` and `high`, `normal` with
      `mean` and `standard_deviation`, or `lognormal` with `median` and `log_standard_deviation`.
    - `frequency`: `band_hz`, `n_lines`, the lines of the files that are used.
    - `measurement`: `quantity`, `units`, `convention`, `estimator`, `n_averages`, `out_channels`,
      `in_channels`, `sensor_setup`, `force_levels_N` (null, or one amplitude [N] for each file). If
      wanted, `noise_level`: `ratio` and `floor` of `noise.Relative`, `coherence_factor` on what the
      coherence states; each a number, or [low, high] of a log-uniform distribution. Without it
      the variance that the files state is taken, or else their coherence; without either, the noise
      is unknown: a ratio and a floor of wide priors.
      Other states of the structure, if measured: `baseline_files`, those of an earlier one; or
      `states`, a list of at least two with `label` and `files`, the first one the baseline.
    - `effects`, if the structure has some: a list with `kind`, `candidate`, the number among the
      default candidates of the kind, and `name`; of a network (`attached`, `inserted`, `strut`) in
      the place of `candidate` its `law` as typed and `pieces`, for each of its places the number
      of the piece of the structure that it may be on, and if wanted `motion` and `direction`; as
      `improve --save` writes it.

    Parameters
    ----------
    folder
        The folder of the case.

    Returns
    -------
    Study
        Experiment and measurement; with force levels a tuple of measurements in their order.
        Channels of the files that the case does not name are left out.

    Raises
    ------
    FileNotFoundError
        If the folder or a file is missing.
    CaseError
        (A ValueError.) If a field is missing or wrong, or the files contradict it.

    Examples
    --------
    >>> study = bp.io.case.read("case")  # doctest: +SKIP
    """
    file = inside(path_of(folder), "case.json")
    remedy = "Compare it with help(bp.io.case.read), and correct the field."
    with reading(file, "a case", remedy, is_timed=False):
        return _study(load(file), Path(folder))


def _study(case: JsonObject, folder: Path) -> Study:
    check_known(case)
    nominal = nominal_structure(case)
    sensors, actuators = (
        [_recorded(fields, nominal) for fields in case.objects(side, least=1)]
        for side in ("sensors", "actuators")
    )
    check_distinct("id", [transducer.fields for transducer in (*sensors, *actuators)])
    for side in (sensors, actuators):  # a sensor and an actuator may share a node
        check_distinct("uff_node", [transducer.fields for transducer in side])
    stated = settings(case, sensors, actuators)
    sensor_setup = case.object("measurement").value("sensor_setup", choice(*_SENSOR_SETUPS))
    with_priors = structure(case, nominal, stated.band[1])
    runs = read_runs(folder, stated)
    experiment = Experiment(
        with_priors,
        sensors=[_transducer(Sensor, sensor, nominal) for sensor in sensors],
        actuators=[_transducer(Actuator, actuator, nominal) for actuator in actuators],
        frequency=runs.measured[0].frequency,
        observe=Complex(stated.quantity),
        noise=runs.noise,
        force_levels=stated.force_levels,
        sensors_mounted=_SENSOR_SETUPS[sensor_setup],
    )
    return Study(
        with_effects(experiment, case),
        _by_level(runs.measured, stated.force_levels),
        None,
        {},
        _by_level(runs.baseline, stated.force_levels) if runs.baseline else None,
        {label: _by_level(state, stated.force_levels) for label, state in runs.states.items()},
    )


def _by_level(runs: Runs, levels: tuple[float, ...] | None) -> Measurements:
    return runs[0] if levels is None else runs


def _recorded(fields: JsonObject, nominal: NominalStructure) -> RecordedTransducer:
    name = fields.value("id", NAME)
    node = fields.value("uff_node", integer(1, 1))
    coordinates = tuple(map(float, fields.value("position_m", position_rule(nominal))))
    directions = fields.value("directions", directions_rule(nominal))
    channels = tuple(Channel(name, int(direction)) for direction in directions)
    return RecordedTransducer(fields, channels, node, coordinates)


def _transducer(
    make: Callable[..., SensorOrActuator], recorded: RecordedTransducer, nominal: NominalStructure
) -> SensorOrActuator:
    return make(
        recorded.name,
        at=position(recorded, nominal),
        directions=tuple(channel.direction for channel in recorded.channels),
        angles=angles(recorded, nominal),
        gain=_about(1.0, recorded, "gain_tolerance", "1", 0.01),
        delay=_about(0.0, recorded, "delay_tolerance_s", "s", 1e-6),
    )


def position_rule(nominal: NominalStructure) -> FieldRule:
    """What is allowed as a recorded position."""
    if isinstance(nominal, FiniteElementStructure):
        low, high = nominal.bounds
        return numbers(
            f"three coordinates [m] among the nodes, from {low.tolist()} to {high.tolist()},",
            ((low + high) / 2).tolist(),
            lambda value: bool(np.all(low <= value) and np.all(value <= high)),
        )
    length = nominal.length
    return numbers(
        f"three coordinates [m] on the structure, [x, 0, 0] with x from 0 to {length:g},",
        [0.25 * length, 0.0, 0.0],
        lambda value: 0 <= value[0] <= length and value[1] == value[2] == 0,
    )


def directions_rule(nominal: NominalStructure) -> FieldRule:
    """What is allowed as recorded directions."""
    if isinstance(nominal, FiniteElementStructure):
        axes = nominal.kind.axes
        return FieldRule(
            f"a list of directions in which the structure moves, of {list(axes)} or their "
            "opposites, each once,",
            list(axes),
            lambda value: _are_directions(value, axes),
        )
    direction = nominal.direction
    return numbers(
        f"the direction in which the structure moves, [{direction}] or [{-direction}],",
        [direction],
        lambda value: value in ([direction], [-direction]),
    )


def position(transducer: RecordedTransducer, nominal: NominalStructure) -> At:
    """Position of a transducer with its tolerance; a number where the tolerance is zero."""
    if isinstance(nominal, FiniteElementStructure):
        return Box(transducer.position, within=transducer.fields.value("tolerance_m", _TOLERANCES))
    within, *_ = transducer.fields.value("tolerance_m", _TOLERANCE_ALONG_X)
    recorded = transducer.position[0]
    return Segment(recorded, within=within) if within else recorded


def angles(
    transducer: RecordedTransducer, nominal: NominalStructure
) -> tuple[Parameter, ...] | None:
    """Distributions of the Euler angles [rad]; None where the orientation is exact."""
    rule = between(0.0, np.pi / 2, "rad", 0.1)
    tolerance = transducer.fields.value("angle_tolerance_rad", rule)
    if tolerance == 0:
        return None
    angle = Uniform(-float(tolerance), float(tolerance))
    if isinstance(nominal, FiniteElementStructure) and len(nominal.kind.axes) == 3:
        return (angle, angle, angle)
    # R = Rx Ry Rz projects x on x by cos ty cos tz and z on z by cos tx cos ty: on a structure that
    # moves along one of them, the roll of a transducer about that axis has no influence.
    roll_axis = abs(transducer.channels[0].direction or 0)
    return tuple(0.0 if axis == roll_axis else angle for axis in (1, 2, 3))


def _about(
    exact: float, transducer: RecordedTransducer, field: str, unit: str, example: float
) -> Parameter:
    """Normal distribution about an exact value; the value where no tolerance is stated."""
    if not transducer.fields.has(field):
        return exact
    deviation = float(transducer.fields.value(field, between(0.0, np.inf, unit, example)))
    return Normal(exact, deviation) if deviation else exact


def _are_directions(value: object, axes: tuple[int, ...]) -> bool:
    if not isinstance(value, list) or not value or not all(map(is_number, value)):
        return False
    return set(map(abs, value)) <= set(axes) and len(set(map(abs, value))) == len(value)


_TOLERANCE_ALONG_X = numbers(
    "three tolerances [m] along x, y, z, the last two 0 on a line along x,",
    [0.01, 0.0, 0.0],
    lambda value: value[0] >= 0 and value[1] == value[2] == 0,
)
_TOLERANCES = numbers(
    "three tolerances [m] along x, y, z, not negative,",
    [0.01, 0.0, 0.0],
    lambda value: min(value) >= 0,
)
