"""A bar of few modes and lines, with and without hidden effects, that compiles fast."""

import dataclasses

import numpy as np
import numpyro.distributions as dist

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._shared.compiled import compiled

LINES = np.linspace(30.0, 700.0, 60)
TRUTH = {
    "structure.modes.youngs_modulus": 1.02e9,
    "structure.damping.ratio": 0.035,
    "sensor.s1.position": 0.237,
    "sensor.s2.position": 0.618,
    "actuator.a1.position": 0.411,
}


def experiment(**settings):
    modes = bp.beams.bar(
        12, length=1.0, area=1e-3, youngs_modulus=dist.Uniform(0.95e9, 1.05e9), density=9000.0
    )
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.02, 0.06))),
        sensors=[
            bp.Sensor("s1", at=bp.positions.Segment(0.24, within=0.02)),
            bp.Sensor("s2", at=bp.positions.Segment(0.61, within=0.02)),
        ],
        actuators=[bp.Actuator("a1", at=bp.positions.Segment(0.40, within=0.02))],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
        **settings,
    )


def measured(*hidden, seed=0, averages=32, coherence=0.997):
    """Measurement of the true bar with hidden effects, with noise as its coherence says."""
    true = experiment().fix(TRUTH)
    for effect in hidden:
        true = true + effect
    return recorded(true, seed, averages, coherence)


def recorded(true, seed, averages=32, coherence=0.997):
    """Measurement of a concrete experiment, with noise as its coherence says."""
    exact = np.asarray(compiled(bp.Experiment.frf)(true))
    variance = np.abs(exact) ** 2 * (1 - coherence) / (averages * coherence)
    random = np.random.default_rng(seed)
    noise = random.standard_normal((2, *exact.shape)) * np.sqrt(variance / 2)
    return bp.Measurement.from_arrays(
        exact + noise[0] + 1j * noise[1],
        LINES,
        sensors=true.sensor_channels,
        actuators=true.actuator_channels,
        quantity="accelerance",
        coherence=np.full(exact.shape, coherence),
        averages=averages,
    )


def without_coherence(measurement):
    return dataclasses.replace(measurement, coherence=None, averages=None)


MASS = effects.point_mass(0.313, 0.35)
GAIN = effects.gain_error("s2", -0.06)
