"""Noise that a model needs against the scatter of neighbouring lines, by simulation."""

import dataclasses

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.missing._hypotheses import null_hypothesis, with_errors
from bayes_placement.criticism.missing._rows import row_of
from bayes_placement.criticism.missing._unknown_noise import noise_needed
from bayes_placement.criticism.missing.fitted_model import fitted_model
from bayes_placement.criticism.missing.table import AS_STATED
from bayes_placement.criticism.noise_needed import (
    NoiseNeeded,
    is_misfit_alike,
    over_scatter,
    relative_size,
)
from bayes_placement.experiment.variants import with_lines
from bayes_placement.inference.engines.map import MAP
from bayes_placement.plots._falling import told_misfit
from tests.criticism.small import MASS, TRUTH, experiment, measured

RUNS, ROWS, LINES = 400, 6, 80


def simulated(seed, misfit=0.0, weight=1.0):
    noise = np.random.default_rng(seed).standard_normal((ROWS, LINES)) * weight
    return noise + misfit * np.sin(np.linspace(0, 12, LINES)) * weight


def p_values(misfit, weight=1.0):
    present = np.ones((ROWS, LINES), dtype=bool)
    return np.array(
        [over_scatter(simulated(seed, misfit, weight), present)[1] for seed in range(RUNS)]
    )


@pytest.mark.parametrize("weight", [1.0, np.exp(np.sin(np.linspace(0, 20, LINES)))])
def test_a_correct_model_fails_as_often_as_stated(weight):
    share = np.mean(p_values(0.0, weight) < 0.1)
    assert share == pytest.approx(0.1, abs=5 * np.sqrt(0.09 / RUNS))


def test_a_smooth_misfit_is_measured_in_scatters():
    ratios = [
        over_scatter(simulated(seed, 5.0), np.ones((ROWS, LINES), dtype=bool))[0]
        for seed in range(50)
    ]
    assert np.mean(ratios) == pytest.approx(np.sqrt(1 + 12.5), rel=0.03)
    assert p_values(0.5).max() < 0.9 and np.median(p_values(0.7)) < 0.01


@pytest.mark.parametrize(("noise", "fails"), [(0.1, True), (1.0, False)])
def test_a_misfit_that_scatters_is_more_than_the_lines_of_the_record_do(noise, fails):
    """Where the record scatters as much, neighbours decide as without it."""
    present, residual = np.ones((ROWS, LINES), dtype=bool), simulated(1)
    ratio, p_value = over_scatter(residual, present, np.full(present.shape, noise))
    assert (p_value < 1e-3) == fails
    if fails:
        assert ratio == pytest.approx(1 / noise, rel=0.1)
    else:
        assert (ratio, p_value) == over_scatter(residual, present)


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0])
def test_a_correct_model_fails_as_often_beside_the_scatter_of_the_record(size):
    """A level that is too large decides nothing; one that is a little too small does not either."""
    present, level = np.ones((ROWS, LINES), dtype=bool), np.full((ROWS, LINES), max(size, 0.95))
    values = [over_scatter(simulated(seed), present, level)[1] for seed in range(RUNS)]
    share = np.mean(np.array(values) < 0.1)
    assert share == pytest.approx(0.1, abs=5 * np.sqrt(0.09 / RUNS))


@pytest.mark.parametrize(
    ("period", "record", "alike"),
    [(3, None, True), (80, None, False), (3, 1.0, False), (3, 10.0, True)],
    ids=["few lines", "many lines", "few of many lines", "few and no others"],
)
def test_lines_between_which_the_response_changes_do_not_tell_noise(period, record, alike):
    present = np.ones((ROWS, LINES), dtype=bool)
    measured = simulated(2) + 10 * np.sin(2 * np.pi * np.arange(LINES) / period)
    scatter = None if record is None else np.full(present.shape, record)
    assert is_misfit_alike(measured, present, scatter) == alike


def test_gaps_are_left_out_and_few_lines_decide_nothing():
    present = np.ones((ROWS, LINES), dtype=bool)
    present[:, 40] = False
    residual = simulated(0)
    residual[:, 40] = 1e6
    assert 0.8 < over_scatter(residual, present)[0] < 1.2
    assert np.isnan(over_scatter(residual[:1, :5], present[:1, :5])).all()
    assert np.isnan(over_scatter(residual[:, :2], present[:, :2])).all()


def test_sizes_are_shares_of_the_amplitude():
    parts = np.array([[3.0, 0.0], [4.0, 0.0]])  # real and imaginary, of a line and a gap
    assert relative_size(np.full((2, 2), 0.5), parts, -2) == pytest.approx(0.5 * np.sqrt(2) / 5)
    assert relative_size(np.full(5, np.log10(1.4)), np.zeros(5), None) == pytest.approx(0.4)
    words = str(NoiseNeeded(0.4, 2.5, 0.0, 3.8))
    assert words == (
        "40 % of the amplitude, 3.8 times what the coherence says and 2.5 times the scatter of "
        "neighbouring lines"
    )


