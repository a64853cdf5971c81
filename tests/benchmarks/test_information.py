"""Benchmarks of maps of information: speed, memory, workers, and the worth of quasi-random points.

Run with `python -m pytest tests/benchmarks/test_information.py -n 0`. Ratios are what counts:
whatever is compared is measured in turns, in one process. The floor is one product of matrices and
the logarithms of the same sizes, in single precision.
"""

import multiprocessing
import re
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import logsumexp

import bayes_placement as bp
from bayes_placement import information
from bayes_placement.design._candidates import candidates, combinations
from bayes_placement.design.information.estimator import Gain, divergence
from bayes_placement.design.running.chunks import Task, chunks, compute
from models import bar
from tests.benchmarks.page import Anchor, at_least, at_most

DRAWS, PLACES, MODES = 1000, 800, 15
CELLS, ROUNDS = 50, 11
LINES = bar.PAPER_LINES
SEEDS = 30
LOOPS, FLOORS, WORKERS = 100, 1.3, 1.8
"""Times a plain loop, floors, and times one worker that are asked."""

FEW = [(0.25, 0.25), (0.75, 0.25), (0.5, 0.5), (0.5, 0.25), (0.3, 0.7)]


def shapes(places):
    """Mode shapes [place, mode] of the bar."""
    return np.sqrt(2 / 9) * np.sin(np.pi * np.arange(1, MODES + 1) * np.asarray(places)[:, None])


def spectra(ratios):
    """Spectra [draw, mode, line] for damping ratios [draw, 2] of the first two modes."""
    natural, omega = 1000 / 6 * np.arange(1, MODES + 1) * 2 * np.pi, 2 * np.pi * LINES
    ratio = np.full((len(ratios), MODES), 0.04)
    ratio[:, :2] = ratios
    loss = 2j * (ratio * natural)[..., None] * omega
    return 1j * omega / ((natural**2)[:, None] - omega**2 + loss)


def table_1(place, seed):
    """Table 1 as it stands: for each draw of the parameters, draws of both places."""
    random = np.random.default_rng(seed)
    nominal = (shapes(place[:1]) * shapes(place[1:])) @ spectra(np.full((1, 2), 0.04))[0]
    measured = np.log10(np.abs(nominal))
    factor = (4 / (PLACES * (LINES.size + 2))) ** (1 / (LINES.size + 4))
    width = factor / np.sqrt(factor**2 + (PLACES - 1) / PLACES)
    log_likelihood = np.empty(DRAWS)
    for number, spectrum in enumerate(spectra(random.uniform(0.02, 0.06, (DRAWS, 2)))):
        sensor, actuator = random.uniform(-0.04, 0.04, (2, PLACES)) + np.array(place)[:, None]
        z = np.log10(np.abs((shapes(sensor) * shapes(actuator)) @ spectrum))
        mean, deviation = z.mean(0), z.std(0, ddof=1)
        centre, scale = mean + width / factor * (z - mean), width * deviation
        terms = -0.5 * np.sum(((measured - centre) / scale) ** 2, 1)
        log_likelihood[number] = logsumexp(terms) - np.sum(np.log(scale))
    share = np.exp(log_likelihood - logsumexp(log_likelihood))
    return np.sum(share * log_likelihood) - logsumexp(log_likelihood) + np.log(DRAWS)


def floor(batch=50):
    """One product of matrices and the logarithms, a batch of draws at a time."""
    random = np.random.default_rng(2)
    turned = np.moveaxis(spectra(random.uniform(0.02, 0.06, (DRAWS, 2))), 1, 2)
    parts = [jnp.asarray(part, jnp.float32) for part in (turned.real, turned.imag)]
    parts = [part.reshape(-1, batch * LINES.size, MODES) for part in parts]
    sensor, actuator = random.uniform(0.21, 0.29, (2, PLACES))
    across = jnp.asarray((shapes(sensor) * shapes(actuator)).T, jnp.float32)

    @jax.jit
    def run(parts, across):
        def some(pair):
            real, imaginary = (part @ across for part in pair)
            return jnp.sum(jnp.log(real**2 + imaginary**2))

        return jax.lax.map(some, parts)

    return lambda: jax.block_until_ready(run(tuple(parts), across))


def some_cells(estimator, places, cells=None):
    """The computation of a map, without what is done once; of all pairs of places by default."""
    experiment = bar.placed(0.25, 0.25, None)
    positions = candidates(experiment, places)
    values = {
        name: value for name, value in experiment.nominal_values().items() if "position" not in name
    }
    chosen = combinations(positions) if cells is None else cells
    (chunk,) = chunks(Task(experiment, estimator, 0, values), positions, chosen, len(chosen))
    return lambda: compute(chunk)


def seconds(function):
    began = time.perf_counter()
    function()
    return time.perf_counter() - began


