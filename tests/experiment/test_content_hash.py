"""The hash of numbers is that of their values, however they lie in memory."""

import pickle

import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement.experiment import content_hash as module
from bayes_placement.experiment.content_hash import LARGE, content_hash

NUMBERS = np.arange(12.0).reshape(3, 4)


@pytest.mark.parametrize(
    "array", [np.asfortranarray(NUMBERS), np.stack([NUMBERS, NUMBERS], axis=-1)[..., 0]]
)
def test_another_order_in_memory_has_the_same_hash(array):
    in_another_process = pickle.loads(pickle.dumps(array))
    assert content_hash(NUMBERS) == content_hash(array) == content_hash(in_another_process)


@pytest.mark.parametrize(
    "array", [NUMBERS.T, NUMBERS.ravel(), NUMBERS.astype(np.float32), NUMBERS + 1e-12]
)
def test_other_numbers_shapes_and_types_have_another_hash(array):
    assert content_hash(NUMBERS) != content_hash(array)


def test_a_large_array_is_read_once_and_forgotten_with_it(monkeypatch):
    monkeypatch.setattr(module, "_KEPT", {})
    read = []
    of_numbers = module._numbers
    monkeypatch.setattr(module, "_numbers", lambda array: read.append(1) or of_numbers(array))
    numbers = np.arange(LARGE / 8)
    arrays = [jnp.asarray(numbers), jnp.asarray(numbers + 1)]
    hashes = [content_hash(array) for array in (*arrays, *arrays, numbers)]
    assert hashes[:2] == hashes[2:4] and hashes[0] == hashes[4] != hashes[1]
    assert len(read) == 3 and len(module._KEPT) == 2
    del arrays
    assert not module._KEPT
