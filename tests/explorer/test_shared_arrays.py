"""Large arrays that two processes have are not sent again, nor kept twice."""

import cloudpickle
import jax
import jax.numpy as jnp
import numpy as np

from bayes_placement.explorer.worker import LARGE, SharedArrays, large_arrays


def test_of_what_both_have_numbers_are_sent_wherever_it_is():
    first, second = np.arange(LARGE / 8), jnp.arange(LARGE / 4).reshape(2, -1).T
    arrays = large_arrays({"a": [first, (second, first.copy())], "few": np.ones(3)})
    assert len(arrays) == 2
    other = cloudpickle.loads(cloudpickle.dumps(arrays))  # what another process has of them
    text = SharedArrays(other).dumps([first, {"b": second}, np.ones(3)])
    assert len(text) < 1000
    again, named, few = SharedArrays(arrays).loads(text)
    assert again is first and named["b"] is second
    np.testing.assert_array_equal(few, np.ones(3))


def test_what_differs_in_a_number_a_shape_or_its_kind_is_sent():
    shared = np.zeros(LARGE)
    connection = SharedArrays([shared])
    changed = shared.copy()
    changed[-1] = 1e-300
    for array in (changed, shared.reshape(2, -1), shared.astype(np.int64), jnp.asarray(shared)):
        again = connection.loads(connection.dumps(array))
        assert again is not shared and isinstance(again, jax.Array) == isinstance(array, jax.Array)
        assert again.dtype == array.dtype
        np.testing.assert_array_equal(again, array)
