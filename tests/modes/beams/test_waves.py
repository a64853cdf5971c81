"""Cosine and sine of many phases at once are those of NumPy; so are shapes of bars and beams."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.modes.beams.waveguide import cosine_and_sine, many_phases

SIZES = {"length": 1.3, "area": 1e-4, "youngs_modulus": 7e10, "density": 2700.0}
STRUCTURES = {
    "bar": bp.beams.bar(15, **SIZES),
    "free bar": bp.beams.bar(4, **SIZES, ends="free-free"),
    "beam": bp.beams.beam(12, **SIZES, second_moment=1e-9, ends="clamped-free"),
}


@pytest.mark.parametrize("largest", [3.0, 100.0, 1e4])
def test_they_are_right_to_the_last_bit_but_one(largest):
    phase = np.random.default_rng(0).uniform(-largest, largest, 100_000)
    with many_phases():
        cosine, sine = jax.jit(cosine_and_sine)(phase)
        second = jax.jit(jax.vmap(jax.grad(jax.grad(lambda x: cosine_and_sine(x)[1]))))(phase)
    np.testing.assert_allclose(cosine, np.cos(phase), rtol=0, atol=3e-16)
    np.testing.assert_allclose(sine, np.sin(phase), rtol=0, atol=3e-16)
    np.testing.assert_allclose(second, -np.sin(phase), rtol=0, atol=3e-16)


@pytest.mark.parametrize("name", STRUCTURES)
@pytest.mark.parametrize("derivative", [0, 1, 2, 3])
def test_shapes_are_the_same(name, derivative):
    modes = STRUCTURES[name]

    def shapes(position):
        return modes.shapes(position, derivative)

    position = jnp.linspace(0.0, 1.3, 41)
    with many_phases():
        at_once = jax.vmap(shapes)(position)
    usual = jax.vmap(shapes)(position)
    assert jnp.any(at_once != usual)  # computed in another way
    np.testing.assert_allclose(at_once, usual, rtol=0, atol=1e-12 * np.abs(usual).max())
