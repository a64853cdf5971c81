"""discrepancy: a missing bump is found with its size, noise alone is not taken for one."""

import numpy as np
import pytest
from scipy import stats

from bayes_placement.criticism.check import discrepancy
from bayes_placement.criticism.check._residuals import residuals

LINES = np.linspace(10, 500, 60)
BUMP = np.exp(-0.5 * ((LINES - 300) / 20) ** 2)
SEEDS = range(40)


def standing_out(tree):
    return discrepancy.discrepancy(tree)


@pytest.fixture(scope="module", params=[True, False], ids=["known noise", "unknown noise"])
def found(request, right_model):
    """Discrepancies of many right models and of as many that miss a bump of 5 deviations."""
    known = request.param
    return [
        [
            standing_out(right_model(seed, prior=0.1, draws=50, known=known, missing=size * BUMP))
            for seed in SEEDS
        ]
        for size in (0.0, 5.0)
    ]


def test_noise_alone_stands_out_at_few_lines(found):
    shares = np.array([one["share"].values for one in found[0]])
    assert shares.mean() < 0.05
    assert np.mean(shares > 0) < 0.3


def test_a_missing_bump_stands_out_where_it_is(found):
    at = BUMP > 0.7
    away = np.array([one["significant"].values for one in found[1]])
    assert away[..., at].mean() > 0.9
    # One amplitude holds for all lines, so that the process follows some noise elsewhere.
    assert away[..., BUMP < 1e-3].mean() < 0.1
    assert min(float(one["log_ratio"].min()) for one in found[1]) > 3


def test_the_band_holds_the_missing_bump(found, right_model):
    deviation = right_model(0)["observed_data"]["deviation"].values[0, 0, 0]
    inside = []
    for one in found[1]:
        missing = 5 * BUMP * deviation
        low, high = (one[n].transpose(..., "frequency").values for n in ("low", "high"))
        inside.append((low <= missing) & (missing <= high))
    # Hyperparameters are taken for known, and parameters keep what they absorbed of the bump.
    assert np.mean(inside) > 0.85


def test_an_unknown_noise_level_is_found(found):
    level = np.array([one["noise"].values for one in found[0]])
    assert level.mean() == pytest.approx(1.0, abs=5 * level.std() / np.sqrt(level.size) + 0.02)


def matern(distance, size, length):
    scaled = np.sqrt(3) * np.abs(distance) / length
    return size**2 * (1 + scaled) * np.exp(-scaled)


@pytest.mark.parametrize("known", [True, False])
def test_it_is_the_dense_gaussian_process(right_model, known):
    tree = right_model(3, shape=(1, 1, 2, 60), missing=3 * BUMP, known=known)
    data, one = residuals(tree), standing_out(tree)
    over = (data.residual / data.scale)[0, 0]
    size, length, level = (float(one[n][0, 0]) for n in ("amplitude", "length", "noise"))
    kernel = matern(LINES[:, None] - LINES, size, length)
    noise = level**2 * np.eye(60)
    gain = np.linalg.solve(kernel + noise, kernel).T
    np.testing.assert_allclose(one["mean"][0, 0], gain @ over * data.scale[0, 0], atol=1e-9)
    variance = np.diag(kernel - gain @ kernel)[:, None]
    margin = stats.norm.isf(0.025) * np.sqrt(variance) * data.scale[0, 0]
    np.testing.assert_allclose(one["high"][0, 0] - one["mean"][0, 0], margin, rtol=1e-6)

    def likelihood(covariance):
        return stats.multivariate_normal(np.zeros(60), covariance).logpdf(over.T).sum()

    without = 1.0 if known else np.mean(over**2)
    ratio = likelihood(kernel + noise) - likelihood(without * np.eye(60))
    assert float(one["log_ratio"][0, 0]) == pytest.approx(ratio, abs=1e-4)
    for factor in (0.5, 2.0):  # the likelihood is highest there
        assert likelihood(matern(LINES[:, None] - LINES, factor * size, length) + noise) < (
            likelihood(kernel + noise)
        )
        assert likelihood(matern(LINES[:, None] - LINES, size, factor * length) + noise) < (
            likelihood(kernel + noise)
        )


def test_lines_that_were_not_measured_have_no_influence(right_model):
    tree = right_model(4, shape=(1, 1, 2, 60), missing=5 * BUMP)
    tree["observed_data"]["measured"][..., 20:25] = np.nan
    one = standing_out(tree)
    assert np.isnan(one["mean"][0, 0, 20:25]).all()
    data = residuals(tree)
    over = (data.residual / data.scale)[0, 0]
    there = data.present[0, 0, :, 0]
    kernel = matern(
        LINES[:, None] - LINES, float(one["amplitude"][0, 0]), float(one["length"][0, 0])
    )
    gain = kernel[:, there] @ np.linalg.inv(kernel[there][:, there] + np.eye(there.sum()))
    expected = (gain @ over[there] * data.scale[0, 0])[there]
    np.testing.assert_allclose(one["mean"].values[0, 0][there], expected, atol=1e-6)


def test_each_force_level_has_its_own(right_model):
    missing = np.concatenate([5 * BUMP, 0 * BUMP])
    # The prior is so narrow that no parameter absorbs the bump of one level at the cost of both.
    one = standing_out(right_model(5, levels=2, missing=missing, prior=1e-3))
    np.testing.assert_array_equal(one["force_level"], [2.0, 4.0])
    assert float(one["share"].sel(force_level=2.0).min()) > 0.05
    assert float(one["share"].sel(force_level=4.0).mean()) < 0.05


def test_a_single_line_has_no_smooth_part(right_model):
    one = standing_out(right_model(6, shape=(1, 1, 2, 1), unknowns=1))
    assert np.isfinite(one["mean"]).all()
