"""The hash of numbers is that of their values, however they lie in memory."""

import pickle

import numpy as np
import pytest

from bayes_placement.experiment.content_hash import content_hash

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
