"""Values at quantiles of every distribution, and the refusal of one that has no inverse."""

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy import stats
from scipy.special import ndtr

from bayes_placement._shared.errors import InfeasibleError
from bayes_placement.inference.coordinates import Coordinates

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
def test_a_quantile_of_the_coordinate_is_that_of_the_distribution(word):
    distribution, reference = EXPECTED[word]
    values = Coordinates({"x": distribution}).named(POINTS[:, None])["x"]
    np.testing.assert_allclose(values, reference.ppf(QUANTILES), rtol=1e-9)


REPEATED = ("repeated", "repeated_logarithm")

OTHERS = {
    "repeated": dist.Uniform(-1.0, 3.0).expand((2, 3)).to_event(1),
    "repeated_logarithm": dist.LogNormal(np.array([0.3, -1.0]), 0.7).expand((3, 2)).to_event(2),
    "gamma": dist.Gamma(2.0, 1.5),
    "vector": dist.Normal(np.zeros(3), np.array([0.1, 2.0, 5.0])).to_event(1),
    "simplex": dist.Dirichlet(np.array([0.7, 2.0, 3.0])),
    "correlated": dist.MultivariateNormal(
        np.array([1.0, -1.0]), scale_tril=np.linalg.cholesky([[2.0, 1.0], [1.0, 3.0]])
    ),
}


@pytest.mark.parametrize("word", [*REPEATED])
def test_repeated_priors_have_standard_normal_coordinates(word):
    coordinates = Coordinates({"x": OTHERS[word]})
    points = np.random.default_rng(0).standard_normal((5, 6))
    plain = coordinates.named(points)["x"]
    np.testing.assert_allclose(plain, jax.vmap(coordinates.values)(points)["x"], rtol=1e-12)
    assert plain.shape == (5, *OTHERS[word].shape())
    expected = [dist.Uniform(-1, 3), dist.LogNormal(jnp.array([0.3, -1.0]), 0.7)]
    distribution = expected[[*REPEATED].index(word)]
    np.testing.assert_allclose(distribution.cdf(plain).reshape(5, 6), ndtr(points), rtol=1e-9)


def test_every_unknown_has_its_place_and_shape():
    distributions = {"a": dist.Uniform(0, 1), "b": dist.Normal(jnp.zeros((2, 3)), 2.0).to_event(2)}
    coordinates = Coordinates(distributions)
    assert coordinates.dimension == 7
    values = jax.jit(coordinates.values)(jnp.arange(7.0))
    np.testing.assert_allclose(values["b"], 2 * np.arange(1.0, 7.0).reshape(2, 3))


def test_far_outside_a_uniform_prior_the_value_stays_inside():
    values = Coordinates({"x": dist.Uniform(2.0, 3.0)}).named(np.array([[-40.0], [40.0]]))["x"]
    np.testing.assert_array_equal(values, [2.0, 3.0])


def test_a_distribution_without_an_inverse_is_refused():
    with pytest.raises(
        InfeasibleError, match='"h" has the distribution Gamma, which lacks an inverse'
    ):
        Coordinates({"h": dist.Gamma(2.0, 1.0)}).named(np.zeros((1, 1)))


@pytest.mark.parametrize("word", EXPECTED)
def test_values_without_compiling_are_those_of_the_model(word):
    coordinates = Coordinates({"x": EXPECTED[word][0]})
    plain = coordinates.named(POINTS[:, None])["x"]
    np.testing.assert_allclose(
        plain, jax.jit(jax.vmap(coordinates.values))(POINTS[:, None])["x"], rtol=1e-12
    )


@pytest.mark.parametrize("word", [*EXPECTED, *OTHERS])
def test_density_and_volume_are_those_of_the_distribution(word):
    distribution = (OTHERS | {name: pair[0] for name, pair in EXPECTED.items()})[word]
    coordinates = Coordinates({"x": distribution}, standard_normal=False)
    values = {"x": distribution.sample(jax.random.PRNGKey(1))}

    @jax.jit
    def computed(values):
        vector = coordinates.vector(values)
        jacobian = coordinates.log_jacobian(vector)
        density = coordinates.log_prior(vector) - jacobian
        slopes = jax.jacfwd(lambda point: coordinates.values(point)["x"].ravel())(vector)
        expected = distribution.log_prob(values["x"]).sum()
        return coordinates.values(vector)["x"], density, expected, jacobian, slopes

    again, density, expected, jacobian, slopes = computed(values)
    np.testing.assert_allclose(again, values["x"], rtol=1e-9)
    np.testing.assert_allclose(density, expected, rtol=1e-9)
    if word in ("simplex", "correlated"):
        return
    np.testing.assert_allclose(jacobian, np.linalg.slogdet(slopes)[1], rtol=1e-8, atol=1e-12)


def test_a_value_outside_its_prior_has_no_coordinate():
    coordinates = Coordinates({"x": dist.Uniform(0.0, 1.0), "y": dist.Normal(0.0, 1.0)})
    vector = coordinates.vector({"x": jnp.array(1.2), "y": jnp.array(0.5)})
    np.testing.assert_array_equal(vector, [np.nan, 0.5])


def test_some_of_the_unknowns_have_their_own_density():
    distributions = {"a": EXPECTED["uniform"][0], "b": OTHERS["gamma"], "c": OTHERS["vector"]}
    coordinates = Coordinates(distributions, standard_normal=False)
    vector = jnp.linspace(-1.0, 1.2, coordinates.dimension)
    for density in (coordinates.log_prior, coordinates.log_jacobian):
        parts = [density(vector, [name]) for name in distributions]
        np.testing.assert_allclose(sum(parts), density(vector), rtol=1e-12)
    np.testing.assert_allclose(coordinates.log_prior(vector, ["a"]), stats.norm.logpdf(-1.0))
