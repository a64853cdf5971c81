"""Dask: the same map from two local workers, also when one is killed, or the whole run."""

import os
import sys
from functools import partial

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement import information
from bayes_placement._shared import executors
from bayes_placement.design.running import chunks as chunking
from bayes_placement.design.running import evaluation
from models import bar
from tests.design import killed, small_maps

EXTRA = 'a cluster needs pip install "bayes_placement[dask]"'
dask = pytest.importorskip("dask", reason=EXTRA)
distributed = pytest.importorskip("distributed", reason=EXTRA)


@pytest.fixture(scope="module")
def cluster():
    with bp.design.workers(2, dask="local") as executor:
        yield executor


@pytest.fixture(scope="module")
def full_map():
    return small_maps.computed()


@pytest.mark.long
def test_the_map_is_the_same_bit_for_bit(cluster, full_map):
    shares = []
    assert small_maps.computed(executor=cluster, progress=shares.append).identical(full_map)
    np.testing.assert_allclose(shares, np.arange(13) / 12)


@pytest.mark.long
def test_a_scheduler_is_found_by_its_address(cluster, full_map):
    address = cluster._client.scheduler.address
    with bp.design.workers(dask=address) as executor:
        assert small_maps.computed(executor=executor).identical(full_map)


@pytest.mark.long
@pytest.mark.longest
def test_a_worker_that_is_killed_half_way_loses_nothing(cluster, full_map, tmp_path, monkeypatch):
    marker = tmp_path / "killed"
    monkeypatch.setattr(evaluation, "compute_packed", partial(small_maps.stop_once, marker))
    assert small_maps.computed(executor=cluster).identical(full_map)
    worker = int(marker.read_text())
    assert worker != os.getpid()
    killed.until(lambda: killed.gone(worker))


@pytest.mark.long
def test_an_error_arrives_in_words_and_leaves_nothing_waiting(cluster, monkeypatch):
    monkeypatch.setattr(evaluation, "compute_packed", small_maps.fail)
    with pytest.raises(ValueError, match="Stiffness was given as zero"):
        small_maps.computed(executor=cluster)
    futures = cluster._client.futures
    assert not [future for future in futures.values() if future.status == "pending"]


@pytest.mark.long
def test_an_estimate_that_cannot_be_made_is_refused_by_its_own_words(cluster):
    experiment = bar.placed(0.3, 0.3, None)
    with pytest.raises(ValueError, match=r"was given an experiment with noise=None; the output"):
        bp.information_map(
            experiment, {"s1": [0.2]}, estimator=information.Exact(), executor=cluster
        )


@pytest.mark.long
@pytest.mark.longest
@pytest.mark.parametrize(
    "whose",
    ["its own workers", "workers that live on"],
)
def test_a_run_that_is_killed_goes_on(whose, cluster, full_map, tmp_path, monkeypatch):
    client = cluster._client
    is_local = whose == "its own workers"
    before, workers = killed.killed_half_way(
        tmp_path, "local" if is_local else client.scheduler.address
    )
    killed.until(lambda: not any(client.processing().values()))  # no abandoned chunk is computed
    killed.until(lambda: not is_local or all(map(killed.gone, workers)))
    counted, packed = [], chunking.Chunk.packed

    def count(chunk):
        counted.append(chunk)
        return packed(chunk)

    def run_again():
        result = small_maps.computed(executor=cluster, store=tmp_path / "store")
        assert result.identical(full_map)

    monkeypatch.setattr(chunking.Chunk, "packed", count)
    # Workers that live on finish the chunk that each has begun.
    killed.goes_on(tmp_path, before, run_again, counted, twice=1 if is_local else 2)


def test_an_address_and_a_number_of_workers_are_refused():
    with (
        pytest.raises(ValueError, match=r"2 workers were asked for together with .* tcp://host:1"),
        bp.design.workers(2, dask="tcp://host:1"),
    ):
        pass


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "no such thing"])
def test_a_scheduler_that_does_not_answer_is_named(address):

    with (
        dask.config.set({"distributed.comm.timeouts.connect": "0.5s"}),
        pytest.raises(ConnectionError, match=f"No Dask scheduler answers at {address}"),
        bp.design.workers(dask=address),
    ):
        pass


def test_without_dask_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(ImportError, match=r'pip install "bayes_placement\[dask\]"'):
        executors._distributed()
