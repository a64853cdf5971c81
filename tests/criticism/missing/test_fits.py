"""Fits of an experiment: the truth, an unknown noise level, and held-out data."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.optimize import minimize
from scipy.stats import multivariate_normal

import bayes_placement as bp
from bayes_placement.criticism.kept_fits import kept_with_sizes
from bayes_placement.criticism.missing import _hypotheses
from bayes_placement.criticism.missing._held_out import (
    _blocks,
    _evidence_ratio,
    held_out,
    scores,
)
from bayes_placement.criticism.missing._hypotheses import null_hypothesis, with_errors
from bayes_placement.inference.batches import BATCH
from bayes_placement.inference.residuals import Problem
from bayes_placement.inference.residuals_of_state import State
from tests.criticism.small import MASS, TRUTH, experiment, measured, without_coherence


@pytest.fixture(scope="module")
def null():
    bar = experiment()
    return null_hypothesis(bar, bar.data(measured()))


def test_every_start_finds_the_truth(null):
    assert null.fit.reached >= 2
    values = null.problem.coordinates.named(null.fit.point[None])
    spread = np.sqrt(np.diag(null.fit.gaussian.covariance))
    sides = null.problem.coordinates.named(null.fit.point + np.diag(spread))
    for name, value in values.items():
        deviation = abs(sides[name][null.problem.coordinates.places[name].start] - value[0])
        assert abs(value[0] - TRUTH[name]) < 4 * deviation, name


def test_the_fit_is_where_another_optimiser_ends(null):
    def cost(point):
        return float(null.problem.squares.objective().cost(point[None])[0])

    reference = minimize(cost, null.fit.point + 0.02, method="Powell", options={"xtol": 1e-6})
    assert null.fit.cost < reference.fun + 1e-3


def test_slopes_are_those_of_autodiff(null):
    point = null.fit.point + 0.1
    traced = null.problem.squares.traced
    exact = jax.jit(jax.jacfwd(lambda z: traced(z[None], False)[0][0]))(jnp.asarray(point))
    slopes = null.problem.squares.jacobian(point[None]).slopes[0]
    np.testing.assert_allclose(slopes, exact.T, atol=1e-4 * np.abs(exact).max())


def test_a_fit_with_model_error_begins_at_the_exact_one_too(null, monkeypatch):
    """Descents along logarithmic residuals may have ended elsewhere."""
    begun = []

    def seen(problem, starts, *settings):
        begun.extend(starts[:, : null.problem.dimension])
        return kept_with_sizes(problem, starts, *settings)

    monkeypatch.setattr(_hypotheses, "kept_with_sizes", seen)
    rival = bp.model_error.Embedded(pieces=4, modes=2)
    errors = null.problem.experiment.with_model_error(rival).model_error
    astray = dataclasses.replace(null, near=np.full_like(null.near[:1], 6.0))
    assert with_errors(astray, errors).chi2_per_datum < 1.2
    np.testing.assert_array_equal(begun, [astray.near[0], null.fit.point])


def test_an_unknown_noise_level_is_fitted_too():
    bar = experiment()
    sigma = dist.LogUniform(1e-3, 1.0)
    noisy = bp.Experiment(
        bar.structure,
        sensors=list(bar.sensor.values()),
        actuators=list(bar.actuator.values()),
        frequency=bar.frequency,
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.Gaussian(sigma),
    )
    data = noisy.data(without_coherence(measured()))
    hypothesis = null_hypothesis(noisy, data)
    level = hypothesis.problem.coordinates.named(hypothesis.fit.point[None])["noise.sigma"][0]
    expected = np.sqrt((1 - 0.997) / 32 / 0.997 / 2) / np.log(10)
    assert level == pytest.approx(expected, rel=0.25)  # 120 data: 6 % standard error
    assert hypothesis.chi2_per_datum == pytest.approx(1.0, abs=0.1)


def test_held_out_data_are_predicted_as_well_as_the_noise_allows(null):
    # A correct model leaves unit residuals: -0.5 (1 + log 2 pi) less the logs of the deviations.
    _, spread = null.problem.squares.residuals(null.fit.point[None])
    ideal = -0.5 * (1 + np.log(2 * np.pi)) - spread[0] / null.problem.count
    assert held_out(null) == pytest.approx(ideal, abs=0.2)


def test_unknown_noise_of_what_is_held_out_is_told_by_the_rest(null):
    """Its level counts neither in the fit nor in the score, which is that of the known noise."""
    bar = experiment()
    unknown = bp.noise.FromCoherence(dist.LogUniform(0.2, 5.0))
    noisy = eqx.tree_at(lambda experiment: experiment.noise, bar, unknown)
    hypothesis = null_hypothesis(noisy, noisy.data(measured()))
    # The factor is known to 1 / sqrt(2 N), of 120 data held out the other way round to 6 %.
    assert held_out(hypothesis) == pytest.approx(held_out(null), abs=0.03)


def test_a_right_effect_predicts_lines_better_and_one_that_is_not_there_does_not():
    """By twice the standard error over the blocks, and by none."""
    bar = experiment()
    mass = bp.effects.point_mass(dist.Uniform(0.1, 0.9), dist.LogUniform(1e-3, 0.5))
    for hidden, is_right in (((MASS,), True), ((), False)):
        data = bar.data(measured(*hidden, seed=1))
        gains = scores(null_hypothesis(bar + mass, data)) - scores(null_hypothesis(bar, data))
        assert (np.mean(gains) > 2 * np.std(gains, ddof=1) / np.sqrt(gains.size)) == is_right


def test_a_held_out_block_is_predicted_as_by_closed_form():
    """Of a linear model with known noise: the density of the block given all other lines."""
    null = null_hypothesis(experiment(), experiment().data(measured()))
    problem = null.problem
    block = next(iter(_blocks(problem)))
    residual, spread, slopes, _ = problem.squares.jacobian(null.fit.point[None])
    residual, slope = residual[0], slopes[0].T
    # About its mode the model is linear: r(x) = r + S (x - m), x standard normal.
    covariance = np.eye(len(residual)) + slope @ slope.T
    mean = residual - slope @ null.fit.point
    log_all = multivariate_normal(cov=covariance).logpdf(mean)
    rest = multivariate_normal(cov=covariance[np.ix_(~block, ~block)]).logpdf(mean[~block])
    expected = (log_all - rest) / block.sum() - spread[0] / problem.count
    assert _evidence_ratio(null, block) == pytest.approx(expected, abs=0.02)


def test_a_block_of_lines_is_held_out_at_every_force_level():
    alone = experiment()
    levels = [1.0, 3.0, 9.0]
    driven = bp.Experiment(
        alone.structure,
        sensors=[*alone.sensor.values()],
        actuators=[*alone.actuator.values()],
        frequency=alone.frequency,
        observe=alone.observe,
        noise=alone.noise,
        force_levels=levels,
    )
    runs = [dataclasses.replace(measured(), force_level=level) for level in levels]
    data = driven.data(runs)
    masks = [block.reshape(data.z.shape) for block in _blocks(Problem(driven, data))]
    assert len(masks) == 10
    np.testing.assert_array_equal(np.sum(masks, axis=0), np.ones(data.z.shape))
    for mask in masks:
        lines = mask.all(axis=(0, 1, 2, 3))  # at both sensors, every level, in both parts
        assert np.ptp(np.flatnonzero(lines)) + 1 == lines.sum() == alone.frequency.size / 10
        np.testing.assert_array_equal(mask, np.broadcast_to(lines, mask.shape))


@pytest.mark.parametrize("logarithmic", [False, True])
def test_residuals_inside_a_compiled_function_are_those_outside(logarithmic):
    setup = experiment() + bp.effects.point_mass(dist.Uniform(0.1, 0.9), dist.Uniform(0.0, 0.5))
    problem = Problem(setup, setup.data(measured(MASS, seed=1)))
    points = 0.3 * np.random.default_rng(0).normal(size=(BATCH, problem.dimension))
    outside = problem.squares.evaluate(points, logarithmic)
    inside = jax.jit(lambda points: problem.squares.traced(points, logarithmic))(points)
    for expected, value in zip(outside, inside, strict=True):
        np.testing.assert_allclose(value, expected, atol=1e-8)


def test_an_earlier_state_is_computed_once_for_what_it_does_not_have(monkeypatch):
    """A scan moves the effect of the later state alone."""
    setup = experiment()
    earlier = State(setup, setup.data(measured()))
    later = setup + bp.effects.point_mass(dist.Uniform(0.1, 0.9), dist.Uniform(0.0, 0.5))
    problem = Problem(later, later.data(measured(MASS, seed=1)), baseline=earlier)
    points = np.zeros((3 * BATCH, problem.dimension))
    mass = problem.coordinates.places["structure.effects.point_mass.mass"]
    points[:, mass] = np.linspace(-1.0, 1.0, len(points))[:, None]
    expected = np.concatenate([problem.squares.residuals(point[None])[0] for point in points])
    computed = []
    for part in problem._parts:
        monkeypatch.setattr(part._batched, "_function", counting(part._of_batch, computed))
    residual, _ = problem.squares.residuals(points)
    np.testing.assert_array_equal(residual, expected)
    assert len(computed) == 3 + 1


def counting(function, computed):
    def counted(*arguments):
        computed.append(1)
        return function(*arguments)

    return counted
