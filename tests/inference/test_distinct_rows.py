"""Different rows against those that NumPy sorts."""

import numpy as np
import pytest

from bayes_placement.inference.batches import distinct_rows


@pytest.mark.parametrize("kind", [float, np.uint8, bool])
def test_rows_are_told_apart_and_put_together_again(kind):
    rows = np.random.default_rng(0).integers(0, 2, (60, 4)).astype(kind)
    first, which = distinct_rows(rows)
    np.testing.assert_array_equal(rows[first][which], rows)
    assert len(first) == len(np.unique(rows, axis=0)) < 60
    assert all(index == np.flatnonzero(which == number)[0] for number, index in enumerate(first))


def test_rows_without_numbers_are_alike():
    first, which = distinct_rows(np.zeros((3, 0)))
    np.testing.assert_array_equal(first, [0])
    np.testing.assert_array_equal(which, [0, 0, 0])
