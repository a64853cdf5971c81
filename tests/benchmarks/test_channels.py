"""Benchmark: `improve` with more and more channels, and lines: seconds, cores and memory.

Run with `python -m pytest tests/benchmarks/test_channels.py -n 0`; `-m long` adds the largest.
"""

import json
import os
import time

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from models import hidden_effect
from tests.benchmarks.all_processes import taken_by
from tests.benchmarks.page import at_most

MODULE = "tests.benchmarks.test_channels"
LINES, SECONDS, MEMORY, LINEAR = 200, {48: 120.0, 192: 480.0}, 2.0, 1.0
"""Lines, and what is asked: seconds by channels, GiB, exponent of growth."""

TRUTH = {
    "structure.modes.youngs_modulus": 1.02e9,
    "structure.damping.ratio": 0.03,
    "actuator.a1.position": 0.263,
}
FARTHEST = 0.02
"""Distance of a sensor from its recorded place, at most [m]."""

LARGEST = pytest.param((48, 192), marks=pytest.mark.long)


@pytest.fixture(scope="module")
def taken(tmp_path_factory):
    """What `improve` takes with so many channels and lines, measured once."""
    known = {}

    def of(channels, lines=LINES):
        if (channels, lines) not in known:
            variables = {"CHANNELS": str(channels), "LINES": str(lines)}
            known[channels, lines] = taken_by(MODULE, tmp_path_factory.mktemp("caches"), variables)
            assert known[channels, lines].told["verdict"] == ["point_mass"]
        return known[channels, lines]

    return of


@pytest.mark.parametrize("channels", [(3, 12), (12, 48), LARGEST])
def test_growth_with_channels(taken, channels, page):
    fewer, more = map(taken, channels)
    name = f"improve, {channels[1]} channels x {LINES} lines"
    page.add(name, more.wall, "s", at_most(SECONDS.get(channels[1], np.inf)))
    page.add(f"{name}: time of all cores", more.cores, "s")
    page.add(f"{name}: memory of all processes", more.memory, "GiB", at_most(MEMORY))
    exponent = np.log(more.cores / fewer.cores) / np.log(channels[1] / channels[0])
    page.add(f"{name}: exponent of growth from {channels[0]}", exponent, "", at_most(LINEAR))


@pytest.mark.parametrize("lines", [(200, 800), pytest.param((800, 3200), marks=pytest.mark.long)])
def test_growth_with_lines(taken, lines, page):
    fewer, more = (taken(12, each) for each in lines)
    name = f"improve, 12 channels x {lines[1]} lines"
    page.add(f"{name}: time of all cores", more.cores, "s")
    exponent = np.log(more.cores / fewer.cores) / np.log(lines[1] / lines[0])
    page.add(f"{name}: exponent of growth from {lines[0]}", exponent, "", at_most(LINEAR))


def asked(channels, lines):
    """A bar with many sensors, and data of the same bar with a mass that its model lacks."""
    places = dict(enumerate(np.linspace(0.06, 0.94, channels).tolist(), start=1))
    experiment = bp.Experiment(
        hidden_effect.bar(),
        sensors=[
            bp.Sensor(f"s{number}", at=bp.positions.Segment(place, within=0.03))
            for number, place in places.items()
        ],
        actuators=[bp.Actuator("a1", at=bp.positions.Segment(0.25, within=0.03))],
        frequency=np.linspace(5.0, 1000.0, lines),
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromVariance(),
    )
    random = np.random.default_rng(0)
    where = {
        f"sensor.s{number}.position": place + random.uniform(-FARTHEST, FARTHEST)
        for number, place in places.items()
    }
    exact = np.asarray(
        compiled(bp.Experiment.frf)(
            experiment.fix(TRUTH | where) + bp.effects.point_mass(0.63, 0.12)
        )
    )
    variance = (0.02 * np.abs(exact)) ** 2
    noise = random.standard_normal((2, *exact.shape)) * np.sqrt(variance / 2)
    measurement = bp.Measurement.from_arrays(
        exact + noise[0] + 1j * noise[1],
        experiment.frequency,
        sensors=experiment.sensor_channels,
        actuators=experiment.actuator_channels,
        quantity="accelerance",
        variance=variance,
    )
    return experiment, measurement


def improved():
    """Verdict and seconds of `improve` alone."""
    experiment, measurement = asked(int(os.environ["CHANNELS"]), int(os.environ["LINES"]))
    began = time.perf_counter()
    ledger = bp.improve(experiment, measurement)
    return {"verdict": list(ledger.verdict), "seconds": time.perf_counter() - began}


if __name__ == "__main__":
    print(json.dumps(improved()))
