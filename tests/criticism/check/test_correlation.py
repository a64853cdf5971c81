"""Correlation of FRFs and mode shapes: 1 for proportional vectors, 0 for orthogonal ones."""

import numpy as np
import pytest

from bayes_placement.criticism.check import correlation
from bayes_placement.criticism.check._residuals import residuals
from bayes_placement.criticism.check._statistics import MOST_LINES, correlations

RANDOM = np.random.default_rng(2)


def complex_normal(*shape):
    return RANDOM.normal(size=shape) + 1j * RANDOM.normal(size=shape)


FRFS, OTHER = complex_normal(3, 2, 20), complex_normal(3, 2, 20)
SHAPES, OTHERS = complex_normal(6, 3), complex_normal(6, 4)


def cosine(first, second):
    """Squared cosine of two vectors, by its definition."""
    size = np.linalg.norm(first) * np.linalg.norm(second)
    return (abs(np.vdot(first, second)) / size) ** 2


def test_frac_is_the_squared_cosine_along_frequency():
    expected = [[cosine(FRFS[s, a], OTHER[s, a]) for a in range(2)] for s in range(3)]
    np.testing.assert_allclose(correlation.frac(FRFS, OTHER), expected)


def test_fdac_is_the_squared_cosine_across_channels():
    criterion = correlation.fdac(FRFS, OTHER)
    assert criterion.shape == (20, 20)
    assert criterion[4, 7] == pytest.approx(cosine(FRFS[..., 4].ravel(), OTHER[..., 7].ravel()))


def test_fdac_shows_a_shift_in_frequency():
    shifted = np.roll(FRFS, 3, axis=-1)
    best = correlation.fdac(FRFS, shifted).argmax(axis=1)
    np.testing.assert_array_equal(best, (np.arange(20) + 3) % 20)


def test_mac_is_the_squared_cosine_of_modes():
    computed = correlation.mac(SHAPES, OTHERS)
    expected = [[cosine(SHAPES[:, i], OTHERS[:, j]) for j in range(4)] for i in range(3)]
    np.testing.assert_allclose(computed, expected)


def test_mac_of_orthogonal_shapes_is_the_identity():
    orthogonal = np.linalg.qr(RANDOM.normal(size=(6, 3)))[0]
    np.testing.assert_allclose(correlation.mac(orthogonal, orthogonal), np.eye(3), atol=1e-15)


CRITERIA = {
    "frac": (correlation.frac, FRFS, lambda x: np.ones((3, 2))),
    "fdac": (correlation.fdac, FRFS, lambda x: np.ones(20)),
    "mac": (correlation.mac, SHAPES, lambda x: np.ones(3)),
}


@pytest.mark.parametrize("name", CRITERIA)
def test_a_complex_factor_changes_nothing(name):
    criterion, vectors, expected = CRITERIA[name]
    values = criterion(vectors, (2 - 3j) * vectors)
    diagonal = values.diagonal() if name in ("fdac", "mac") else values
    np.testing.assert_allclose(diagonal, expected(vectors))


@pytest.mark.parametrize("name", CRITERIA)
def test_draws_may_lead(name):
    criterion, vectors, _ = CRITERIA[name]
    draws = vectors + 0.3 * complex_normal(7, *vectors.shape)
    together = criterion(vectors, draws)
    np.testing.assert_allclose(together, [criterion(vectors, draw) for draw in draws])
    low, high = np.quantile(together, [0.05, 0.95], axis=0)
    band = correlation.band(criterion, vectors, draws)
    np.testing.assert_allclose(band, [np.median(together, axis=0), low, high])


def test_what_vanishes_is_like_nothing():
    assert np.all(correlation.frac(FRFS, 0 * FRFS) == 0)
    assert np.all(correlation.mac(0 * SHAPES, OTHERS) == 0)


def test_of_a_result_the_lines_measured_count(correct_model):
    tree = correct_model(0, shape=(2, 1, 2, 100), draws=20)
    tree["observed_data"]["measured"][0, 0, :, 40:] = np.nan
    table = correlations(residuals(tree))
    measured, draws = (
        tree[group][name].transpose(..., "part", "sensor", "actuator", "frequency").values
        for group, name in (("observed_data", "measured"), ("posterior_predictive", "response"))
    )
    frf, computed = measured[0] + 1j * measured[1], draws[0, :, 0] + 1j * draws[0, :, 1]
    cosines = [cosine(frf[0, 0, :40], draw[0, 0, :40]) for draw in computed]
    assert float(table["frac"][0, 0]) == pytest.approx(np.median(cosines))
    assert table["fdac"].shape == (MOST_LINES,) * 2
    assert table["measured_line"].attrs["units"] == "Hz"


def test_logarithms_are_compared_as_amplitudes(correct_model):
    tree = correct_model(0, shape=(1, 1, 1, 30), prior=0.1, draws=20)
    table = correlations(residuals(tree))
    measured = 10 ** tree["observed_data"]["measured"].values[0, 0]
    draws = 10 ** tree["posterior_predictive"]["response"].values[0, :, 0, 0]
    expected = np.median([cosine(measured, draw) for draw in draws])
    assert float(table["frac"][0, 0]) == pytest.approx(expected)


def test_shapes_at_other_channels_are_refused():
    with pytest.raises(ValueError, match="Mode shapes at 6 and at 4 channels were given"):
        correlation.mac(SHAPES, OTHERS[:4])
