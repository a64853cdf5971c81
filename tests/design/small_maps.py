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
from bayes_placement.design._candidates import candidates
from bayes_placement.design._question import nominal_values
from bayes_placement.design.running import _cells, _running
from bayes_placement.design.running._fingerprint import fingerprint
from models import bar
from tests.design import at_work
from tests.effects import models_in_space

SMALL = information.KDE(draws=128, placement_draws=64)
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
    several = candidates(experiment, places)
    task = _cells.Task(experiment, estimator, seed, values, {})
    return _cells.chunks(task, several, _cells.grid(several), size)


def structures():
    """Modes of structures in space, whose last bits depend on the threads that solve for them."""
    return [models_in_space.frame().modes, models_in_space.plate().modes]


def fingerprints(several):
    """Names of what is computed for a bar and for some structures."""
    return [chunks()[3].content(), *(fingerprint(one) for one in several)]


def number(sent):
    """Which of the chunks it is."""
    return int(np.ravel_multi_index(tuple(sent.candidate[0]), (4, 3)))


def stop_once(marker, sent):
    """Compute a chunk, but kill the worker that has the sixth, the first time."""
    if number(sent) == 5 and at_work.first(marker):
        at_work.stop(sent)
    return _cells.compute_sent(sent)


def fail(sent):
    """Compute a chunk, but for the second."""
    time.sleep(0.1 + 0.2 * (number(sent) == 1))
    if number(sent) == 1:
        raise ValueError("Stiffness was given as zero.")
    return _cells.compute_sent(sent)


def logged(log, sent):
    """Compute a chunk slowly and say which, and where."""
    result = _cells.compute_sent(sent)
    time.sleep(0.4 + 0.05 * number(sent))
    with log.open("a") as said:
        said.write(f"{number(sent)} {os.getpid()}\n")
    return result


def main(store, log, *address):
    """Compute the map slowly, here or on the cluster at an address."""
    _running.compute = lambda chunk: logged(Path(log), chunk.sent())
    _running.compute_sent = partial(logged, Path(log))
    local = 2 if address == ("local",) else None
    with bp.design.workers(local, dask=address[0] if address else None) as executor:
        computed(store=store, executor=executor)


if __name__ == "__main__":
    main(*sys.argv[1:])
