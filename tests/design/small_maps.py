"""A map of twelve cells, a chunk each; what workers do in the tests; and a run that can be killed.

`python -m tests.design.small_maps STORE LOG [ADDRESS]` computes it slowly and keeps it in STORE.
"""

import os
import sys
import time
from functools import partial
from pathlib import Path

import numpy as np

import bayes_placement as bp
from bayes_placement import information
from bayes_placement.design._candidates import candidates, combinations
from bayes_placement.design.running import chunks as chunking
from bayes_placement.design.running import evaluation
from bayes_placement.design.running.evaluation import nominal_values
from bayes_placement.experiment.content_hash import content_hash
from models import bar
from tests.design import at_work
from tests.effects import models_in_space

SMALL = information.KernelGain(draws=128, placement_draws=64)
PLACES = {"s1": np.array([0.25, 0.4, 0.6, 0.75]), "a1": np.array([0.3, 0.5, 0.75])}
CELLS = 12


def computed(**settings):
    """The map."""
    experiment = bar.placed(0.3, 0.3, None)
    return bp.information_map(experiment, PLACES, estimator=SMALL, chunk=1, **settings)


def chunks(estimator=SMALL, seed=0, size=1, places=PLACES):
    """Chunks of the map."""
    experiment = bar.placed(0.3, 0.3, None)
    values = nominal_values(experiment, list(places), {}, {})
    moved = candidates(experiment, places)
    task = chunking.Task(experiment, estimator, seed, values)
    return chunking.chunks(task, moved, combinations(moved), size)


def structures():
    """Modes of structures in space, whose last bits depend on the threads that solve for them."""
    return [models_in_space.frame().modes, models_in_space.plate().modes]


def hashes(structures):
    """Hashes of a chunk of the map and of some structures."""
    return [chunks()[3].content(), *map(content_hash, structures)]


def number(chunk):
    """Which of the chunks it is."""
    return int(np.ravel_multi_index(tuple(chunk.candidates[0]), (4, 3)))


def stop_once(marker, chunk):
    """Compute a chunk, but kill the worker that has the sixth, the first time."""
    if number(chunk) == 5 and at_work.first(marker):
        at_work.stop(chunk)
    return chunking.compute_packed(chunk)


def slowly(chunk):
    """Compute a chunk, but not at once."""
    time.sleep(0.3)
    return chunking.compute_packed(chunk)


def where(chunk):
    """Instead of each number of a chunk, the process that was given it."""
    time.sleep(0.05)  # so that the other helps
    return np.full((len(chunk.candidates), 1 + SMALL.replicates), float(os.getpid()))


def fail(chunk):
    """Compute a chunk, but for the second."""
    time.sleep(0.1 + 0.2 * (number(chunk) == 1))
    if number(chunk) == 1:
        raise ValueError("Stiffness was given as zero.")
    return chunking.compute_packed(chunk)


def logged(log, chunk):
    """Compute a chunk slowly and say which, and where."""
    gain = chunking.compute_packed(chunk)
    time.sleep(0.15 + 0.02 * number(chunk))
    with log.open("a") as lines:
        lines.write(f"{number(chunk)} {os.getpid()}\n")
    return gain


def main(store, log, *address):
    """Compute the map slowly, here or on the cluster at an address."""
    evaluation.compute = lambda chunk: logged(Path(log), chunk.packed())
    evaluation.compute_packed = partial(logged, Path(log))
    local = 2 if address == ("local",) else None
    with bp.design.workers(local, dask=address[0] if address else None) as executor:
        computed(store=store, executor=executor)


if __name__ == "__main__":
    main(*sys.argv[1:])
