"""Searches on a Dask cluster of two processes: the same result, also where a worker is killed."""

import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import pandas as pd
import pytest

import bayes_placement as bp
from bayes_placement.criticism import kept_fits
from bayes_placement.criticism.missing import _shared_fits
from tests.code_blocks import ROOT, blocks, written
from tests.criticism.small import MASS, experiment, measured
from tests.design import at_work

EXTRA = 'a cluster needs pip install "bayes_placement[dask]"'
pytest.importorskip("distributed", reason=EXTRA)
pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def cluster():
    with bp.design.workers(2, dask="local") as executor:
        yield executor


def improved(executor):
    """All that was compared, and what is claimed; nothing is known from before."""
    _shared_fits._LAST.clear()
    kinds = ["point_mass", "ground_spring"]
    ledger = bp.improve(
        experiment(),
        measured(MASS, seed=2),
        candidates=bp.effects.library(experiment(), kinds),
        model_error=None,
        executor=executor,
    )
    assert ledger.verdict == ("point_mass",)
    return ledger.compared


@pytest.fixture(scope="module")
def on_cluster(cluster):
    return improved(cluster)


def parts_done(executor):
    """Parts that each worker has done."""
    done = executor._client.run(lambda dask_worker: dask_worker.state.executed_count)
    return sorted(done.values())


def test_a_posterior_on_a_cluster_is_that_of_this_machine_bit_for_bit(cluster):
    before = sum(parts_done(cluster))
    declared = bp.effects.library(experiment(), ["point_mass"]).effects[0]
    there, here = (
        bp.infer(
            experiment() + declared,
            measured(MASS, seed=2),
            engine=bp.engines.SMC(particles=200),
            executor=executor,
        )
        for executor in (cluster, None)
    )
    assert sum(parts_done(cluster)) == before + 4
    assert there["posterior"].to_dataset().identical(here["posterior"].to_dataset())


def test_a_search_on_a_cluster_is_that_of_this_machine(cluster, on_cluster):
    assert sum(parts_done(cluster)) > 0
    pd.testing.assert_frame_equal(on_cluster, improved(None), rtol=1e-6)


def test_reach_on_a_cluster_is_that_of_this_machine(cluster):
    here, there = (
        bp.reach(experiment(), measured(MASS, seed=2), executor=executor)
        for executor in (None, cluster)
    )
    pd.testing.assert_frame_equal(there.curves, here.curves, rtol=1e-6)
    assert there.words() == here.words()


def stop_once(marker, *task):
    """Do a part, but kill the worker that has the first."""
    if at_work.first(marker):
        at_work.stop(task)
    return kept_fits._in_folder(*task)  # of a worker, where it is as it was


@pytest.mark.longest
def test_a_worker_that_is_killed_changes_no_bit(cluster, on_cluster, tmp_path, monkeypatch):
    monkeypatch.setattr(kept_fits, "_in_folder", partial(stop_once, tmp_path / "killed"))
    pd.testing.assert_frame_equal(on_cluster, improved(cluster), check_exact=True)
    assert (tmp_path / "killed").exists()


@pytest.mark.longest
def test_the_script_of_the_page_searches_on_the_cluster(cluster, tmp_path):
    page = ROOT / "notebooks" / "docs" / "how_to" / "cluster.md"
    written(blocks(page.read_text()), tmp_path, "block")
    before = sum(parts_done(cluster))
    address = cluster._client.scheduler.address
    variables = os.environ | {"SCHEDULER": address, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "search.py"]
    done = subprocess.run(command, cwd=tmp_path, env=variables, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "point_mass" in done.stdout
    assert (tmp_path / "fits").is_dir() and not Path("fits").exists()  # where workers were begun
    assert sum(parts_done(cluster)) > before
