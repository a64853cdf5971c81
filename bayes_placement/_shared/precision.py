"""Double precision, and threads enough, set before JAX computes first."""

import os

import jax

LEAST_THREADS = 32
"""Least number of threads of JAX, unless it has a single one."""

# Linear algebra of a batch waits for threads of JAX while it holds one. As many such calls at once
# as there are threads wait for each other forever (jaxlib 0.10, ParallelBatchMap): on a machine of
# two cores two are enough, and each of `MOST_AT_ONCE` calls has some. Threads that wait cost a few
# percent, a single one a seventh. JAX reads this when it computes first.
os.environ.setdefault("PJRT_NPROC", str(max(LEAST_THREADS, os.cpu_count() or 1)))

# Response amplitudes span many decades and posteriors are narrow: single precision loses both.
jax.config.update("jax_enable_x64", True)
