"""Experiments and their data from draws of the independent simulator."""

import numpyro.distributions as dist

import bayes_placement as bp
from bayes_placement import effects

FIELDS = {
    "youngs_modulus": "youngs_modulus",
    "density": "density",
    "damping_ratio": "damping_ratio",
}
MODES = {"bar": 40, "beam": 30}


def experiment_of(drawn):
    """Return what the engineer would declare, and what was measured."""
    line = drawn.nominal
    distributions = {name: dist.Uniform(*bounds) for name, bounds in drawn.priors.items()}
    unknown = set(distributions) - set(FIELDS)
    assert not unknown, unknown
    value = {name: distributions.get(name, getattr(line, name)) for name in FIELDS}
    section = {"length": line.length, "area": line.area, "ends": line.ends}
    material = {"youngs_modulus": value["youngs_modulus"], "density": value["density"]}
    if line.kind == "bar":
        modes = bp.beams.bar(MODES["bar"], **section, **material)
    else:
        modes = bp.beams.beam(
            MODES["beam"], **section, **material, second_moment=line.second_moment
        )
    structure = bp.Structure(modes, damping=bp.damping.Modal(value["damping_ratio"]))
    for number, (place, stiffness) in enumerate(line.suspension, start=1):
        structure = structure + effects.ground_spring(place, stiffness, name=f"suspension_{number}")
    levels = [record.force_level for record in drawn.records]
    known = levels[0] is not None
    experiment = bp.Experiment(
        structure,
        sensors=[_placed(bp.Sensor, instrument) for instrument in drawn.sensors],
        actuators=[_placed(bp.Actuator, instrument) for instrument in drawn.actuators],
        frequency=drawn.records[0].frequency,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
        force_levels=levels if known else None,
        sensors_mounted=_mounting(drawn.hidden),
    )
    measured = [measurement_of(experiment, record) for record in drawn.records]
    return experiment, measured if known else measured[0]


def _placed(kind, instrument):
    at = bp.positions.Segment(instrument.recorded, within=instrument.within)
    return kind(instrument.name, at=at, directions=(instrument.direction,))


def measurement_of(experiment, record):
    return bp.Measurement.from_arrays(
        record.frf,
        record.frequency,
        sensors=experiment.sensor_channels,
        actuators=experiment.actuator_channels,
        quantity="accelerance",
        coherence=record.coherence,
        averages=record.averages,
        force_level=record.force_level,
    )


def _mounting(hidden):
    roving = hidden.name != "sensor_mass" or hidden["roving"]
    return "roving" if roving else "fixed"
