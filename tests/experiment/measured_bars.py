"""Bars and beams with the measurements that their nominal models give, for checks of the data."""

import dataclasses

import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled

LINES = np.linspace(20.0, 900.0, 250)
FREE_LINES = np.linspace(4.0, 300.0, 250)


def bar(sensors, actuators, ends="fixed-fixed"):
    modes = bp.beams.bar(12, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0, ends=ends)
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.01, 0.03))),
        sensors=sensors,
        actuators=actuators,
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
    )


def exchanged():
    """Two places, each with a sensor and an actuator, the second along the other direction."""
    sensors = [bp.Sensor("s1", at=0.23), bp.Sensor("s2", at=0.61, directions=(-1,))]
    return bar(sensors, [bp.Actuator("a1", at=0.23), bp.Actuator("a2", at=0.61)])


def free_beam(modulus=1.0):
    modes = bp.beams.beam(
        12,
        length=1.0,
        area=3e-4,
        second_moment=2.5e-9,
        youngs_modulus=dist.Uniform(2.0e11 * modulus, 2.2e11 * modulus),
        density=7850.0,
        ends="free-free",
    )
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.01)),
        sensors=[
            bp.Sensor("s1", at=bp.positions.Segment(0.05, within=0.01)),
            bp.Sensor("s2", at=0.45),
        ],
        actuators=[bp.Actuator("a1", at=bp.positions.Segment(0.95, within=0.01))],
        frequency=FREE_LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
    )


def measured(experiment, *, seed=0, averages=20, quantity="accelerance"):
    """Measurement of the nominal experiment, with noise as its coherence says."""
    exact = np.asarray(compiled(bp.Experiment.frf)(experiment.nominal()))
    random = np.random.default_rng(seed)
    coherence = random.uniform(0.97, 0.999, exact.shape)
    deviation = np.abs(exact) * np.sqrt((1 - coherence) / (2 * averages * coherence))
    noise = random.standard_normal((2, *exact.shape)) * deviation
    return bp.Measurement.from_arrays(
        exact + noise[0] + 1j * noise[1],
        experiment.frequency,
        sensors=experiment.sensor_channels,
        actuators=experiment.actuator_channels,
        quantity="accelerance",
        coherence=coherence,
        averages=averages,
    ).converted(quantity)


def changed(measurement, factor, row=0, column=0):
    """The measurement with one pair multiplied by a factor, or by one for each line."""
    frf = np.array(measurement.frf)
    frf[row, column] *= factor
    return dataclasses.replace(measurement, frf=frf)


def kinds(checks):
    return [name for name, faults in checks.faults.items() if faults]