@pytest.fixture(scope="module")
def of_unknown_noise():
    base = experiment()
    return bp.Experiment(
        base.structure,
        sensors=list(base.sensor.values()),
        actuators=list(base.actuator.values()),
        frequency=base.frequency,
        observe=base.observe,
        noise=bp.noise.FromCoherence(dist.LogUniform(0.1, 100.0)),
    )


FINE = np.linspace(30.0, 700.0, 600)


def of_many_lines(*hidden, greatest=0.5):
    """An experiment of unknown noise, and a fine record of it with 1 % of noise."""
    exact = experiment()
    whole = bp.Experiment(
        exact.structure,
        sensors=list(exact.sensor.values()),
        actuators=list(exact.actuator.values()),
        frequency=FINE,
        observe=exact.observe,
        noise=bp.noise.Relative(dist.LogUniform(1e-3, greatest)),
    )
    true = whole.fix(TRUTH | {"noise.ratio": 0.01})
    for effect in hidden:
        true = true + effect
    record = true.nominal_measurement()
    parts = np.random.default_rng(4).standard_normal((2, *record.frf.shape))
    frf = record.frf * (1 + 0.01 / np.sqrt(2) * (parts[0] + 1j * parts[1]))
    return whole, dataclasses.replace(record, frf=frf)


@pytest.mark.parametrize("hidden", [(), (MASS,)], ids=["right", "a mass is missing"])
def test_few_lines_of_a_record_are_judged_by_the_scatter_of_all(hidden):
    whole, record = of_many_lines(*hidden)
    few = with_lines(whole, 24)
    best = null_hypothesis(few, few.data(record))
    assert row_of(best).explains(AS_STATED) == (not hidden)
    assert not noise_needed(best).is_misfit_alike
    alone = dataclasses.replace(record.lines(few.frequency), line_scatter=None)
    unknown = null_hypothesis(few, few.data(alone))
    assert row_of(unknown).explains(AS_STATED)
    assert noise_needed(unknown).is_misfit_alike


def test_a_model_keeps_the_noise_that_it_needs_without_its_model_error():
    whole, record = of_many_lines(MASS)
    few = with_lines(whole, 24)
    exact = null_hypothesis(few, few.data(record))
    errors = few.with_model_error(bp.model_error.Embedded()).model_error
    model = fitted_model(with_errors(exact, errors), {})
    needed = model.noise_needed_when_exact.relative
    assert needed == noise_needed(exact).relative > 2 * model.noise_needed.relative


@pytest.mark.filterwarnings("ignore::bayes_placement.inference.infer.InferenceWarning")
def test_the_noise_that_is_needed_does_not_end_with_its_prior():
    """A table tells what the figure shows: residuals beyond the prior of the noise."""
    narrow, record = of_many_lines(MASS, greatest=0.02)
    ended = null_hypothesis(narrow, narrow.data(record))
    needed = noise_needed(ended).relative
    assert needed == pytest.approx(0.02 * ended.chi2_per_datum**0.5, rel=0.05) and needed > 0.1
    assert told_misfit([fitted_model(ended, {}).to_json()]).values == [100 * needed]
    misfit = bp.check(bp.infer(narrow, record, engine=MAP(starts=4)))
    assert misfit.noise_needed.relative == pytest.approx(needed, rel=0.05)


@pytest.mark.filterwarnings("ignore::bayes_placement.inference.infer.InferenceWarning")
def test_the_check_reads_the_scatter_of_the_record_from_a_result():
    whole, record = of_many_lines(MASS)
    misfit = bp.check(bp.infer(with_lines(whole, 24), record, engine=MAP(starts=4)))
    assert not misfit.passed
    assert misfit.noise_needed.over_scatter > 3


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::bayes_placement.inference.infer.InferenceWarning")
def test_unknown_noise_that_takes_up_a_misfit_is_no_explanation(of_unknown_noise):
    misfit = bp.check(bp.infer(of_unknown_noise, measured(MASS), engine=MAP(starts=8)))
    assert misfit.noise_needed.over_coherence > 3
    assert "times what the coherence says" in str(misfit)
    assert "reduced chi-square" not in misfit.table().columns


@pytest.mark.long
@pytest.mark.longest
def test_explain_says_how_much_noise_the_best_needs(of_unknown_noise):
    candidates = bp.effects.library(of_unknown_noise, ["point_mass", "gain_error"])
    ranking = bp.explain(of_unknown_noise, measured(MASS), candidates=candidates)
    assert ranking.steps[0].kind == "point_mass"
    assert ranking.steps[0].noise_needed.over_coherence == pytest.approx(1.0, rel=0.3)
    null = next(step for step in ranking.steps if not step.kind)
    assert null.noise_needed.over_coherence > 3
    assert not ranking.confounded
