"""Estimates and their standard errors compared with the scatter on repetition."""

import numpy as np
import pytest
from scipy.stats import norm

from bayes_placement.inference.estimates import Weighting, figures, scalars, standard_error

REPETITIONS = 200
# The scatter of so many repetitions is itself known to 1 / sqrt(2 * 200) = 5 %.
SCATTER_ERROR = 1 / np.sqrt(2 * REPETITIONS)
MEAN, SD = 3.0, 2.4  # so wide that the mean's error counts in the coefficient of variation


def independent(rng):
    return rng.normal(MEAN, SD, (1, 400)), Weighting(lineage=np.arange(400)[None])


def weighted(rng):
    """Draws of a wider law, weighted to the normal one."""
    wide = rng.normal(MEAN + 0.2, 1.5 * SD, (1, 600))
    log_weight = norm.logpdf(wide, MEAN, SD) - norm.logpdf(wide, MEAN + 0.2, 1.5 * SD)
    return wide, Weighting(log_weight=log_weight - np.log(np.sum(np.exp(log_weight))))


def families(rng):
    """Eighty families of six that share most of what they are."""
    shared = np.sqrt(0.8) * rng.normal(size=(80, 1)) + np.sqrt(0.2) * rng.normal(size=(80, 6))
    lineage = np.repeat(np.arange(80), 6).reshape(4, -1) + 1000
    return (MEAN + SD * shared).reshape(4, -1), Weighting(lineage=lineage)


def chains(rng, memory=0.6):
    """Four autoregressive chains, started from their stationary law."""
    noise = rng.normal(size=(600, 4))
    values = [noise[0]]
    for innovation in noise[1:]:
        values.append(memory * values[-1] + np.sqrt(1 - memory**2) * innovation)
    return MEAN + SD * np.array(values).T, Weighting()


KINDS = {sampler.__name__: sampler for sampler in (independent, weighted, families, chains)}


@pytest.fixture(scope="module", params=KINDS)
def repeated(request):
    """Figures of many repetitions, [figure, repetition]."""
    rng = np.random.default_rng(5)
    return np.array([figures(*KINDS[request.param](rng)) for _ in range(REPETITIONS)]).T


@pytest.mark.parametrize(("place", "truth"), [(0, MEAN), (2, SD), (4, SD / MEAN)])
def test_errors_are_the_scatter_on_repetition(repeated, place, truth):
    values, errors = repeated[place], repeated[place + 1]
    scatter = np.std(values, ddof=1)
    # Errors are estimates from a few hundred draws: 5 standard errors and 5 % for their own bias.
    assert np.mean(errors) == pytest.approx(scatter, rel=5 * SCATTER_ERROR + 0.05)
    # A standard deviation of n draws is low by about 1 / (2 n) of it, and n is 100 or more.
    assert abs(np.mean(values) - truth) < 5 * scatter / np.sqrt(REPETITIONS) + 0.005 * truth


def test_dependent_draws_are_worth_fewer_than_they_are():
    rng = np.random.default_rng(1)
    assert figures(*chains(rng)).ess == pytest.approx(2400 * (1 - 0.6) / (1 + 0.6), rel=0.3)
    # A family of six with a correlation of 0.8 is worth 6 / (1 + 5 * 0.8) = 1.2 draws.
    assert figures(*families(rng)).ess == pytest.approx(80 * 1.2, rel=0.5)


def test_weights_count_as_their_squares_say():
    log_weight = np.log([[0.5, 0.25, 0.25]])
    estimate = figures(np.array([[1.0, 2.0, 4.0]]), Weighting(log_weight=log_weight))
    assert estimate.mean == pytest.approx(2.0)
    assert estimate.sd == pytest.approx(np.sqrt(0.5 * 1 + 0.25 * 0 + 0.25 * 4))
    assert estimate.ess == pytest.approx(1 / (0.25 + 2 / 16))


def test_errors_of_weights_and_families_by_hand():
    influence = np.array([[1.0, -1.0, 3.0, -3.0]])
    alone = standard_error(influence, Weighting(log_weight=np.log(np.full((1, 4), 0.25))))
    assert alone == pytest.approx(np.sqrt(20) / 4)
    related = Weighting(lineage=np.array([[7, 7, 9, 8]]))
    assert standard_error(influence, related) == pytest.approx(np.sqrt(0 + 9 + 9) / 4)


def test_nodes_of_a_quadrature_have_no_sampling_error():
    node, weight = np.polynomial.hermite_e.hermegauss(20)
    log_weight = np.log(weight / weight.sum())[None]
    estimate = figures(MEAN + SD * node[None], Weighting(log_weight=log_weight, exact=True))
    assert (estimate.mean, estimate.sd) == pytest.approx((MEAN, SD), rel=1e-12)
    assert (estimate.mean_error, estimate.sd_error, estimate.cv_error) == (0.0, 0.0, 0.0)


def test_chains_apart_show_in_r_hat():
    values, weighting = chains(np.random.default_rng(2))
    assert figures(values, weighting).r_hat < 1.02
    apart = values + np.array([[0.0], [0.0], [SD], [SD]])
    assert figures(apart, weighting).r_hat > 1.1


@pytest.mark.parametrize(
    "weighting",
    [Weighting(), Weighting(lineage=np.arange(200).reshape(4, 50)), Weighting(exact=True)],
)
def test_a_constant_has_no_spread_and_no_error(weighting):
    estimate = figures(np.full((4, 50), 2.5), weighting)
    assert (estimate.mean, estimate.sd, estimate.cv) == (2.5, 0.0, 0.0)
    assert (estimate.mean_error, estimate.sd_error, estimate.cv_error) == (0.0, 0.0, 0.0)
    assert np.isnan(estimate.r_hat)


def test_an_array_is_split_into_named_numbers():
    values = np.arange(24.0).reshape(1, 4, 2, 3)
    split = dict(scalars("mass", values))
    assert list(split) == [f"mass[{i}]" for i in range(6)]
    np.testing.assert_array_equal(split["mass[5]"], values[..., 1, 2])
    assert scalars("mass", values[..., 0, 0])[0][0] == "mass"
