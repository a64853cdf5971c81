"""Threads of JAX: linear algebra of batches does not wait for itself."""

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import jax
import jax.numpy as jnp
import pytest

from bayes_placement._shared.executors import _thread_limits
from bayes_placement._shared.precision import LEAST_THREADS


def test_a_process_has_as_many_threads_of_jax_as_it_should():
    """Where nothing is said: tests have one each, since they share the cores."""
    environment = {name: os.environ[name] for name in os.environ if name != "PJRT_NPROC"}
    code = "import os, bayes_placement._shared.precision; print(os.environ['PJRT_NPROC'])"
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert int(done.stdout) >= LEAST_THREADS


TASKS = Path("/proc/self/task")


@pytest.mark.skipif(not TASKS.is_dir(), reason="this system does not list the threads of a process")
def test_jax_has_read_how_many_threads_it_should_have():
    # Had it computed before the number was set, it would have one for each core.
    jax.block_until_ready(jnp.zeros(3) + 1)
    names = []
    for task in TASKS.iterdir():
        with suppress(OSError):  # it has ended meanwhile
            names.append((task / "comm").read_text().strip())
    assert names.count("tf_XLAEigen") == int(os.environ["PJRT_NPROC"])


@pytest.mark.parametrize(
    ("cores", "workers", "of_jax", "of_others"),
    [(2, 2, 1, 1), (2, 1, 32, 2), (16, 4, 32, 4), (256, 4, 64, 64), (1, 3, 1, 1)],
)
def test_a_worker_has_one_thread_of_jax_or_enough(monkeypatch, cores, workers, of_jax, of_others):
    monkeypatch.setattr(os, "cpu_count", lambda: cores)
    limits = _thread_limits(workers)
    assert limits["PJRT_NPROC"] == str(of_jax)
    assert limits["OPENBLAS_NUM_THREADS"] == str(of_others)
