"""The logarithm of single precision is that of NumPy, also at the ends of its range."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement.experiment.observe import log10


@pytest.mark.parametrize(("low", "high"), [(-86.0, 88.0), (-1.0, 1.0), (-1e-3, 1e-3)])
def test_it_is_within_three_units_of_rounding(low, high):
    value = np.exp(np.random.default_rng(0).uniform(low, high, 200_000)).astype(np.float32)
    exact = np.log10(value.astype(float))
    unit = np.spacing(np.abs(exact).astype(np.float32))
    assert np.max(np.abs(np.asarray(jax.jit(log10)(value), dtype=float) - exact) / unit) < 3


def test_it_has_the_values_and_the_slope_of_a_logarithm_everywhere():
    value = jnp.array([0.0, 1.0, 10.0, jnp.inf, jnp.nan], jnp.float32)
    np.testing.assert_array_equal(log10(value), [-np.inf, 0.0, 1.0, np.inf, np.nan])
    slope = jax.grad(log10)(jnp.float32(2.0))
    assert float(slope) == pytest.approx(1 / (2 * np.log(10)), rel=1e-6)


def test_double_precision_is_kept():
    value = jnp.array([1e-300, 2.0, 1e300])
    np.testing.assert_allclose(log10(value), np.log10(value), rtol=1e-15)
