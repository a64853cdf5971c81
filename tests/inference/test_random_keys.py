"""Seeds as an int, a NumPy int or a JAX key are the same; others are refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement.inference.record import integer_seed, jax_key, recorded_seed

SAME = [3, np.int64(3), np.uint8(3), jnp.int32(3), jax.random.PRNGKey(3), jax.random.key(3)]


@pytest.mark.parametrize("key", SAME, ids=lambda key: type(key).__name__)
def test_integers_and_keys_of_one_seed_are_one_seed(key):
    drawn = jax.random.normal(jax_key(key), (4,))
    np.testing.assert_array_equal(drawn, jax.random.normal(jax.random.PRNGKey(3), (4,)))
    assert integer_seed(key) == 3
    assert recorded_seed(key) in (3, [0, 3])


def test_keys_that_were_split_have_seeds_of_their_own():
    keys = jax.random.split(jax.random.key(3), 50)
    seeds = [integer_seed(key) for key in keys]
    assert len(set(seeds)) == 50
    assert all(0 <= seed < 2**63 for seed in seeds)
    assert recorded_seed(keys[0]) == jax.random.key_data(keys[0]).tolist()


@pytest.mark.parametrize("key", [True, 3.0, "3", None, np.zeros(2), jax.random.split(SAME[-1])])
@pytest.mark.parametrize("function", [jax_key, integer_seed, recorded_seed])
def test_what_is_no_seed_is_refused(key, function):
    with pytest.raises(ValueError, match=r"(?s)key=.* was given; an integer or one JAX"):
        function(key)


@pytest.mark.parametrize("key", [-1, -(2**63), 2**63 - 1])
def test_any_integer_of_64_bits_is_a_seed(key):
    """NumPy takes no negative one, and JAX does."""
    np.random.default_rng(integer_seed(key))
    assert jax_key(key).shape == (2,)


@pytest.mark.parametrize("function", [integer_seed, jax_key])
def test_a_longer_integer_is_refused(function):
    with pytest.raises(ValueError, match=f"key={2**63} was given; an integer of 64 bits"):
        function(2**63)
