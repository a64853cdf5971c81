"""The same data described otherwise have the same answer, and a few lines less nearly the same."""

import dataclasses
import tempfile
from pathlib import Path

import numpy as np
import pytest

import bayes_placement as bp
from tests.criticism.small import LINES, MASS, experiment, measured

pytestmark = pytest.mark.long

KINDS = ["point_mass", "gain_error", "ground_spring"]
EVERY = 20
"""One line of so many is left out."""


def permuted(model, data):
    """Sensors in another order, in the model and in the data."""
    return rebuilt(model, sensors=[*model.sensor.values()][::-1]), data.channels(
        ["s2+x", "s1+x"], ["a1+x"]
    )


def in_other_units(model, data):
    """FRFs as receptances."""
    return model, data.converted("receptance")


def in_millimetres(model, data):
    """FRFs in (mm/s²)/N in a file, of which a mapping says so."""
    with tempfile.TemporaryDirectory() as folder:
        np.savez(Path(folder, "a.npz"), H=1e3 * data.frf, f=LINES, C=data.coherence)
        path = Path(folder, "a.toml")
        path.write_text(
            'file = "a.npz"\nsensors = ["s1+x", "s2+x"]\nactuators = ["a1+x"]\ncoherence = "C"\n'
            'frf = { array = "H", axes = ["sensor", "actuator", "frequency"], unit = "mm/s²/N" }\n'
            f'frequency = {{ array = "f", unit = "Hz" }}\naverages = {data.averages}\n'
        )
        return model, bp.io.read_measurement(path)


def from_the_other_end(model, data):
    """Places are counted from the other end of the bar, which is held at both."""
    at = {
        name: bp.positions.Segment(1.0 - one.recorded, within=0.02)
        for name, one in {**model.sensor, **model.actuator}.items()
    }
    sensors = [bp.Sensor(name, at=at[name]) for name in model.sensor]
    actuators = [bp.Actuator(name, at=at[name]) for name in model.actuator]
    return rebuilt(model, sensors=sensors, actuators=actuators), data


def mirrored(model, data):
    """A sensor that was mounted the other way round, and says so."""
    flipped = [bp.Channel("s1", -1), bp.Channel("s2", 1)]
    signs = np.array([-1.0, 1.0])[:, None, None]
    return model, dataclasses.replace(data, frf=data.frf * signs, sensors=tuple(flipped))


def merged(model, data):
    """Files of one sensor each, merged."""
    parts = [data.channels([label], ["a1+x"]) for label in ("s2+x", "s1+x")]
    return model, bp.Measurement.from_arrays(
        np.concatenate([part.frf for part in parts]),
        LINES,
        sensors=[channel for part in parts for channel in part.sensors],
        actuators=data.actuators,
        quantity=data.quantity,
        coherence=np.concatenate([part.coherence for part in parts]),
        averages=data.averages,
    )


def with_fewer_lines(model, data):
    """One line of twenty less."""
    kept = np.delete(LINES, np.arange(7, LINES.size, EVERY))
    return rebuilt(model, frequency=kept), data.lines(kept)


def with_a_noisy_channel(model, data):
    """A further sensor channel of noise, as of a cable that is not connected, which is not used."""
    random = np.random.default_rng(6)
    noise = random.normal(size=(1, 1, LINES.size)) + 1j * random.normal(size=(1, 1, LINES.size))
    frf = np.concatenate([data.frf, noise])
    coherence = np.concatenate([data.coherence, np.full_like(data.coherence[:1], 0.03)])
    sensors = (*data.sensors, bp.Channel("loose", 1))
    return model, dataclasses.replace(
        data, frf=frf, coherence=coherence, sensors=sensors, coherent_variance=None
    )


def rebuilt(model, **changed):
    given = {
        "sensors": [*model.sensor.values()],
        "actuators": [*model.actuator.values()],
        "frequency": LINES,
        "observe": model.observe,
        "noise": model.noise,
    }
    return bp.Experiment(model.structure, **given | changed)


def answer(model, data):
    candidates = bp.effects.library(model, KINDS)
    ledger = bp.improve(model, data, candidates=candidates, model_error=None)
    place = ledger.steps[-1].values.get("structure.effects.point_mass.at")
    return ledger.verdict, None if place is None else float(place)


@pytest.fixture(scope="module")
def as_given():
    return answer(experiment(), measured(MASS))


@pytest.mark.parametrize(
    "description",
    [
        permuted,
        in_other_units,
        mirrored,
        with_fewer_lines,
        *(
            pytest.param(further, marks=pytest.mark.longest)
            for further in (in_millimetres, from_the_other_end, merged, with_a_noisy_channel)
        ),
    ],
)
def test_another_description_has_the_same_answer(description, as_given):
    verdict, place = answer(*description(experiment(), measured(MASS)))
    assert verdict == as_given[0] == ("point_mass",)
    place = 1.0 - place if description is from_the_other_end else place
    assert place == pytest.approx(as_given[1], abs=1e-3)
