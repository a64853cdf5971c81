"""Discrepancy: a missing bump is recovered with its size, and noise alone is not significant."""

import numpy as np
import pytest
from scipy import stats

from bayes_placement.criticism.check import discrepancy
from bayes_placement.criticism.check._residuals import residuals

LINES = np.linspace(10, 500, 60)
BUMP = np.exp(-0.5 * ((LINES - 300) / 20) ** 2)
SEEDS = range(40)


def fitted(tree):
    return discrepancy.discrepancy(tree)


@pytest.fixture(
    scope="module",
    params=[True, pytest.param(False, marks=pytest.mark.long)],
    ids=["known noise", "unknown noise"],
)
def fits(request, correct_model):
    """Discrepancies of many correct models and of as many that miss a bump of 5 deviations."""
    known = request.param
    return [
        [
            fitted(correct_model(seed, prior=0.1, draws=50, known=known, missing=size * BUMP))
            for seed in SEEDS
        ]
        for size in (0.0, 5.0)
    ]


def test_noise_alone_stands_out_at_few_lines(fits):
    shares = np.array([fit["share"].values for fit in fits[0]])
    assert shares.mean() < 0.05
    assert np.mean(shares > 0) < 0.3


def test_a_missing_bump_stands_out_where_it_is(fits):
    at = BUMP > 0.7
    significant = np.array([fit["significant"].values for fit in fits[1]])
    assert significant[..., at].mean() > 0.9
    # One amplitude holds for all lines, so that the process follows some noise elsewhere.
    assert significant[..., BUMP < 1e-3].mean() < 0.1
    assert min(float(fit["log_ratio"].min()) for fit in fits[1]) > 3


def test_the_band_holds_the_missing_bump(fits, correct_model):
    deviation = correct_model(0)["observed_data"]["deviation"].values[0, 0, 0]
    inside = []
    for fit in fits[1]:
        missing = 5 * BUMP * deviation
        low, high = (fit[n].transpose(..., "frequency").values for n in ("low", "high"))
        inside.append((low <= missing) & (missing <= high))
    # Hyperparameters are taken for known, and parameters keep what they absorbed of the bump.
    assert np.mean(inside) > 0.85


def test_an_unknown_noise_level_is_found(fits):
    level = np.array([fit["noise"].values for fit in fits[0]])
    assert level.mean() == pytest.approx(1.0, abs=5 * level.std() / np.sqrt(level.size) + 0.02)


@pytest.mark.parametrize("lines", [1, 2, 3])
def test_of_unknown_noise_nothing_is_smooth_over_very_few_lines(correct_model, lines):
    trees = [correct_model(seed, shape=(2, 2, 2, lines), known=False) for seed in range(12)]
    assert not any(fitted(tree)["share"].values.any() for tree in trees)


def matern(distance, size, length):
    scaled = np.sqrt(3) * np.abs(distance) / length
    return size**2 * (1 + scaled) * np.exp(-scaled)


@pytest.mark.parametrize("known", [True, False])
def test_it_is_the_dense_gaussian_process(correct_model, known):
    tree = correct_model(3, shape=(1, 1, 2, 60), missing=3 * BUMP, known=known)
    data, fit = residuals(tree), fitted(tree)
    over = (data.residual / data.scale)[0, 0]
    size, length, level = (float(fit[n][0, 0]) for n in ("amplitude", "length", "noise"))
    kernel = matern(LINES[:, None] - LINES, size, length)
    noise = level**2 * np.eye(60)
    gain = np.linalg.solve(kernel + noise, kernel).T
    np.testing.assert_allclose(fit["mean"][0, 0], gain @ over * data.scale[0, 0], atol=1e-9)
    variance = np.diag(kernel - gain @ kernel)[:, None]
    margin = stats.norm.isf(0.025) * np.sqrt(variance) * data.scale[0, 0]
    np.testing.assert_allclose(fit["high"][0, 0] - fit["mean"][0, 0], margin, rtol=1e-6)

    def likelihood(covariance):
        return stats.multivariate_normal(np.zeros(60), covariance).logpdf(over.T).sum()

    without = 1.0 if known else np.mean(over**2)
    ratio = likelihood(kernel + noise) - likelihood(without * np.eye(60))
    assert float(fit["log_ratio"][0, 0]) == pytest.approx(ratio, abs=1e-4)
    for factor in (0.5, 2.0):  # the likelihood is highest there
        assert likelihood(matern(LINES[:, None] - LINES, factor * size, length) + noise) < (
            likelihood(kernel + noise)
        )
        assert likelihood(matern(LINES[:, None] - LINES, size, factor * length) + noise) < (
            likelihood(kernel + noise)
        )


def test_lines_that_were_not_measured_have_no_influence(correct_model):
    tree = correct_model(4, shape=(1, 1, 2, 60), missing=5 * BUMP)
    tree["observed_data"]["measured"][..., 20:25] = np.nan
    fit = fitted(tree)
    assert np.isnan(fit["mean"][0, 0, 20:25]).all()
    data = residuals(tree)
    over = (data.residual / data.scale)[0, 0]
    present = data.present[0, 0, :, 0]
    kernel = matern(
        LINES[:, None] - LINES, float(fit["amplitude"][0, 0]), float(fit["length"][0, 0])
    )
    gain = kernel[:, present] @ np.linalg.inv(kernel[present][:, present] + np.eye(present.sum()))
    expected = (gain @ over[present] * data.scale[0, 0])[present]
    np.testing.assert_allclose(fit["mean"].values[0, 0][present], expected, atol=1e-6)


def test_each_force_level_has_its_own(correct_model):
    missing = np.concatenate([5 * BUMP, 0 * BUMP])
    # The prior is so narrow that no parameter absorbs the bump of one level at the cost of both.
    fit = fitted(correct_model(5, levels=2, missing=missing, prior=1e-3))
    np.testing.assert_array_equal(fit["force_level"], [2.0, 4.0])
    assert float(fit["share"].sel(force_level=2.0).min()) > 0.05
    assert float(fit["share"].sel(force_level=4.0).mean()) < 0.05


def test_a_single_line_has_no_smooth_part(correct_model):
    fit = fitted(correct_model(6, shape=(1, 1, 2, 1), unknowns=1))
    assert np.isfinite(fit["mean"]).all()
