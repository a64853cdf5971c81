"""Modal parameters on the command line, beside a model of FRFs."""

import json
import re
import shlex

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared import progress as shown_progress
from bayes_placement.cli._inputs import Inputs
from bayes_placement.cli._missing_effects import Request
from bayes_placement.cli._result_folder import ResultFolder
from bayes_placement.cli._run import Output
from bayes_placement.io.model import Study
from tests.cli.test_criticism import run, written
from tests.experiment import modal_bars
from tests.experiment.test_identification import measured

PLACES = (0.12, 0.27, 0.43, 0.81)
MODEL = f"""
import numpyro.distributions as dist
import bayes_placement as bp

modes = bp.beams.bar(
    20, length=1.0, area=1e-3, youngs_modulus=dist.Uniform(0.9e9, 1.1e9), density=9000.0
)
experiment = bp.Experiment(
    bp.Structure(modes, damping=bp.damping.Modal(0.01)),
    sensors=[bp.Sensor(f"s{{n}}", at=at) for n, at in enumerate({PLACES})],
    actuators=[bp.Actuator("a1", at=0.3)],
    frequency=[150.0, 166.0],
    observe=bp.observe.LogAmplitude("velocity"),
    noise=bp.noise.Gaussian(0.05),
)
engine = bp.engines.MAP(starts=4, draws=100)
"""


@pytest.fixture(scope="module")
def modes(tmp_path_factory):
    noise = np.random.default_rng(1)
    mass = {"mass_at": 0.33, "mass": 0.6}
    measured = modal_bars.measured(PLACES, 4, noise=noise, ratio=0.01, **mass)
    return bp.io.modal_parameters.write(measured, tmp_path_factory.mktemp("modes") / "modes.csv")


def test_a_file_of_modes_is_shown(modes, tmp_path):
    done = run("show", modes, "--out", tmp_path, "--json")
    assert done.exit_code == 0, (done.output, done.exception)
    shown = json.loads(done.stdout)
    assert shown["verdict"].startswith("ModalParameters: 4 modes from")
    assert len(shown["result"]["modes"]["natural frequency [Hz]"]) == 4
    assert (tmp_path / "modes.csv").is_file()


def test_a_model_is_shown_with_the_modes_that_are_given(modes, tmp_path):
    done = run("show", written(tmp_path, MODEL), "--data", modes, "--out", tmp_path / "out")
    assert done.exit_code == 0, (done.output, done.exception)
    frequency = bp.io.modal_parameters.read(modes).natural_frequency
    assert done.stdout.startswith(
        f"Experiment: 4 modes from {frequency[0]:g} to {frequency[-1]:g} Hz, shapes at 4 sensor"
    )


def test_modes_at_channels_that_the_model_does_not_know_are_shown_with_what_to_do(modes, tmp_path):
    model = written(tmp_path, MODEL.replace('f"s{n}"', 'f"left{n}"'))
    done = run("show", model, "--data", modes, "--out", tmp_path / "out")
    assert done.exit_code == 0, (done.output, done.exception)
    assert (tmp_path / "out" / "modes.csv").is_file()
    assert (tmp_path / "out" / "geometry.png").is_file()
    words = " ".join(done.output.split())
    assert "left0" in words and "4 modes from" in words
    assert "shapes at s0, s1, s2, s3, but the sensors of the model are left0" in words
    assert "Rename a channel" in words


