"""Faults of single hits of a roved hammer are told apart and named by the hit."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects, improve
from bayes_placement._shared.compiled import compiled

LINES = np.linspace(40.0, 900.0, 50)
HITS = {"h1": 0.13, "h2": 0.34, "h3": 0.52, "h4": 0.77}
COHERENCE, AVERAGES = 0.997, 8
KINDS = [
    "point_mass",
    "gain_error",
    "reversed_channel",
    "channel_delay",
    "misplaced_actuator",
    "swapped_actuators",
    "frequency_drift",
]
FURTHER = [pytest.mark.long, pytest.mark.longest]


def experiment():
    modes = bp.beams.bar(
        8, length=1.0, area=1e-3, youngs_modulus=dist.Uniform(0.95e9, 1.05e9), density=9000.0
    )
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.03)),
        sensors=[bp.Sensor("s1", at=0.613)],
        actuators=[bp.Actuator(name, at=x) for name, x in HITS.items()],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
    )


def measured(hidden):
    true = experiment().fix({"structure.modes.youngs_modulus": 1.01e9}) + hidden
    exact = np.asarray(compiled(bp.Experiment.frf)(true))
    size = np.abs(exact) * np.sqrt((1 - COHERENCE) / (AVERAGES * COHERENCE) / 2)
    random = np.random.default_rng(3)
    error = random.standard_normal(exact.shape) + 1j * random.standard_normal(exact.shape)
    return bp.Measurement.from_arrays(
        exact + size * error,
        LINES,
        sensors=true.sensor_channels,
        actuators=true.actuator_channels,
        quantity="accelerance",
        coherence=np.full(exact.shape, COHERENCE),
        averages=AVERAGES,
    )


@pytest.mark.parametrize(
    ("hidden", "words"),
    [
        pytest.param(
            effects.reversed_channel("h3"),
            "reversed_channel, actuator h3 (prob",
            marks=FURTHER,
        ),
        pytest.param(
            effects.gain_error("h2", 8.81),
            "gain_error, actuator h2, 880.7 %, a factor of 9.81, as of m/s² for g (prob",
            marks=pytest.mark.long,
        ),
        pytest.param(
            effects.gain_error("h4", 999.0),
            "a factor of 1000,",
            marks=FURTHER,
        ),
        pytest.param(
            effects.channel_delay("h1", 1e-4),
            "channel_delay, actuator h1",
            marks=FURTHER,
        ),
        pytest.param(
            effects.misplaced_actuator("h2", 0.06),
            "misplaced_actuator, actuator h2",
            marks=FURTHER,
        ),
        pytest.param(
            effects.swapped_actuators("h1", "h4"),
            "swapped_actuators, actuators h1 and h4",
            marks=FURTHER,
        ),
        pytest.param(
            effects.frequency_drift("h4", -0.008),
            "frequency_drift, actuator h4",
            marks=FURTHER,
        ),
    ],
    ids=lambda value: getattr(value, "name", ""),
)
def test_the_fault_of_a_hit_is_named(hidden, words):
    setup = experiment()
    ledger = improve(setup, measured(hidden), candidates=effects.library(setup, KINDS))
    assert ledger.verdict == (hidden.name,)
    assert words in ledger.sentence()
