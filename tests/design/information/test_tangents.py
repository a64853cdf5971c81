"""Densities of linear responses in closed form, and of curved responses by quadrature."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy.special import ndtri
from scipy.stats import multivariate_normal, norm, qmc

from bayes_placement.design.information._kernel_densities import TangentKernels

SLOPE = np.array([[2.0, 0.3], [-1.0, 1.5], [0.2, -4.0]])
SHIFT = np.array([0.4, -1.0, 2.0])
DATA = np.random.default_rng(0).normal(size=(6, 3)) * 2


def log_density(respond, draws, data):
    """With the constant, which is left out there."""
    density = jax.jit(lambda: TangentKernels.of(respond, draws).log_density(jnp.asarray(data)))()
    return np.asarray(density) - 0.5 * data.shape[1] * np.log(2 * np.pi)


def scores(count, dimension):
    return jnp.asarray(ndtri(qmc.Sobol(dimension, rng=np.random.default_rng(1)).random(count)))


def test_one_kernel_is_the_normal_distribution_of_a_linear_response():
    density = log_density(lambda u: SHIFT + SLOPE @ u, jnp.ones((1, 2)), DATA)
    normal = multivariate_normal(SHIFT, np.eye(3) + SLOPE @ SLOPE.T)
    np.testing.assert_allclose(density, normal.logpdf(DATA), rtol=1e-6)


def test_many_kernels_keep_the_distribution_of_a_linear_response():
    density = log_density(lambda u: SHIFT + SLOPE @ u, scores(512, 2), DATA)
    normal = multivariate_normal(SHIFT, np.eye(3) + SLOPE @ SLOPE.T)
    np.testing.assert_allclose(density, normal.logpdf(DATA), atol=0.05)


def curved(u):
    return jnp.stack([3 * u[0], jnp.sin(3 * u[0])])


def test_a_curved_response_is_followed_the_closer_the_more_kernels():
    """The error falls with the square of the kernels' width, count^(-2/5) in one dimension."""
    data = np.array([[1.0, 0.8], [-3.0, 0.5], [2.0, 1.5]])
    node = np.linspace(-8, 8, 20001)
    response = np.stack([3 * node, np.sin(3 * node)], axis=-1)
    log_joint = norm.logpdf(data[:, None] - response).sum(-1) + norm.logpdf(node)
    exact = np.log(np.exp(log_joint).sum(-1) * (node[1] - node[0]))
    errors = [
        np.abs(log_density(curved, scores(count, 1), data) - exact).max()
        for count in (64, 1024, 16384)
    ]
    assert errors[0] < 0.5
    # Sixteen times the kernels: 16^(2/5), a third of the error.
    assert errors[0] / errors[1] > 2 and errors[1] / errors[2] > 2


def test_nothing_unknown_leaves_the_errors():
    density = log_density(lambda u: jnp.asarray(SHIFT), jnp.zeros((4, 0)), DATA)
    np.testing.assert_allclose(density, multivariate_normal(SHIFT).logpdf(DATA), rtol=1e-12)
