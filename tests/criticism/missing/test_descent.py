"""descent: fits and evidence against closed forms of a linear problem and other methods."""

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.optimize import minimize
from scipy.stats import multivariate_normal

import bayes_placement as bp
from bayes_placement.criticism.missing import _confirm
from bayes_placement.criticism.missing._confirm import confirmed
from bayes_placement.criticism.missing._descent import descend, starts
from bayes_placement.criticism.missing._held_out import held_out
from bayes_placement.criticism.missing._hypotheses import alone
from bayes_placement.criticism.missing._problem import Problem
from bayes_placement.criticism.missing._search import fit_alone
from tests.criticism.small import TRUTH, experiment, measured, without_coherence


class Linear(Problem):
    """A problem of which everything is known: residual (y - A z) / s, prior N(0, 1)."""

    def __init__(self, seed=1, count=40, level=0.5):
        random = np.random.default_rng(seed)
        self.matrix = random.standard_normal((count, 3)) * [1.0, 0.2, 3.0]
        self.level = level
        self.y = self.matrix @ [0.4, -1.0, 0.2] + level * random.standard_normal(count)
        self.count = count

    def residual(self, point, logarithmic):
        spread = self.count * jnp.log(self.level)
        return (jnp.asarray(self.y) - self.matrix @ point) / self.level, spread

    dimension, known_noise = 3, True

    def compiled(self, points, logarithmic):
        return jax.vmap(lambda z: self.residual(z, logarithmic))(points)

    def evidence(self):
        covariance = self.matrix @ self.matrix.T + self.level**2 * np.eye(self.count)
        return multivariate_normal(np.zeros(self.count), covariance).logpdf(self.y)

    def posterior(self):
        precision = self.matrix.T @ self.matrix / self.level**2 + np.eye(self.dimension)
        covariance = np.linalg.inv(precision)
        return covariance @ self.matrix.T @ self.y / self.level**2, covariance


@pytest.fixture(scope="module")
def linear():
    problem = Linear()
    return problem, fit_alone(problem)


def test_a_linear_fit_is_the_closed_form(linear):
    problem, fit = linear
    mean, covariance = problem.posterior()
    np.testing.assert_allclose(fit.point, mean, atol=1e-5)
    np.testing.assert_allclose(fit.covariance, covariance, rtol=1e-4)
    assert fit.log_evidence == pytest.approx(problem.evidence(), abs=1e-4)


@pytest.mark.parametrize("method", ["weights", "ridges", "smc"])
def test_sampling_confirms_the_closed_form(linear, method, monkeypatch):
    problem, fit = linear
    if method != "weights":
        monkeypatch.setattr(_confirm, "LEAST_ESS", np.inf)
    if method == "smc":
        monkeypatch.setattr(Linear, "known_noise", False)
    draws = confirmed(problem, fit)
    assert abs(draws.log_evidence - problem.evidence()) < 5 * draws.log_evidence_error + 1e-3
    mean, covariance = problem.posterior()
    effective = {"weights": 1000, "ridges": 192, "smc": 100}[method]
    error = np.sqrt(np.diag(covariance) / effective)
    assert np.all(np.abs(draws.points.mean(0) - mean) < 5 * error)
    wide = 0.1 if method == "weights" else 0.25
    np.testing.assert_allclose(draws.points.std(0), np.sqrt(np.diag(covariance)), rtol=wide)


def test_weights_that_cannot_be_trusted_give_way_to_smc(linear, monkeypatch):
    problem, fit = linear
    monkeypatch.setattr(Linear, "known_noise", False)
    narrow = fit._replace(covariance=fit.covariance / 16)
    draws = confirmed(problem, narrow)
    assert len(draws.points) == _confirm.ENGINE.particles  # not KEPT: these are of SMC
    assert abs(draws.log_evidence - problem.evidence()) < 5 * draws.log_evidence_error + 0.1


class Bent(Linear):
    """Two data that hold one coordinate to a curve in the other, far narrower than it is long."""

    def __init__(self, bend):
        self.dimension = 2
        self.bend, self.level, self.y, self.count = bend, 0.001, np.array([0.3, 0.3]), 2

    def residual(self, point, logarithmic):
        x, follows, noise = point[0], point[1], jnp.array([0.0, 1e-4])
        mean = follows - self.bend * (x**2 + 0.3 * x**3) + noise
        return (jnp.asarray(self.y) - mean) / self.level, self.count * jnp.log(self.level)

    def integrals(self):
        """Log evidence, and mean and deviation of both coordinates, by quadrature."""
        x = np.linspace(-6, 6, 4001)
        curve = self.bend * (x**2 + 0.3 * x**3)
        follows = curve[:, None] + 0.3 + np.linspace(-8, 8, 401) * self.level
        noise = np.array([0.0, 1e-4])
        missed = (0.3 - follows[..., None] + curve[:, None, None] - noise) / self.level
        squares = np.sum(missed**2, axis=2) + follows**2 + x[:, None] ** 2
        density = np.exp(-0.5 * (squares - squares.min()))
        cell = (x[1] - x[0]) * (follows[0, 1] - follows[0, 0])
        constant = -2 * np.log(2 * np.pi) - self.count * np.log(self.level) - 0.5 * squares.min()
        share = density / density.sum()
        means = np.array([np.sum(share * one) for one in (x[:, None], follows)])
        squared = np.array([np.sum(share * one**2) for one in (x[:, None], follows)])
        return np.log(density.sum() * cell) + constant, means, np.sqrt(squared - means**2)