def test_places_are_not_compared_by_modes(modes, tmp_path):
    done = run("place", written(tmp_path, MODEL), "--data", modes, "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "FRFs are needed, since it compares places by FRFs" in " ".join(done.output.split())


@pytest.mark.parametrize(("declared", "counts"), [("modes", True), ("frfs", False)])
def test_the_baseline_of_a_study_counts_where_it_is_of_modes(modes, tmp_path, declared, counts):
    before = bp.io.modal_parameters.read(modes)
    channels = {"sensors": ["s0"], "actuators": ["a1"], "quantity": "mobility"}
    frfs = bp.Measurement.from_arrays(np.ones((1, 1, 1), complex), [150.0], **channels)
    experiment = modal_bars.experiment(before, PLACES)
    baseline = {"modes": before, "frfs": frfs}[declared]
    study = Study(experiment, before, None, {}, baseline=baseline)
    asked = Request(modes, None, None, Output(ResultFolder(tmp_path, tmp_path)), None)
    assert asked.earlier(study) is (before if counts else None)


@pytest.mark.parametrize(
    ("lines", "kinds", "words"),
    [
        (151, None, "--lines 150 .* or --effects listed .* or --effects point_mass,gain_error"),
        (151, ["point_mass"], r"--lines 150 \(fewer lines\)\."),
        (150, None, "with --effects listed"),
        (None, None, "with --effects listed"),
        (150, ["point_mass"], None),
    ],
)
def test_a_search_that_takes_long_says_early_how_to_shorten_it(
    modes, tmp_path, capsys, monkeypatch, lines, kinds, words
):
    known = bp.io.modal_parameters.read(modes)
    of_modes = modal_bars.experiment(known, PLACES)
    experiment = of_modes if lines is None else bar_of_frfs(lines)
    now = [0.0]
    monkeypatch.setattr(shown_progress.time, "monotonic", lambda: now[-1])

    def searches(*_, progress, **__):
        now.append(60.0)
        progress(0.05)

    output = Output(ResultFolder(tmp_path, tmp_path))
    run = output.begin("improve", tmp_path)
    inputs = Inputs(output.screen, run, Study(experiment, known, None, {}), known, [])
    request = Request(tmp_path, None, kinds, output, None)
    request.searched("improve", searches, inputs, known)
    said = capsys.readouterr().err
    if words is None:
        assert "take long" not in said
    else:
        assert re.search(f"This may take long. To shorten it, .*{words}", said)


def bar_of_frfs(lines):
    bar = bp.beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    return bp.Experiment(
        bp.Structure(bar, damping=bp.damping.Modal(0.02)),
        sensors=[bp.Sensor("s1", at=0.2)],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=np.linspace(100.0, 300.0, lines),
        observe=bp.observe.Complex("velocity"),
        noise=bp.noise.Gaussian(1e-3),
    )


@pytest.mark.long
@pytest.mark.longest
def test_a_model_of_frfs_is_checked_and_completed_by_modes(modes, tmp_path):
    model, saved = written(tmp_path, MODEL), tmp_path / "completed.py"
    done = run("check", model, "--data", modes, "--out", tmp_path / "check")
    assert done.exit_code == 1, (done.output, done.exception)
    assert "Modes: all 4 that were measured." in done.output
    assert {"modes.png", "misfit.csv"} <= {path.name for path in (tmp_path / "check").iterdir()}
    words = ("--effects", "point_mass", "--out", tmp_path / "improve", "--save", saved, "--report")
    done = run("improve", model, "--data", modes, *words)
    assert done.exit_code == 0, (done.output, done.exception)
    assert "Missing: point_mass" in done.output
    page = (tmp_path / "improve" / "report.html").read_text()
    assert "Similarity of mode shapes" in page
    study = bp.io.model.read(saved)
    assert study.experiment.observe.is_modal
    assert [effect.name for effect in study.experiment.effects] == ["point_mass"]


def test_modes_of_frfs_are_identified_and_read_again(tmp_path):
    file, out = tmp_path / "measured.uff", tmp_path / "first run"
    bp.io.uff.write(file, measured(seed=0), binary=True)
    done = run("identify", file, "--out", out)
    assert done.exit_code == 0, done.output
    assert "ModalParameters: 3 modes from 166." in done.output
    assert f"--data {shlex.quote(str(out / 'modes.npz'))}" in " ".join(done.output.split())
    read = bp.io.modal_parameters.read(out / "modes.npz")
    expected = bp.identify(bp.io.read_measurement(file))
    np.testing.assert_allclose(read.covariance, expected.covariance)
    assert json.loads((out / "run.json").read_text())["identify"]["files"] == [
        "frequencies_and_damping.csv",
        "modes.npz",
    ]
