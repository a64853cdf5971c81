"""The simulated measurement of the bar: independent, reproducible and exact."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest

from bayes_placement.io import uff
from models import bar_measurement

MODELS = Path(bar_measurement.__file__).parent


@pytest.fixture(scope="module")
def exact():
    frequency = bar_measurement.SPACING * np.arange(1, bar_measurement.LINES + 1)
    return frequency, bar_measurement.accelerance(frequency)


@pytest.mark.long
def test_the_committed_files_are_those_that_the_script_makes(exact, tmp_path, monkeypatch):
    responses = {exact[0].tobytes(): exact[1]}  # solved once for all tests
    monkeypatch.setattr(bar_measurement, "accelerance", lambda lines: responses[lines.tobytes()])
    bar_measurement.main(tmp_path)
    for name in ("bar.uff", "bar_truth.json"):
        assert (tmp_path / name).read_bytes() == (MODELS / name).read_bytes()


def test_the_script_knows_nothing_of_the_package():
    tree = ast.parse(Path(bar_measurement.__file__).read_text())
    imported = {
        (node.module or "" if isinstance(node, ast.ImportFrom) else alias.name).split(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    assert imported <= {"argparse", "json", "numpy", "pathlib", "pyuff", "scipy", "typing"}


@pytest.mark.long
def test_the_mesh_has_converged(exact):
    frequency, response = (values[[0, 37, 76, 99]] for values in exact)  # near two resonances
    finer = bar_measurement.accelerance(frequency, 2 * bar_measurement.ELEMENTS)
    assert np.max(np.abs(response / finer - 1)) < 1e-6


def test_the_solution_is_the_closed_form(exact):
    frequency, response = exact
    order = np.arange(1, 20001)
    natural = order * np.pi * np.sqrt(1e9 / 9000.0)
    ratio = np.where(order == 1, 0.035, np.where(order == 2, 0.047, 0.04))
    shapes = 2 / 9.0 * np.sin(order * np.pi * 0.262) * np.sin(order * np.pi * 0.283)
    omega = 2 * np.pi * frequency[:, None]
    closed = -(omega**2) * shapes / (natural**2 - omega**2 + 2j * ratio * natural * omega)
    assert np.max(np.abs(response / closed.sum(axis=1) - 1)) < 1e-6


def test_the_file_holds_the_noise_that_its_coherence_tells(exact):
    frequency, response = exact
    measured = uff.read(MODELS / "bar.uff")
    variance = measured.noise_variance()[0, 0]
    assert np.allclose(measured.frequency, frequency, rtol=1e-12)
    assert np.allclose(variance, (0.01 * np.abs(response)) ** 2, rtol=1e-5)
    chi_square = np.abs(measured.frf[0, 0] - response) ** 2 / variance
    assert abs(chi_square.mean() - 1) < 5 / np.sqrt(frequency.size)


def test_the_file_records_other_places_than_the_true_ones():
    measurement = uff.read(MODELS / "bar.uff")
    truth = json.loads((MODELS / "bar_truth.json").read_text())
    channels = measurement.sensors + measurement.actuators
    assert [channel.label for channel in channels] == ["s1+x", "a1+x"]
    assert measurement.averages == truth["averages"] == 16
    for transducer in (truth["sensor"], truth["actuator"]):
        recorded, true = measurement.positions[transducer["name"]][0], transducer["true_position_m"]
        assert recorded == transducer["recorded_position_m"]
        assert 0 < abs(recorded - true) < truth["position_tolerance_m"]


def test_the_ten_lines_of_the_paper_were_measured():
    ten = (np.arange(1, 11) - 0.5) * 43.3
    assert np.allclose(uff.read(MODELS / "bar.uff").lines(ten).frequency, ten)
