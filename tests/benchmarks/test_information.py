"""Benchmarks: the paper's estimate beside a plain NumPy loop of Table 1, and beside its floor.

Run with `python -m pytest tests/benchmarks/test_information.py -n 0 -s`. All times are of one
process; ratios are what counts. The floor is one product of matrices and the logarithms of the
same sizes, in single precision.
"""

import time

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import logsumexp

from bayes_placement import information
from bayes_placement.design._candidates import candidates
from bayes_placement.design._cells import Task, chunks, compute, grid
from models import bar

DRAWS, PLACES, MODES = 1000, 800, 15
CELLS = 20
LINES = bar.PAPER_LINES


def best(function, times):
    function()
    found = []
    for _ in range(times):
        began = time.perf_counter()
        function()
        found.append(time.perf_counter() - began)
    return min(found)


def paper():
    """Mode shapes at places, and spectra [draw, mode, line] of draws of the two damping ratios."""
    random = np.random.default_rng(0)
    natural, omega = 1000 / 6 * np.arange(1, MODES + 1) * 2 * np.pi, 2 * np.pi * LINES
    ratio = np.full((DRAWS, MODES), 0.04)
    ratio[:, :2] = random.uniform(0.02, 0.06, (DRAWS, 2))
    loss = 2j * (ratio * natural)[..., None] * omega
    spectra = 1j * omega / ((natural**2)[:, None] - omega**2 + loss)
    waves = np.pi * np.arange(1, MODES + 1)
    return lambda place: np.sqrt(2 / 9) * np.sin(waves * place[:, None]), spectra


def table_1(shapes, spectra):
    """Table 1 as it stands: for each draw of the parameters, draws of both places."""
    random = np.random.default_rng(1)
    measured = np.log10(np.abs(shapes(np.array([0.25])) ** 2 @ spectra[0]))[0]
    factor = (4 / (PLACES * (LINES.size + 2))) ** (1 / (LINES.size + 4))
    width = factor / np.sqrt(factor**2 + (PLACES - 1) / PLACES)
    log_likelihood = np.empty(DRAWS)
    for number, spectrum in enumerate(spectra):
        sensor, actuator = random.uniform(0.21, 0.29, (2, PLACES))
        z = np.log10(np.abs((shapes(sensor) * shapes(actuator)) @ spectrum))
        mean, deviation = z.mean(0), z.std(0, ddof=1)
        centre, scale = mean + width / factor * (z - mean), width * deviation
        terms = -0.5 * np.sum(((measured - centre) / scale) ** 2, 1)
        log_likelihood[number] = logsumexp(terms) - np.sum(np.log(scale))
    share = np.exp(log_likelihood - logsumexp(log_likelihood))
    return np.sum(share * log_likelihood) - logsumexp(log_likelihood) + np.log(DRAWS)


def floor(shapes, spectra, batch=50):
    """One product of matrices and the logarithms, a batch of draws at a time."""
    turned = np.moveaxis(spectra, 1, 2)
    parts = [jnp.asarray(one, jnp.float32) for one in (turned.real, turned.imag)]
    parts = [one.reshape(-1, batch * LINES.size, MODES) for one in parts]
    sensor, actuator = np.random.default_rng(2).uniform(0.21, 0.29, (2, PLACES))
    across = jnp.asarray((shapes(sensor) * shapes(actuator)).T, jnp.float32)

    @jax.jit
    def run():
        def some(pair):
            real, imaginary = (one @ across for one in pair)
            return jnp.sum(jnp.log(real**2 + imaginary**2))

        return jax.lax.map(some, tuple(parts))

    return lambda: jax.block_until_ready(run())


def a_map(size):
    """The computation of a map of so many cells, without what is done once."""
    experiment = bar.placed(0.25, 0.25, None)
    places = {"s1": np.linspace(0.1, 0.9, size), "a1": np.array([0.25])}
    several = candidates(experiment, places)
    values = {
        name: value for name, value in experiment.nominal_values().items() if "position" not in name
    }
    task = Task(experiment, information.KDE(n_h=DRAWS, n_p=PLACES), 0, values, {})
    (chunk,) = chunks(task, several, grid(several), size)
    return lambda: compute(chunk)


def test_the_estimate_beside_a_plain_loop_and_its_floor():
    shapes, spectra = paper()
    plain = best(lambda: table_1(shapes, spectra), 2)
    least = best(floor(shapes, spectra), 30)
    cell = best(a_map(CELLS), 3) / CELLS
    print(f"\na cell: plain loop {1e3 * plain:.0f} ms, floor {1e3 * least:.1f} ms, ", end="")
    print(f"here {1e3 * cell:.1f} ms: {plain / cell:.0f} times as fast, {cell / least:.2f} floors")


@pytest.mark.parametrize("place", [(0.25, 0.25), (0.75, 0.25), (0.5, 0.5), (0.5, 0.25), (0.3, 0.7)])
def test_quasi_random_points_beside_plain_ones(place):
    """Spread of 30 estimates of equal cost."""
    experiment = bar.placed(*place, None)
    values = experiment.nominal_values()
    spread = {}
    for points in ("sobol", "plain"):
        found = []
        for seed in range(30):
            plan = information.KDE(points=points).plan(experiment, 100 * seed)
            found.append(float(jax.jit(lambda plan=plan: plan(experiment, values).kl)()))
        spread[points] = np.std(found, ddof=1)
    ratio = spread["plain"] / spread["sobol"]
    print(
        f"\n{place}: plain {spread['plain']:.4f}, quasi-random {spread['sobol']:.4f}: {ratio:.1f}"
    )
