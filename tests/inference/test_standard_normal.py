"""standard_normal: values at quantiles of every law, and what a law without an inverse says."""

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy import stats

from bayes_placement._types import InfeasibleError
from bayes_placement.inference.standard_normal import StandardNormalCoordinates

QUANTILES = np.array([0.003, 0.2, 0.5, 0.9])
POINTS = stats.norm.ppf(QUANTILES)

EXPECTED = {
    "uniform": (dist.Uniform(-2.0, 3.0), stats.uniform(-2, 5)),
    "loguniform": (dist.LogUniform(0.1, 20.0), stats.loguniform(0.1, 20)),
    "normal": (dist.Normal(1.0, 0.3), stats.norm(1, 0.3)),
    "lognormal": (dist.LogNormal(0.2, 0.7), stats.lognorm(0.7, scale=np.exp(0.2))),
    "exponential": (dist.Exponential(2.0), stats.expon(scale=0.5)),
}


@pytest.mark.parametrize("word", EXPECTED)
def test_a_quantile_of_the_coordinate_is_that_of_the_law(word):
    law, same = EXPECTED[word]
    found = StandardNormalCoordinates({"x": law}).named(POINTS[:, None])["x"]
    np.testing.assert_allclose(found, same.ppf(QUANTILES), rtol=1e-9)


def test_every_unknown_has_its_place_and_shape():
    laws = {"a": dist.Uniform(0, 1), "b": dist.Normal(jnp.zeros((2, 3)), 2.0).to_event(2)}
    coordinates = StandardNormalCoordinates(laws)
    assert coordinates.dimension == 7
    values = jax.jit(coordinates.values)(jnp.arange(7.0))
    np.testing.assert_allclose(values["b"], 2 * np.arange(1.0, 7.0).reshape(2, 3))


def test_far_outside_a_uniform_prior_the_value_stays_inside():
    found = StandardNormalCoordinates({"x": dist.Uniform(2.0, 3.0)}).named(
        np.array([[-40.0], [40.0]])
    )["x"]
    np.testing.assert_array_equal(found, [2.0, 3.0])


def test_a_law_without_an_inverse_is_refused():
    with pytest.raises(
        InfeasibleError, match='"h" has the distribution Gamma, which lacks an inverse'
    ):
        StandardNormalCoordinates({"h": dist.Gamma(2.0, 1.0)}).named(np.zeros((1, 1)))


@pytest.mark.parametrize("word", EXPECTED)
def test_values_without_compiling_are_those_of_the_model(word):
    one = StandardNormalCoordinates({"x": EXPECTED[word][0]})
    plain = one.named(POINTS[:, None])["x"]
    np.testing.assert_allclose(plain, jax.vmap(one.values)(POINTS[:, None])["x"], rtol=1e-12)
