"""Sizes of most evidence of a linear model: against the density of the data, and MacKay's rule."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime
from scipy.stats import multivariate_normal

from bayes_placement.inference.engines.empirical_bayes import LinearModel

WIDE = np.full(2, np.log(1e4))


@pytest.fixture(scope="module")
def data():
    """Slopes of 30 data along a parameter, eight errors of one size and three of another; data."""
    rng = np.random.default_rng(5)
    slopes = rng.normal(size=(30, 12)) * np.r_[1.0, np.full(8, 2.0), np.full(3, 0.5)]
    standard = rng.normal(size=12) * np.r_[1.0, np.full(8, 3.0), np.full(3, 0.4)]
    return slopes, slopes @ standard + rng.normal(size=30)


@pytest.fixture(scope="module")
def model(data):
    slopes, measured = data
    errors = [np.arange(1, 9), np.arange(9, 12)]
    return LinearModel(slopes.T @ slopes, slopes.T @ measured, np.ones(12), errors)


def density(data, logs):
    slopes, measured = data
    deviation = np.r_[1.0, np.full(8, np.exp(logs[0])), np.full(3, np.exp(logs[1]))]
    covariance = np.eye(30) + (slopes * deviation**2) @ slopes.T
    return multivariate_normal.logpdf(measured, np.zeros(30), covariance)


@pytest.mark.parametrize("logs", [(0.0, 0.0), (1.0, -0.5), (-2.0, 0.7)])
def test_the_evidence_is_the_density_of_the_data(data, model, logs):
    constant = density(data, np.zeros(2)) - model.log_evidence(np.zeros(2))[0]
    value, slopes = model.log_evidence(np.array(logs))
    assert value + constant == pytest.approx(density(data, logs), abs=1e-9)
    numerical = approx_fprime(np.array(logs), lambda at: model.log_evidence(at)[0], 1e-6)
    np.testing.assert_allclose(slopes, numerical, rtol=1e-5, atol=1e-4)


def test_at_the_best_sizes_squares_sum_up_to_the_number_determined(data, model):
    logs, gained = model.best_sizes(-WIDE, WIDE)
    assert gained == pytest.approx(density(data, logs) - density(data, np.zeros(2)), abs=1e-9)
    precision = np.r_[1.0, np.full(8, np.exp(-2 * logs[0])), np.full(3, np.exp(-2 * logs[1]))]
    covariance = np.linalg.inv(model.information + np.diag(precision))
    standard = (covariance @ model.pull) ** 2 * precision
    determined = 1 - precision * np.diag(covariance)
    for places in model.errors:
        assert standard[places].sum() == pytest.approx(determined[places].sum(), rel=1e-3)


def test_a_size_stays_within_its_limits_and_follows_its_prior(model):
    free, _ = model.best_sizes(-WIDE, WIDE)
    low, high = np.array([-0.1, -5.0]), np.array([0.1, 0.0])
    limited, gained = model.best_sizes(low, high)
    assert (low <= limited).all() and (limited <= high).all()
    assert gained > 0
    narrow, _ = model.best_sizes(
        -WIDE, WIDE, lambda logs: (-0.5 * np.sum(logs**2) / 1e-4, -logs / 1e-4)
    )
    assert (np.abs(narrow) < 0.1 * np.abs(free)).all()


def test_without_sizes_nothing_is_gained(model):
    logs, gained = model._replace(errors=[]).best_sizes(np.zeros(0), np.zeros(0))
    assert logs.size == 0 and gained == 0.0


def test_where_rounding_leaves_no_evidence_sizes_stay_as_they_are(model):
    lost = model._replace(information=-2 * np.diag(model.precision))
    assert lost.log_evidence(np.zeros(2))[0] == -np.inf
    logs, gained = lost.best_sizes(-WIDE, WIDE)
    assert (logs == 0).all() and gained == 0.0
