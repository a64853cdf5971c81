"""From the time records of a simulated hammer test to the variance of its FRFs and to a verdict."""

import ast
from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

import bayes_placement as bp
from bayes_placement.experiment._noise_level import by_coherence
from models import hammer_test, hidden_effect
from models import hammer_test_measurement as script
from models import hidden_effect_measurement as clamped

FOLDER = Path(script.__file__).parent
NOTHING = {"mass_kg": 0.0, "position_m": 0.37}
MASS, PLACE = (clamped.CLAMP[name] for name in ("mass_kg", "position_m"))
SINGLE = [number for number in range(script.HITS) if number != script.DOUBLE]


@pytest.fixture(scope="module")
def hits():
    return script.hits()


@pytest.fixture(scope="module")
def single(hits):
    return [hits[number] for number in SINGLE]


@pytest.fixture(scope="module")
def plain():
    hits = script.hits(NOTHING)
    return [hits[number] for number in SINGLE]


def estimated(records, seed, window=None):
    """Estimate from one long record of hits."""
    force, response = script.measured(records, seed)
    return bp.time_records.frf(
        force,
        dict(zip(("s1", "s2", "s3"), response, strict=True)),
        script.RATE,
        excitation=bp.time_records.Impacts(duration=0.25, before=0.008, time_constant=window),
        actuator="a1",
        quantity="acceleration",
        band=(20.0, 1000.0),
    )


@pytest.mark.long
def test_the_committed_file_is_the_one_that_the_script_makes(hits, tmp_path, monkeypatch):
    monkeypatch.setattr(script, "hits", lambda: hits)
    script.main(tmp_path)
    (rate, ours), (_, theirs) = (
        wavfile.read(folder / "hammer_test.wav") for folder in (tmp_path, FOLDER)
    )
    assert rate == script.RATE
    # A rounded value may fall either way where linear algebra libraries differ.
    assert np.abs(ours.astype(int) - theirs).max() <= 1


