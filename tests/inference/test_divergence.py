"""Divergences meet the closed form of Gaussians within the errors they state."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal, norm

from bayes_placement import information

# One unknown: a normal prior and a normal likelihood, off centre and of different widths.
PRIOR, LIKELIHOOD = (1.0, 2.0), (2.5, 0.7)
PRECISION = PRIOR[1] ** -2 + LIKELIHOOD[1] ** -2
POSTERIOR = (
    (PRIOR[0] * PRIOR[1] ** -2 + LIKELIHOOD[0] * LIKELIHOOD[1] ** -2) / PRECISION,
    PRECISION**-0.5,
)
EVIDENCE = norm.logpdf(LIKELIHOOD[0], PRIOR[0], np.hypot(PRIOR[1], LIKELIHOOD[1]))


def kl(first, second):
    """Divergence of the first normal law from the second."""
    (m, s), (n, t) = first, second
    return np.log(t / s) + (s**2 + (m - n) ** 2) / (2 * t**2) - 0.5


TRUTH = kl(POSTERIOR, PRIOR)


def from_prior(rng, draws=2000):
    return information.from_prior_draws(norm.logpdf(rng.normal(*PRIOR, draws), *LIKELIHOOD))


def test_the_example_tells_the_two_directions_apart():
    assert abs(TRUTH - kl(PRIOR, POSTERIOR)) > 1.0


def test_prior_draws_give_the_divergence_within_their_error():
    estimate = from_prior(np.random.default_rng(0), 100_000)
    assert estimate.error < 0.01
    assert abs(estimate.kl - TRUTH) < 5 * estimate.error


def test_the_error_of_prior_draws_is_the_scatter_on_repetition():
    rng = np.random.default_rng(1)
    estimates = np.array([from_prior(rng) for _ in range(300)])
    # The scatter of 300 repetitions is known to 4 %.
    assert np.mean(estimates[:, 1]) == pytest.approx(np.std(estimates[:, 0]), rel=0.2)
    assert abs(np.mean(estimates[:, 0]) - TRUTH) < 5 * np.std(estimates[:, 0]) / np.sqrt(300)


def test_the_size_of_the_likelihood_does_not_matter():
    rng = np.random.default_rng(2)
    log_likelihood = norm.logpdf(rng.normal(*PRIOR, 500), *LIKELIHOOD)
    small, plain = (
        information.from_prior_draws(log_likelihood + shift) for shift in (-5000.0, 0.0)
    )
    np.testing.assert_allclose(small, plain, rtol=1e-7)


def test_impossible_draws_carry_nothing():
    # Half of the prior is excluded and nothing else is learnt: log 2.
    log_likelihood = np.where(np.arange(1000) < 500, 0.0, -np.inf)
    estimate = information.from_prior_draws(log_likelihood)
    assert estimate.kl == pytest.approx(np.log(2))
    assert estimate.error == pytest.approx(1 / np.sqrt(1000))


def test_nothing_learnt_is_no_divergence():
    assert information.from_prior_draws(np.full(100, -3.0)) == pytest.approx((0.0, 0.0))


def test_nodes_of_a_quadrature_give_the_divergence_exactly():
    node, weight = np.polynomial.legendre.leggauss(200)
    log_weight = np.log(8 * weight) + norm.logpdf(8 * node)  # to 8 standard deviations
    log_likelihood = norm.logpdf(PRIOR[0] + PRIOR[1] * 8 * node, *LIKELIHOOD)
    estimate = information.from_prior_draws(log_likelihood, log_weight)
    assert estimate.kl == pytest.approx(TRUTH, rel=1e-8)


def test_the_evidence_gives_the_divergence():
    mean = norm.logpdf(LIKELIHOOD[0], POSTERIOR[0], LIKELIHOOD[1]) - 0.5 * (
        (POSTERIOR[1] / LIKELIHOOD[1]) ** 2
    )
    estimate = information.from_evidence(mean, 0.3, EVIDENCE, 0.4)
    assert estimate.kl == pytest.approx(TRUTH, rel=1e-12)
    assert estimate.error == pytest.approx(0.5)


def gaussians(dimension):
    """Mean and covariance of a posterior and of its prior, correlated and of unlike scales."""
    scale = np.array([1e-3, 2.0, 50.0])[:dimension]
    correlation = np.full((dimension, dimension), 0.7) + 0.3 * np.eye(dimension)
    posterior = (0.5 * scale, correlation * np.outer(scale, scale))
    return posterior, (np.zeros(dimension), np.diag((4 * scale) ** 2))


def closed_form(posterior, prior):
    (m, s), (n, t) = posterior, prior
    inverse = np.linalg.inv(t)
    log_volumes = np.linalg.slogdet(t)[1] - np.linalg.slogdet(s)[1]
    shift = (m - n) @ inverse @ (m - n)
    return 0.5 * (np.trace(inverse @ s) + shift - m.size + log_volumes)


def from_posterior(rng, dimension, draws=1000):
    posterior, prior = gaussians(dimension)
    vectors = rng.multivariate_normal(*posterior, size=(2, draws // 2))
    return information.from_posterior_draws(vectors, multivariate_normal(*prior).logpdf(vectors))


# In three dimensions the bias weighs as much as the spread, and is not wholly in the error.
@pytest.mark.parametrize(("dimension", "most"), [(1, 1.3), (2, 1.3), (3, 2.0)])
def test_posterior_draws_give_the_divergence_within_their_error(dimension, most):
    truth = closed_form(*gaussians(dimension))
    rng = np.random.default_rng(dimension)
    estimates = np.array([from_posterior(rng, dimension) for _ in range(60)])
    deviation = (estimates[:, 0] - truth) / estimates[:, 1]
    assert np.max(np.abs(deviation)) < 5
    assert np.sqrt(np.mean(deviation**2)) < most
    # Nor is it too large: it is scatter and bias together, of which 60 repetitions show 10 %.
    scatter, bias = np.std(estimates[:, 0]), np.mean(estimates[:, 0]) - truth
    assert np.mean(estimates[:, 1]) == pytest.approx(np.hypot(scatter, bias), rel=0.25)
    assert np.mean(estimates[:, 1]) < 0.1 < truth


def test_repeated_draws_count_once():
    posterior, prior = gaussians(2)
    vectors = np.random.default_rng(4).multivariate_normal(*posterior, size=(1, 400))
    log_prior = multivariate_normal(*prior).logpdf(vectors).reshape(1, 400)
    single = information.from_posterior_draws(vectors, log_prior)
    double = information.from_posterior_draws(
        np.tile(vectors, (2, 1, 1)), np.tile(log_prior, (2, 1))
    )
    np.testing.assert_allclose(double.kl, single.kl)


@pytest.mark.parametrize("draws", [9, 20])
def test_no_more_draws_than_unknowns_tell_no_density(draws):
    vectors = np.random.default_rng(5).normal(size=(1, draws, 20))
    estimate = information.from_posterior_draws(vectors, np.zeros((1, draws)))
    assert np.isnan(estimate.kl) and np.isnan(estimate.error)


def test_two_modes_are_two_modes():
    # Half of the draws 30 standard deviations off: the entropy grows by log 2.
    rng = np.random.default_rng(6)
    vectors = rng.normal(size=(1, 4000, 2))
    vectors[0, ::2, 0] += 30.0
    estimate = information.from_posterior_draws(vectors, np.zeros((1, 4000)))
    expected = -(np.log(2 * np.pi * np.e) + np.log(2))
    assert abs(estimate.kl - expected) < 5 * estimate.error
    assert estimate.error < 0.1
