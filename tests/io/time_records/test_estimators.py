"""H1, H2 and Hv under noise of either channel in closed form, and their jackknife."""

import numpy as np
import pytest

from bayes_placement.io.time_records import estimate as estimators

FRF = np.array([2.0 - 1.0j, -0.3 + 0.8j])
FORCE_NOISE, RESPONSE_NOISE = 0.3, np.array([0.7, 0.05])  # powers, for a force of power 1


def circular(random, shape, power=1.0):
    real, imaginary = random.standard_normal((2, *shape))
    return np.sqrt(np.asarray(power) / 2) * (real + 1j * imaginary)


def recorded(random, repeats, force_noise=FORCE_NOISE, response_noise=RESPONSE_NOISE):
    shape = (repeats, FRF.size)
    true = circular(random, shape)
    return estimators.products(
        true + circular(random, shape, force_noise),
        FRF * true + circular(random, shape, response_noise),
    )


EXPECTED = {
    "H1": FRF / (1 + FORCE_NOISE),
    "H2": FRF * (1 + RESPONSE_NOISE / np.abs(FRF) ** 2),
    "Hv": FRF * np.sqrt((1 + RESPONSE_NOISE / np.abs(FRF) ** 2) / (1 + FORCE_NOISE)),
}


@pytest.mark.parametrize("name", EXPECTED)
def test_the_bias_by_noise_is_the_closed_form(name):
    repeats = 200_000
    total = estimators.summed(recorded(np.random.default_rng(1), repeats))
    estimate = estimators.ESTIMATORS[name](total)
    coherence = 1 / ((1 + FORCE_NOISE) * (1 + RESPONSE_NOISE / np.abs(FRF) ** 2))
    np.testing.assert_allclose(estimators.coherence(total), coherence, atol=5 / np.sqrt(repeats))
    deviation = np.abs(EXPECTED[name]) * np.sqrt((1 - coherence) / (repeats * coherence))
    assert np.all(np.abs(estimate - EXPECTED[name]) < 5 * deviation)


def test_without_noise_all_are_the_frf():
    total = estimators.summed(recorded(np.random.default_rng(2), 3, 0.0, 0.0))
    for estimator in estimators.ESTIMATORS.values():
        np.testing.assert_allclose(estimator(total), FRF, rtol=1e-12)
    np.testing.assert_allclose(estimators.coherence(total), 1.0, rtol=1e-12)


@pytest.mark.parametrize("name", EXPECTED)
def test_hv_lies_between_the_others(name):
    total = estimators.summed(recorded(np.random.default_rng(3), 50))
    h1, h2, estimate = (np.abs(estimators.ESTIMATORS[which](total)) for which in ("H1", "H2", name))
    assert np.all((h1 <= estimate * (1 + 1e-12)) & (estimate <= h2 * (1 + 1e-12)))
    np.testing.assert_allclose(h1 / h2, estimators.coherence(total))


def test_the_jackknife_of_hits_of_one_strength_is_the_variance_of_their_mean():
    random = np.random.default_rng(4)
    response = circular(random, (7, 5))
    each = estimators.products(np.full((7, 5), 2.0 + 0.0j), response)
    variance = estimators.scatter(estimators.h1, each, 7.0)
    mean = np.mean(response / 2, axis=0)
    expected = np.sum(np.abs(response / 2 - mean) ** 2, axis=0) / (7 * 6)
    np.testing.assert_allclose(variance, expected, rtol=1e-12)


@pytest.mark.parametrize("name", EXPECTED)
def test_the_jackknife_is_the_scatter_of_many_tests(name):
    random, estimator, tests = np.random.default_rng(5), estimators.ESTIMATORS[name], 1500
    noise = {"force_noise": 0.01, "response_noise": np.array([0.02, 0.01])}
    each = [recorded(random, 12, **noise) for _ in range(tests)]
    estimates = np.array([estimator(estimators.summed(hits)) for hits in each])
    truth = np.mean(np.abs(estimates - estimates.mean(axis=0)) ** 2, axis=0)
    stated = np.mean([estimators.scatter(estimator, hits, 12.0) for hits in each], axis=0)
    # The force is random here, so that some tests have little of it and the jackknife is wider.
    assert np.all(stated > truth * (1 - 5 / np.sqrt(tests)))
    assert np.all(stated < truth * 1.2)