def test_a_cell_beside_a_plain_loop_and_its_floor(page):
    least = floor()
    cells = some_cells(
        information.KernelGain(draws=DRAWS, placement_draws=PLACES),
        {"s1": np.linspace(0.1, 0.9, CELLS), "a1": [0.25]},
    )
    least(), cells()  # compiled
    took = []
    for _ in range(ROUNDS):
        plain = seconds(lambda: table_1(FEW[0], 0))
        # As often as there are cells, so that other work on the machine disturbs both alike.
        low = seconds(lambda: [least() for _ in range(CELLS)]) / CELLS
        took.append([plain, low, seconds(cells) / CELLS])
    plain, low, cell = 1e3 * np.median(took, axis=0)
    anchors = Anchor("plain NumPy loop", plain), Anchor("floor", low)
    page.add("cell of a map, beside a loop", cell, "ms", at_least(LOOPS), anchor=anchors[0])
    page.add("cell of a map, beside its floor", cell, "ms", at_most(FLOORS), anchor=anchors[1])


def test_a_small_map_once_more(page):
    """What a map costs that is compiled already: the fixed part, as of a second map."""
    experiment, places = bar.placed(0.25, 0.25, None), {"s1": [0.2, 0.3], "a1": [0.25]}
    took = [seconds(lambda: bp.information_map(experiment, places)) for _ in range(4)]
    page.add("map of 2 cells, the first", took[0], "s")
    page.add("map of 2 cells, once more", min(took[1:]), "s")


def even(size):
    """Places on the bar at equal distances."""
    places = np.linspace(0.04, 0.96, size)
    return {"s1": places, "a1": places}


def peak(size):
    """Peak of resident memory [MiB] after a map of so many cells a side."""
    bp.information_map(bar.placed(0.25, 0.25, None), even(size))
    # What getrusage tells begins with the peak of the process that began this one.
    status = Path("/proc/self/status").read_text()
    return int(re.search(r"VmHWM:\s*(\d+) kB", status)[1]) / 1024


def test_memory_does_not_grow_with_the_cells(page):
    sizes, peaks = (10, 25, 49), []
    for size in sizes:
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as fresh:
            peaks.append(fresh.submit(peak, size).result())
    anchor = Anchor("10 x 10 cells", peaks[0])
    page.add("peak memory of 49 x 49 cells", peaks[-1], "MiB", at_most(1.1), anchor=anchor)
    assert peaks[-1] < 1.1 * peaks[0]


def test_a_map_on_two_workers(page):
    """Once processes have started and compiled, which takes each of them four seconds."""
    experiment, maps, took = bar.placed(0.25, 0.25, None), [], []
    kinds = {
        "here": {},
        "two processes": {"processes": 2},
        "two Dask workers": {"processes": 2, "dask": "local"},
    }
    for kind, settings in kinds.items():
        with bp.design.workers(**settings) as executor:
            bp.information_map(experiment, even(40), key=1, executor=executor)
            began = time.perf_counter()
            maps.append(bp.information_map(experiment, even(40), executor=executor))
            took.append(time.perf_counter() - began)
        anchor = None if kind == "here" else Anchor("here", took[0])
        asked = None if kind == "here" else at_least(WORKERS)
        page.add(f"map of 40 x 40 cells, {kind}", took[-1], "s", asked, anchor=anchor)
        assert maps[-1].identical(maps[0])


def spreads(points, monkeypatch):
    """Standard deviation [cell] of estimates from different seeds, all at once."""
    estimator = information.KernelGain(sampling=points)

    def gain(log_likelihood):
        replicates = log_likelihood.reshape(-1, estimator.replicates, log_likelihood.shape[-1])
        estimates = jax.vmap(lambda replicate: divergence(replicate).estimate)(replicates)
        return Gain(jnp.mean(estimates), estimates)

    monkeypatch.setattr(information.kernel_gain, "divergence", gain)
    larger = information.KernelGain(
        draws=SEEDS * estimator.draws, sampling=points, replicates=SEEDS * estimator.replicates
    )
    sensor, actuator = np.array(FEW).T
    cells = np.tile(np.arange(len(FEW))[:, None], 2)
    gains = some_cells(larger, {"s1": sensor, "a1": actuator}, cells)()[:, 1:]
    assert gains.shape == (len(FEW), SEEDS)
    return gains.std(axis=1, ddof=1)


@pytest.mark.long
def test_quasi_random_points_beside_plain_ones(monkeypatch):
    """Spread over seeds at equal cost; the ratio of two such is known to 13 %.

    Table 1 draws the places anew for each draw of the parameters, and is slow; plain points are
    shared by all of them, as quasi-random ones are.
    """
    quasi, plain = (spreads(points, monkeypatch) for points in ("sobol", "plain"))
    table = [np.std([table_1(at, seed) for seed in range(SEEDS)], ddof=1) for at in FEW]
    for place, deviation, *others in zip(FEW, quasi, plain, table, strict=True):
        print(f"\n{place}: standard deviation of quasi-random points {deviation:.4f}; ", end="")
        print(f"plain {others[0]:.4f}, {others[0] / deviation:.1f} times as much; ", end="")
        print(f"Table 1 {others[1]:.4f}, {others[1] / deviation:.1f} times", end="", flush=True)
    assert np.all(np.minimum(plain, table) > 3 * quasi)
