"""Masses on the bar of the README, measured by finite elements apart from this package."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects, improve
from tests.simulator.fine_elements import Line
from tests.simulator.hidden_structures import Instrument, accelerance, record

LINES = np.linspace(20.0, 900.0, 300)
SENSORS = {"s1": (0.16, 0.148), "s2": (0.47, 0.482), "s3": (0.71, 0.722)}
"""Recorded and true place [m]."""

KINDS = ["point_mass", "ground_spring", "local_stiffness_loss", "gain_error", "time_delay"]


def experiment():
    modes = bp.beams.bar(
        60, length=1.0, area=1e-3, youngs_modulus=dist.Uniform(0.92e9, 1.08e9), density=9000.0
    )
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.02, 0.08))),
        sensors=[
            bp.Sensor(name, at=bp.positions.Segment(recorded, within=0.03))
            for name, (recorded, _) in SENSORS.items()
        ],
        actuators=[bp.Actuator("a1", at=bp.positions.Segment(0.25, within=0.03))],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
    )


def measured(masses, seed):
    """FRFs of the bar with masses [kg] by place [m], with noise of 1 %."""
    true = Line("bar", "fixed-fixed", 1.0, 1e-3, 1.02e9, 9000.0, 0.045, attached=masses)
    sensors = [Instrument(name, at, 0.03, 1, true) for name, (at, true) in SENSORS.items()]
    exact = accelerance(true, sensors, [Instrument("a1", 0.25, 0.03, 1, 0.262)], LINES)
    taken = record(exact, LINES, np.random.default_rng(seed))
    return bp.Measurement.from_arrays(
        taken.frf,
        LINES,
        sensors=experiment().sensor_channels,
        actuators=experiment().actuator_channels,
        quantity="accelerance",
        coherence=taken.coherence,
        averages=taken.averages,
    )


@pytest.mark.long
@pytest.mark.parametrize(
    "masses",
    [
        ((0.37, 0.54),),
        pytest.param(((0.37, 0.4), (0.8, 0.6)), marks=pytest.mark.longest),
        pytest.param(((0.2, 0.4), (0.45, 0.3), (0.8, 0.6)), marks=pytest.mark.longest),
    ],
    ids=["one", "two", "three"],
)
def test_as_many_masses_are_claimed_as_are_hidden(masses):
    setup = experiment()
    candidates = effects.library(setup, KINDS)
    ledger = improve(setup, measured(masses, seed=len(masses)), candidates=candidates)
    assert ledger.verdict == ("point_mass",) * len(masses)
    assert ledger.steps[-1].chi2_per_datum == pytest.approx(1.0, abs=0.15)
    assert not ledger.unexplained
    located = ledger.places
    found = sorted((at, name) for name, at in located.items())
    for (at, name), (place, mass) in zip(found, masses, strict=True):
        assert at == pytest.approx(place, abs=1e-3)
        estimate = ledger.steps[-1].parameters[f"structure.effects.{name}.mass"]
        assert estimate.mean == pytest.approx(mass, rel=0.01)
        # The text has the values of all together, not those of each when it was added.
        assert f"{name}: {ledger.steps[-1].described(name)}"[:30] in str(ledger)