def test_the_script_knows_nothing_of_the_package():
    tree = ast.parse(Path(script.__file__).read_text())
    imported = {
        (node.module or "" if isinstance(node, ast.ImportFrom) else alias.name).split(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    ours = {"models", "bar_measurement", "hidden_effect_measurement"}
    assert imported <= {"argparse", "collections", "numpy", "pathlib", "scipy", "typing"} | ours


def test_the_integrated_bar_has_the_frf_of_a_direct_solution(single):
    random = np.random.default_rng(0)
    response = np.array([hit.response for hit in single[:3]]).swapaxes(0, 1)
    # Without noise all that differs from hit to hit is smooth along the lines.
    with pytest.warns(bp.time_records.EstimateWarning, match="alike in neighbouring lines"):
        measurement = bp.time_records.frf(
            [hit.force for hit in single[:3]],
            list(response + 1e-9 * random.standard_normal(response.shape)),
            script.RATE,
            excitation=bp.time_records.Impacts(),
            sensors=["s1", "s2", "s3"],
            actuator="a1",
            quantity="acceleration",
            band=(20.0, 1000.0),
        ).measurement
    chosen = measurement.lines(measurement.frequency[::16])
    exact = clamped.accelerance(chosen.frequency)
    error = np.abs(chosen.frf[:, 0] - exact)
    assert np.median(error / np.abs(exact)) < 0.001
    assert error.max() < 0.002 * np.abs(exact).max()


def test_the_file_is_read_and_the_double_hit_left_out():
    estimate = hammer_test.estimate
    assert estimate.repeats == len(SINGLE)
    (sentence,) = estimate.left_out
    assert "Hit 4 of 7 is left out: the hammer hit twice, again at 0.862" in sentence
    chosen = hammer_test.measurement.lines(hammer_test.measurement.frequency[::8])
    exact = clamped.accelerance(chosen.frequency)
    squares = np.abs(chosen.frf[:, 0] - exact) ** 2 / chosen.variance[:, 0]
    assert abs(squares.mean() - 1) < 5 / np.sqrt(squares.size)


@pytest.mark.long
def test_the_variance_is_that_of_repeated_tests(single):
    tests = 200
    runs = [estimated(single, seed) for seed in range(tests)]
    frf = np.array([run.measurement.frf for run in runs])
    truth = np.sum(np.abs(frf - frf.mean(axis=0)) ** 2, axis=0) / (tests - 1)
    each = np.array([run.measurement.variance for run in runs])
    ratio = truth / each.mean(axis=0)
    assert np.median(ratio) == pytest.approx(1.0, abs=0.03)
    assert np.all(np.abs(ratio - 1) < 0.2 + 3.5 / np.sqrt(tests))
    in_bands = [block.mean(axis=-1) for block in np.array_split(ratio, 24, axis=-1)]
    assert np.all(np.abs(np.array(in_bands) - 1) < 0.2)
    # What one test says of its own lines, which is all that a user has.
    assert np.mean(np.abs(each / truth - 1) < 0.2) > 0.75
    alone = np.array([run.scatter for run in runs])
    assert np.mean(np.abs(alone / truth - 1) < 0.2) < 0.4


def test_a_right_model_has_a_chi2_of_1(single):
    runs = [estimated(single, seed).measurement for seed in range(20)]
    others = [estimated(single, seed).measurement.frf for seed in range(100, 180)]
    reference = np.mean(others, axis=0)

    def chi2(variances):
        pairs = zip(runs, variances, strict=True)
        return np.mean([np.mean(np.abs(run.frf - reference) ** 2 / size) for run, size in pairs])

    share = 1 + 1 / len(others)  # the reference has noise of its own
    assert chi2([run.stated_variance() for run in runs]) / share == pytest.approx(1.0, abs=0.05)
    # Six repeats know the variance of a line by its coherence badly, 6 / (6 - 2), but not of many.
    assert chi2([by_coherence(run) for run in runs]) / share == pytest.approx(1.5, abs=0.1)
    assert chi2([run.noise_variance() for run in runs]) / share == pytest.approx(1.0, abs=0.05)


@pytest.mark.long
def test_the_clamp_is_named_from_the_time_records():
    frequency = hammer_test.measurement.thinned(100).frequency
    setup = experiment(frequency)
    candidates = bp.effects.library(setup, KINDS)
    ledger = bp.improve(setup, hammer_test.measurement, candidates=candidates)
    assert ledger.verdict == ("point_mass",)
    assert ledger.probabilities["point_mass"] > 0.95
    first = ledger.steps[0]
    assert np.nanmax([first.chi2_per_datum, first.chi2_when_exact]) > 100
    parameters = ledger.steps[-1].parameters
    assert parameters["structure.effects.point_mass.mass"].mean == pytest.approx(MASS, rel=0.01)
    assert parameters["structure.effects.point_mass.at"].mean == pytest.approx(PLACE, abs=0.001)
    assert ledger.steps[-1].chi2_per_datum == pytest.approx(1.0, abs=0.15)


def experiment(frequency):
    """The experiment of the study at other lines."""
    stated = hammer_test.experiment
    return bp.Experiment(
        stated.structure,
        sensors=list(stated.sensor.values()),
        actuators=list(stated.actuator.values()),
        frequency=frequency,
        observe=stated.observe,
        noise=stated.noise,
    )


KINDS = ["point_mass", "ground_spring", "compliant_support", "gain_error", "exponential_window"]


@pytest.mark.long
@pytest.mark.longest
def test_nothing_is_missing_where_nothing_is(plain):
    measurement = estimated(plain, 2).measurement
    setup = experiment(measurement.thinned(80).frequency)
    candidates = bp.effects.library(setup, KINDS)
    assert bp.improve(setup, measurement, candidates=candidates).verdict == ()


@pytest.mark.long
@pytest.mark.longest
def test_a_window_is_named_where_it_was_forgotten_and_not_where_it_is_known(plain):
    estimate = estimated(plain, 3, window=0.04)
    setup = experiment(estimate.measurement.frequency)
    candidates = bp.effects.library(setup, KINDS)
    forgotten = bp.improve(setup, estimate.measurement, candidates=candidates)
    (known,) = estimate.effects
    setup = setup + known
    candidates = bp.effects.library(setup, KINDS[:-1])
    named = bp.improve(setup, estimate.measurement, candidates=candidates)
    assert (forgotten.verdict, named.verdict) == (("exponential_window",), ())


def test_the_study_states_what_the_other_one_does():
    assert hammer_test.truth == hidden_effect.truth
    assert str(hammer_test.recording) == (
        "Recording of 1.96 s at 8192 Hz: a1 (force), s1 (acceleration), s2 (acceleration), "
        "s3 (acceleration)."
    )
