"""Threads of JAX: linear algebra of batches does not wait for itself."""

import os

import pytest

from bayes_placement._types import LEAST_THREADS
from bayes_placement.design.running.executors import _thread_limits


def test_this_process_has_as_many_threads_of_jax_as_it_should():
    assert int(os.environ["PJRT_NPROC"]) >= LEAST_THREADS


@pytest.mark.parametrize(
    ("cores", "workers", "of_jax", "of_others"),
    [(2, 2, 1, 1), (2, 1, 8, 2), (16, 4, 8, 4), (64, 4, 16, 16), (1, 3, 1, 1)],
)
def test_a_worker_has_one_thread_of_jax_or_enough(monkeypatch, cores, workers, of_jax, of_others):
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    limits = _thread_limits(workers)
    assert limits["PJRT_NPROC"] == str(of_jax)
    assert limits["OPENBLAS_NUM_THREADS"] == str(of_others)