@pytest.mark.parametrize("bend", [0.02, 0.1])
def test_a_bent_ridge_is_followed_to_its_ends(bend):
    problem = Bent(bend)
    fit = fit_alone(problem)
    draws = confirmed(problem, fit)
    evidence, mean, deviation = problem.integrals()
    assert draws.log_evidence_error < 0.1
    assert abs(draws.log_evidence - evidence) < 4 * draws.log_evidence_error + 0.01
    assert np.all(np.abs(draws.points.mean(0) - mean) < 4 * deviation / np.sqrt(192))
    np.testing.assert_allclose(draws.points.std(0), deviation, rtol=4 / np.sqrt(2 * 192))


def test_data_of_weight_zero_have_no_say():
    problem = Linear()
    weight = np.ones(problem.count)
    weight[:15] = 0
    ends, _ = descend(problem, np.zeros((1, 3)), steps=20, weight=weight)
    kept = Linear()
    kept.matrix, kept.y, kept.count = problem.matrix[15:], problem.y[15:], problem.count - 15
    np.testing.assert_allclose(ends[0], kept.posterior()[0], atol=1e-5)


def test_starts_are_the_middle_and_draws_of_the_prior():
    drawn = starts(3, 33, seed=2)
    np.testing.assert_array_equal(drawn[0], 0)
    assert drawn.shape == (33, 3)
    assert np.all(np.abs(drawn[1:].mean(0)) < 0.15)
    assert starts(0, 5, seed=0).shape == (1, 0)


@pytest.fixture(scope="module")
def null():
    one = experiment()
    return alone(one, one.data(measured()))


def test_every_start_finds_the_truth(null):
    assert null.fit.reached >= 2
    values = null.problem.coordinates.named(null.fit.point[None])
    spread = np.sqrt(np.diag(null.fit.covariance))
    sides = null.problem.coordinates.named(null.fit.point + np.diag(spread))
    for name, value in values.items():
        deviation = abs(sides[name][null.problem.coordinates.places[name].start] - value[0])
        assert abs(value[0] - TRUTH[name]) < 4 * deviation, name


def test_the_fit_is_where_another_optimiser_ends(null):
    def cost(point):
        return float(null.problem.normal(point[None]).cost[0])

    found = minimize(cost, null.fit.point + 0.02, method="Powell", options={"xtol": 1e-6})
    assert null.fit.cost < found.fun + 1e-3


def test_slopes_are_those_of_autodiff(null):
    point = null.fit.point + 0.1
    exact = jax.jit(jax.jacfwd(lambda z: null.problem.residual(z, False)[0]))(jnp.asarray(point))
    slopes = null.problem.slopes(point[None])[2][0]
    np.testing.assert_allclose(slopes, exact.T, atol=1e-4 * np.abs(exact).max())


def test_an_unknown_noise_level_is_fitted_too():
    one = experiment()
    sigma = dist.LogUniform(1e-3, 1.0)
    noisy = bp.Experiment(
        one.structure,
        sensors=list(one.sensor.values()),
        actuators=list(one.actuator.values()),
        frequency=one.frequency,
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.Gaussian(sigma),
    )
    data = noisy.data(without_coherence(measured()))
    found = alone(noisy, data)
    level = found.problem.coordinates.named(found.fit.point[None])["noise.sigma"][0]
    expected = np.sqrt((1 - 0.997) / 32 / 0.997 / 2) / np.log(10)
    assert level == pytest.approx(expected, rel=0.25)  # 120 data: 6 % standard error
    assert found.chi2_per_datum == pytest.approx(1.0, abs=0.1)


def test_held_out_data_are_foretold_as_well_as_the_noise_allows(null):
    # A right model leaves unit residuals: -0.5 (1 + log 2 pi) less the logs of the deviations.
    _, spread = null.problem.residuals(null.fit.point[None])
    ideal = -0.5 * (1 + np.log(2 * np.pi)) - spread[0] / null.problem.count
    assert held_out(null) == pytest.approx(ideal, abs=0.2)
