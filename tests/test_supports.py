"""supports: the uniform law of a glued position, and Gauss quadrature over a law."""

import sys

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest

from bayes_placement import supports
from bayes_placement._types import InfeasibleError


def limits(segment, bounds=(0.0, 1.0)):
    law = segment.law(bounds)
    assert isinstance(law, dist.Uniform)
    return float(law.low), float(law.high)


def test_a_segment_is_uniform_to_both_sides():
    np.testing.assert_allclose(limits(supports.Segment(0.25, within=0.04)), (0.21, 0.29))


@pytest.mark.parametrize(
    ("centre", "within", "expected"),
    [(0.01, 0.04, (0.0, 0.05)), (0.98, 0.04, (0.94, 1.0)), (1.02, 0.04, (0.98, 1.0))],
)
def test_a_segment_is_clipped_to_the_structure(centre, within, expected):
    np.testing.assert_allclose(limits(supports.Segment(centre, within=within)), expected)


@pytest.mark.parametrize("centre", [1.3, -0.3, 1.04])
def test_a_segment_beside_the_structure_is_refused(centre):
    with pytest.raises(ValueError, match=r"has no point on the structure \(0 to 1 m\)"):
        supports.Segment(centre, within=0.04).law((0.0, 1.0))


@pytest.mark.parametrize("within", [0.0, -0.01, float("nan")])
def test_a_tolerance_must_be_positive(within):
    with pytest.raises(ValueError, match=r"a positive tolerance \[m\] is needed.*at=0.5"):
        supports.Segment(0.5, within=within)


@pytest.mark.parametrize(
    ("law", "between"),
    [
        (dist.Uniform(0.21, 0.29), (0.0, 1.0)),
        (dist.Uniform(0.21, 0.29), (0.25, 0.5)),
        (dist.Exponential(2.0), (0.1, 0.9)),
        (dist.Normal(3.0, 0.5), (0.2, 0.7)),
    ],
)
def test_quadrature_integrates_over_a_part_of_a_law(law, between):
    node, weight = jax.jit(lambda: supports.quadrature(law, 40, between))()
    np.testing.assert_allclose(jnp.sum(weight), between[1] - between[0], rtol=1e-12)
    # A second rule, in the value instead of the probability.
    low, high = np.asarray(jax.jit(law.icdf)(np.array(between)))
    value, share = np.polynomial.legendre.leggauss(80)
    value = low + (high - low) * (value + 1) / 2
    density = np.exp(jax.jit(law.log_prob)(value)) * (high - low) / 2
    expected = np.sum(share * density * np.sin(5 * value))
    np.testing.assert_allclose(jnp.sum(weight * jnp.sin(5 * node)), expected, rtol=1e-9)


def test_quadrature_over_a_uniform_law_is_exact_for_polynomials():
    node, weight = supports.quadrature(dist.Uniform(-1.0, 3.0), 3)
    np.testing.assert_allclose(jnp.sum(weight * node**5), (3**6 - 1) / 6 / 4, rtol=1e-13)


def test_quadrature_of_a_vector_is_refused():
    law = dist.Uniform(jnp.zeros(3), jnp.ones(3)).to_event(1)
    with pytest.raises(
        InfeasibleError, match=r"needs scalar unknowns, but one has the shape \(3,\)"
    ):
        supports.quadrature(law, 4)


def test_quadrature_of_a_law_that_cannot_be_inverted_is_refused():
    law = dist.VonMises(0.0, 3.0)
    with pytest.raises(InfeasibleError, match=r"which VonMises lacks. Use marginals.Latent\(\)"):
        supports.quadrature(law, 4)


def test_quadrature_of_a_law_whose_inverse_is_not_installed_is_refused(monkeypatch):
    # NumPyro inverts a beta law by TensorFlow Probability, which is no dependency of ours.
    monkeypatch.setitem(sys.modules, "tensorflow_probability", None)
    with pytest.raises(InfeasibleError, match=r"which Beta lacks. Use marginals.Latent\(\)"):
        supports.quadrature(dist.Beta(2.0, 5.0), 4)
