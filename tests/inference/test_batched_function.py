"""Batches at any number of points, on several threads."""

import os
import threading

import numpy as np
import pytest

from bayes_placement.inference import batches
from bayes_placement.inference.batches import BATCH, BatchedFunction


def squares_and_sums(points, factor):
    return factor * points**2, points.sum(axis=1)


@pytest.mark.parametrize("count", [1, BATCH - 1, BATCH, BATCH + 1, 5 * BATCH + 3])
def test_values_are_those_of_each_point(count):
    points = np.random.default_rng(count).normal(size=(count, 3))
    evaluated = BatchedFunction(squares_and_sums)
    for _ in range(2):  # alone at first, then on several threads
        squares, sums = np.full((count, 3), np.nan), np.full(count, np.nan)
        evaluated.fill((squares, sums), points, 2.0)
        np.testing.assert_array_equal(squares, 2.0 * points**2)
        np.testing.assert_array_equal(sums, points.sum(axis=1))


def test_the_first_batch_is_alone_and_later_ones_meet(monkeypatch):
    """What is compiled at its first call is compiled once; then two batches run at once."""
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setenv("PJRT_NPROC", "2")
    batches._threads.cache_clear()
    together, first = threading.Barrier(2, timeout=30), threading.Event()

    def met(points):
        if first.is_set():
            together.wait()  # breaks where the other batch waits for this one
        else:
            assert threading.current_thread() is threading.main_thread()
            first.set()
        return (points,)

    try:
        BatchedFunction(met).fill([np.zeros((3 * BATCH, 1))], np.zeros((3 * BATCH, 1)))
    finally:
        batches._threads.cache_clear()


def test_beside_other_processes_there_are_no_threads(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    monkeypatch.setenv("PJRT_NPROC", "1")
    batches._threads.cache_clear()
    try:
        main = threading.current_thread()
        assert batches.threaded_map(lambda _: threading.current_thread(), [1, 2, 3]) == [main] * 3
    finally:
        batches._threads.cache_clear()


def test_on_a_single_core_there_are_no_threads(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    batches._threads.cache_clear()
    try:
        assert batches._threads(os.getpid()) is None
        assert batches.threaded_map(str, [1, 2, 3]) == ["1", "2", "3"]
    finally:
        batches._threads.cache_clear()
