"""The same seed gives the same numbers in another process, with other numbers of threads.

Run with `python -m pytest tests/benchmarks/test_same_seed.py -n 0 -m long`.
"""

import numpy as np
import pytest

from tests.benchmarks.fresh import told_by
from tests.benchmarks.same_seed import METHODS

THREADS = [
    {"PJRT_NPROC": "8", "OPENBLAS_NUM_THREADS": "2"},
    {"PJRT_NPROC": "1", "OPENBLAS_NUM_THREADS": "1"},
]
"""Threads of JAX, and of NumPy and SciPy."""

pytestmark = pytest.mark.long


@pytest.mark.parametrize("method", METHODS)
def test_another_process_with_other_threads_tells_the_same(method, tmp_path):
    first, second = (
        told_by("tests.benchmarks.same_seed", method, folder=tmp_path, variables=threads)
        for threads in THREADS
    )
    assert first.keys() == second.keys()
    for name in first:
        np.testing.assert_array_equal(first[name], second[name], err_msg=name)
