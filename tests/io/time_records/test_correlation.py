"""Lines that are worth one, of errors whose correlation is known."""

import numpy as np
import pytest

from bayes_placement.io.time_records import estimate as estimators

LINES = 600


def errors(random, repeats, weights):
    """Errors of moving averages along the lines, of another size at each line."""
    real, imaginary = random.standard_normal((2, repeats, LINES + len(weights) - 1))
    white = real + 1j * imaginary
    alike = np.array([np.convolve(row, weights, mode="valid") for row in white])
    return alike * (1 + np.cos(np.arange(LINES) / 50) ** 2)


@pytest.mark.parametrize("repeats", [2, 5, 30])
@pytest.mark.parametrize("weights", [[1.0], [1.0, 1.0], [1.0, 2.0, 1.0], np.ones(20)], ids=len)
def test_it_is_the_sum_of_squared_correlations(repeats, weights):
    random, tests = np.random.default_rng(repeats), 30
    lagged = np.correlate(weights, weights, "full") / np.sum(np.square(weights))
    drawn = [errors(random, repeats, weights) for _ in range(tests)]
    sums = [estimators.correlated_lines(each - each.mean(axis=0)) for each in drawn]
    assert np.mean(sums) == pytest.approx(np.sum(lagged**2), rel=0.02 + 5 * np.std(sums) / 30**0.5)


def test_what_does_not_differ_and_few_lines_tell_nothing():
    assert estimators.correlated_lines(np.zeros((4, 100), complex)) < 1.0
    assert estimators.correlated_lines(np.ones((4, 5), complex)) == 1.0
