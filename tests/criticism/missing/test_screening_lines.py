"""Screening at some of many lines: what is lost, and what stays as it is."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism import screening_lines
from bayes_placement.criticism.missing import _descents
from bayes_placement.criticism.screening_lines import (
    Thinned,
    at_screening_lines,
    sample,
)
from bayes_placement.inference.engines.levenberg_marquardt import minimise
from bayes_placement.inference.residuals import Problem
from bayes_placement.inference.residuals_of_state import State
from tests.criticism.small import MASS, experiment, measured

FREE = bp.effects.point_mass(dist.Uniform(0.1, 0.9), dist.Uniform(0.0, 0.8))


@pytest.fixture(scope="module")
def problem():
    """A bar with a mass, 60 lines of two sensors."""
    setup = experiment() + FREE
    return Problem(setup, setup.data(measured(MASS, seed=1)))


def points_of(problem, count=8):
    return 0.5 * np.random.default_rng(0).normal(size=(count, problem.dimension))


def test_few_data_are_not_thinned(problem, monkeypatch):
    assert at_screening_lines(problem) is problem
    monkeypatch.setattr(screening_lines, "MOST_DATA", problem.count // 2 + 1)
    screening_lines._at_one_of.cache_clear()
    assert at_screening_lines(problem) is problem
    monkeypatch.setattr(screening_lines, "MOST_DATA", problem.count // 2)
    screening_lines._at_one_of.cache_clear()
    thinned = at_screening_lines(problem)
    assert len(thinned.squares.residuals(points_of(problem))[0][0]) == problem.count // 2
    screening_lines._at_one_of.cache_clear()


def test_one_line_of_one_is_the_whole_problem(problem):
    points = points_of(problem)
    for logarithmic in (False, True):
        expected = problem.squares.residuals(points, logarithmic)
        values = Thinned(problem, 1).squares.residuals(points, logarithmic)
        for value, whole in zip(values, expected, strict=True):
            np.testing.assert_allclose(value, whole, rtol=1e-12)


@pytest.mark.parametrize("logarithmic", [False, True])
def test_sums_are_those_of_all_lines_but_for_the_error_of_the_sample(problem, logarithmic):
    points = points_of(problem)
    whole = problem.squares.objective(logarithmic=logarithmic).cost(points)
    thinned = Thinned(problem, 3).squares.objective(logarithmic=logarithmic).cost(points)
    np.testing.assert_allclose(thinned, whole, rtol=0.15)
    assert abs(np.mean(thinned / whole - 1)) < 0.05


def test_a_line_counts_for_as_many_as_it_stands_for_also_where_some_are_not_measured(problem):
    """With every second line unmeasured, each of the others counts, none that is empty."""
    data = problem.data
    is_even = np.arange(data.z.shape[-1]) % 2 == 0
    partial = problem.with_measured(np.asarray(data.measured) & is_even)
    thinned = Thinned(partial, 2)
    data = thinned.problem.data
    assert data.z.shape[-1] == 15
    assert np.asarray(data.measured).all()
    residual, _ = thinned.squares.residuals(np.zeros((1, problem.dimension)))
    plain, _ = thinned.problem.squares.residuals(np.zeros((1, problem.dimension)))
    np.testing.assert_allclose(residual, np.sqrt(2) * plain)


def test_each_state_is_thinned_and_modes_are_not(problem):
    setup = experiment()
    table = bp.ModalParameters([160.0, 320.0], [0.04, 0.04], number=[1, 2])
    modal = bp.observing_modes(setup, table)
    earlier = State(setup, setup.data(measured()))
    later = State(modal, modal.data(table))
    both = Problem(problem.experiment, problem.data, baseline=earlier, further=[later])
    thinned = Thinned(both, 5)
    sizes = [state.data.z.size for state in thinned.problem.states]
    assert sizes[:2] == [48, 48]
    assert sizes[2] == later.data.z.size
    assert len(thinned.weight) == sum(sizes)
    np.testing.assert_allclose(np.unique(thinned.weight), [1.0, np.sqrt(5)])


def test_noise_of_unknown_level_and_of_each_line():
    """The logs of deviations count as often as their squares."""
    for sigma in (dist.LogUniform(1e-3, 1.0), np.geomspace(0.01, 0.1, 60)):
        setup = bp.Experiment(
            experiment().structure,
            sensors=list(experiment().sensor.values()),
            actuators=list(experiment().actuator.values()),
            frequency=experiment().frequency,
            observe=bp.observe.LogAmplitude("acceleration"),
            noise=bp.noise.Gaussian(sigma),
        )
        problem = Problem(setup, setup.data(measured()))
        points = points_of(problem)
        (_, whole), (_, thinned) = (
            each.squares.residuals(points) for each in (problem, Thinned(problem, 3))
        )
        np.testing.assert_allclose(thinned, whole, rtol=0.02)


def test_a_fit_begins_at_some_lines_and_ends_at_all(problem, monkeypatch):
    """It is the fit of all lines, not that of the sample."""
    starts = points_of(problem, 3)
    whole = _descents._followed(problem, starts)
    of_sample, _ = minimise(Thinned(problem, 4).squares.objective(), starts, steps=40)
    monkeypatch.setattr(_descents, "at_lines_of_descents", lambda problem: Thinned(problem, 4))
    begun = _descents._followed(problem, starts)
    assert abs(begun.cost - whole.cost) < 0.01
    deviations = np.sqrt(np.diag(whole.gaussian.covariance))
    assert np.all(np.abs(begun.point - whole.point) < 0.1 * deviations)
    assert np.any(np.abs(of_sample - whole.point) > 0.5 * deviations)


def test_a_sample_of_residuals_has_the_products_of_all(monkeypatch):
    residual, slope = np.random.default_rng(0).normal(size=(2, 3, 5000)) + 0.5
    assert sample(residual[:, :2000]).shape == (3, 2000)
    few, along = sample(residual), sample(slope)
    assert few.shape == (3, 2000)
    error = np.sqrt(5000**2 / 2000 * 1.5)
    np.testing.assert_allclose(few @ along.T, residual @ slope.T, atol=4 * error)
    monkeypatch.setattr(screening_lines, "SAMPLE", 5000)
    np.testing.assert_array_equal(sample(residual), residual)
