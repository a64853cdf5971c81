"""Gauss nodes of a distribution, and sums over finitely many values."""

import sys

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest

from bayes_placement._shared.errors import InfeasibleError
from bayes_placement.inference._quadrature_rules import product_rule, rule


@pytest.mark.parametrize(
    ("distribution", "between"),
    [
        (dist.Uniform(0.21, 0.29), (0.0, 1.0)),
        (dist.Uniform(0.21, 0.29), (0.25, 0.5)),
        (dist.Exponential(2.0), (0.1, 0.9)),
        (dist.Normal(3.0, 0.5), (0.2, 0.7)),
    ],
)
def test_quadrature_integrates_over_a_part_of_a_distribution(distribution, between):
    node, weight = jax.jit(lambda: rule(distribution, 40, between))()
    np.testing.assert_allclose(jnp.sum(weight), between[1] - between[0], rtol=1e-12)
    # A second rule, in the value instead of the probability.
    low, high = np.asarray(jax.jit(distribution.icdf)(np.array(between)))
    value, share = np.polynomial.legendre.leggauss(80)
    value = low + (high - low) * (value + 1) / 2
    density = np.exp(jax.jit(distribution.log_prob)(value)) * (high - low) / 2
    expected = np.sum(share * density * np.sin(5 * value))
    np.testing.assert_allclose(jnp.sum(weight * jnp.sin(5 * node)), expected, rtol=1e-9)


def test_quadrature_over_a_uniform_distribution_is_exact_for_polynomials():
    node, weight = rule(dist.Uniform(-1.0, 3.0), 3)
    np.testing.assert_allclose(jnp.sum(weight * node**5), (3**6 - 1) / 6 / 4, rtol=1e-13)


def test_quadrature_of_a_vector_is_refused():
    distribution = dist.Uniform(jnp.zeros(3), jnp.ones(3)).to_event(1)
    with pytest.raises(
        InfeasibleError,
        match=r"needs scalar unknowns, but one of the unknowns has the shape \(3,\)",
    ):
        rule(distribution, 4)


def test_quadrature_of_a_distribution_that_cannot_be_inverted_is_refused():
    distribution = dist.VonMises(0.0, 3.0)
    with pytest.raises(InfeasibleError, match=r"which VonMises lacks. Use marginals.Latent\(\)"):
        rule(distribution, 4)


def test_quadrature_of_a_distribution_whose_inverse_is_not_installed_is_refused(monkeypatch):
    # NumPyro inverts a beta distribution by TensorFlow Probability, which is no dependency of ours.
    monkeypatch.setitem(sys.modules, "tensorflow_probability", None)
    with pytest.raises(InfeasibleError, match=r"which Beta lacks. Use marginals.Latent\(\)"):
        rule(dist.Beta(2.0, 5.0), 4)


def test_a_finite_distribution_is_summed():
    distribution = dist.Categorical(probs=np.array([0.2, 0.5, 0.3]))
    node, weight = rule(distribution, 64)
    np.testing.assert_array_equal(node, [0, 1, 2])
    np.testing.assert_allclose(weight, [0.2, 0.5, 0.3], rtol=1e-12)


def test_a_tensor_combines_all_nodes_the_last_distribution_fastest():
    distributions = {
        "node": dist.Categorical(probs=np.array([0.25, 0.75])),
        "x": dist.Uniform(1.0, 4.0),
    }
    values, log_weight = product_rule(distributions, 5)
    np.testing.assert_array_equal(values["node"], np.repeat([0, 1], 5))
    moment = np.sum(np.exp(log_weight) * (1 + values["node"]) * values["x"] ** 3)
    np.testing.assert_allclose(moment, (0.25 + 2 * 0.75) * (4**4 - 1) / 4 / 3, rtol=1e-12)


def test_a_tensor_over_a_part_of_each_distribution():
    values, log_weight = product_rule({"x": dist.Uniform(0.0, 2.0)}, 4, [(0.25, 0.5)])
    np.testing.assert_allclose(np.sum(np.exp(log_weight)), 0.25, rtol=1e-12)
    assert np.min(values["x"]) > 0.5 and np.max(values["x"]) < 1.0


def test_a_tensor_over_nothing_is_one_node():
    values, log_weight = product_rule({}, 4)
    assert values == {}
    np.testing.assert_array_equal(log_weight, [0.0])
