"""The simulated bar with a forgotten clamp: independent, reproducible and exact."""

import ast
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyuff

from bayes_placement.io import uff
from models import bar_measurement, hidden_effect
from models import hidden_effect_measurement as script
from tests.simulator.hidden_structures import (
    NOTHING,
    Instrument,
    Line,
    accelerance,
    deviation,
    effect,
)

MODELS = Path(script.__file__).parent


@pytest.fixture(scope="module")
def exact():
    return script.accelerance(script.FREQUENCY)


@pytest.fixture(scope="module")
def made(exact, tmp_path_factory):
    folder = tmp_path_factory.mktemp("made")
    responses = {script.FREQUENCY.tobytes(): exact}  # solved once for all tests
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(script, "accelerance", lambda lines: responses[lines.tobytes()])
        script.main(folder)
    return folder


@pytest.mark.long
def test_the_committed_truth_is_the_one_that_the_script_tells(made):
    name = "hidden_effect_truth.json"
    assert (made / name).read_bytes() == (MODELS / name).read_bytes()


@pytest.mark.long
def test_the_committed_measurement_is_the_one_that_the_script_makes(made):
    ours, theirs = (
        pyuff.UFF(str(folder / "hidden_effect.uff")).read_sets() for folder in (made, MODELS)
    )
    assert len(ours) == len(theirs) == 2 + 2 * len(script.SENSORS)
    for dataset, other in zip(ours, theirs, strict=True):
        # A rounded value may fall either way where linear algebra libraries differ.
        if dataset["type"] == 58:
            np.testing.assert_allclose(dataset.pop("data"), other.pop("data"), rtol=1e-5)
        np.testing.assert_equal(dataset, other)


def test_the_script_knows_nothing_of_the_package():
    tree = ast.parse(Path(script.__file__).read_text())
    imported = {
        (node.module or "" if isinstance(node, ast.ImportFrom) else alias.name).split(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    ours = {"models", "bar_measurement"}
    assert imported <= {"argparse", "json", "numpy", "pathlib", "pyuff", "scipy", "typing"} | ours


def test_it_also_runs_as_a_script_from_anywhere(tmp_path):
    words = [sys.executable, script.__file__, "--help"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert "a bar with a clamp left on it" in done.stdout


@pytest.mark.long
def test_the_mesh_has_converged(exact):
    lines = [5, 70, 135, -1]
    finer = script.accelerance(script.FREQUENCY[lines], 2 * bar_measurement.ELEMENTS)
    assert np.max(np.abs(exact[:, lines] / finer - 1)) < 2e-4


@pytest.mark.parametrize("clamped", [True, False])
def test_another_simulator_agrees(exact, clamped):
    line = Line("bar", "fixed-fixed", 1.0, 1e-3, 1.03e9, 9000.0, 0.03)
    sensors = [Instrument(f"s{n}", x, 0.03, 1, x) for n, x in enumerate([0.172, 0.455, 0.728])]
    clamp = effect("point_mass", at=0.37, mass=0.54) if clamped else NOTHING
    actuator = Instrument("a1", 0.233, 0.03, 1, 0.233)
    other = accelerance(line, sensors, [actuator], script.FREQUENCY, clamp)[:, 0]
    chi2 = np.mean(np.abs(other - exact) ** 2 / deviation(exact) ** 2)
    assert chi2 < 0.01 if clamped else chi2 > 100


def test_the_file_holds_the_noise_that_its_coherence_tells(exact):
    measurement = uff.read(MODELS / "hidden_effect.uff").converted("accelerance")
    level = np.sqrt(np.mean(np.abs(exact) ** 2, axis=1, keepdims=True))
    expected = (0.01 * np.maximum(np.abs(exact), 0.05 * level)) ** 2
    variance = measurement.noise_variance()[:, 0]
    assert np.allclose(measurement.frequency, script.FREQUENCY, rtol=1e-12)
    assert np.allclose(variance, expected, rtol=1e-5)
    chi_square = np.abs(measurement.frf[:, 0] - exact) ** 2 / variance
    assert abs(chi_square.mean() - 1) < 5 / np.sqrt(chi_square.size)


def test_the_file_records_other_places_than_the_true_ones():
    measurement = hidden_effect.measurement
    truth = json.loads((MODELS / "hidden_effect_truth.json").read_text())
    labels = [channel.label for channel in measurement.sensors + measurement.actuators]
    assert labels == ["s1+x", "s2+x", "s3+x", "a1+x"]
    assert measurement.averages == truth["averages"] == 32
    for transducer in (*truth["sensors"], truth["actuator"]):
        name, true = transducer["name"], transducer["true_position_m"]
        recorded = measurement.positions[name][0]
        assert recorded == transducer["recorded_position_m"] == hidden_effect.PLACES[name]
        assert 0 < abs(recorded - true) < truth["position_tolerance_m"]


def test_the_study_says_nothing_of_the_clamp_and_knows_the_rest():
    table = str(hidden_effect.experiment)
    assert "mass" not in table.lower()
    assert all(name in table for name in hidden_effect.truth)
    assert len(hidden_effect.truth) == 6
