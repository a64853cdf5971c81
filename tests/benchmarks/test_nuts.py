"""Benchmark: NUTS on the paper's bar beside PyMC with nutpie, from the model to the draws.

Run with `python -m pytest tests/benchmarks/test_nuts.py -n 0`. PyMC is measured where it is
installed, `pip install pymc nutpie`. Neither takes functions that an earlier run has compiled.
"""

import json
import os
import sys
import time
from importlib.util import find_spec

import numpy as np

from tests.benchmarks.fresh import told_by
from tests.benchmarks.page import Anchor, at_least

CHAINS, WARMUP, DRAWS = 4, 1000, 2000
SIGMA, PLACE, WITHIN = 0.01, 0.25, 0.04
MODES, LINES = 15, (np.arange(1, 11) - 0.5) * 43.3


def test_nuts_beside_pymc(page, tmp_path):
    took = told_by("tests.benchmarks.test_nuts", "ours", folder=tmp_path)
    anchor = Anchor("PyMC with nutpie is not installed: pip install pymc nutpie")
    if find_spec("nutpie") and find_spec("pymc"):
        # PyTensor keeps what it has compiled, of another run too, in the home of the user.
        kept = {"PYTENSOR_FLAGS": f"base_compiledir={tmp_path / 'pytensor'}"}
        pymc = told_by("tests.benchmarks.test_nuts", "pymc", folder=tmp_path, variables=kept)
        anchor = Anchor("PyMC, nutpie", pymc["rate"])
        np.testing.assert_allclose(took["mean"], pymc["mean"], rtol=0.05)
    name = "NUTS on the bar, least effective draws a second, with compilation"
    page.add(name, took["rate"], "1/s", at_least(5), anchor=anchor, rate=True)
    least = told_by("tests.benchmarks.test_nuts", "floor", folder=tmp_path)
    anchor = Anchor("NUTS of NumPyro on a standard normal", least["seconds"])
    page.add("NUTS on the bar, compilation and draws", took["seconds"], "s", anchor=anchor)


def figures(draws, seconds):
    """Effective draws a second of the unknown that has the fewest, and means of the unknowns."""
    from arviz_stats.base import array_stats

    positions = np.moveaxis(np.asarray(draws), 2, 0)
    least = min(float(array_stats.ess(unknown, method="bulk")) for unknown in positions)
    means = positions.mean(axis=(1, 2))
    return {
        "rate": least / seconds,
        "seconds": seconds,
        "mean": sorted(np.round(means, 6).tolist()),
    }


def ours():
    import jax

    import bayes_placement as bp
    from bayes_placement._shared.progress import no_progress
    from bayes_placement.inference.infer import _named, _posterior
    from models import bar

    measured = bar.placed(PLACE, PLACE, bp.noise.Gaussian(SIGMA)).nominal_measurement()
    engine = bp.engines.NUTS(chains=CHAINS, warmup=WARMUP, draws=DRAWS)
    began = time.perf_counter()
    experiment = bar.placed(PLACE, PLACE, bp.noise.Gaussian(SIGMA))
    data = experiment.data(measured)
    key = jax.random.PRNGKey(0)
    posterior = _posterior(experiment, data, bp.marginals.Latent(), key)
    position = engine.run(posterior, key, no_progress).position
    values = _named(posterior, position)
    drawn = np.stack([values[name] for name in posterior.names], axis=-1)
    return figures(drawn, time.perf_counter() - began)


def floor():
    """NumPyro's own NUTS on as many standard normal unknowns: the least that it takes."""
    import jax
    import jax.numpy as jnp
    from numpyro.infer import MCMC, NUTS

    began = time.perf_counter()
    kernel = NUTS(potential_fn=lambda z: 0.5 * jnp.sum(z**2), dense_mass=True)
    sampler = MCMC(
        kernel,
        num_warmup=WARMUP,
        num_samples=DRAWS,
        num_chains=CHAINS,
        chain_method="vectorized",
        progress_bar=False,
    )
    start = jax.random.normal(jax.random.PRNGKey(1), (CHAINS, 4))
    sampler.run(jax.random.PRNGKey(0), init_params=start)
    return figures(sampler.get_samples(group_by_chain=True), time.perf_counter() - began)


def pymc():
    import nutpie
    import pymc as pm
    import pytensor.tensor as pt

    omega, modes = 2 * np.pi * LINES, np.arange(1, MODES + 1)
    natural = modes * np.pi * np.sqrt(1e9 / 9000)

    def output(math, ratio, sensor, actuator):
        """Log of the amplitude of the velocity [line], by a sum over real and imaginary parts."""
        residues = 2 / 9 * math.sin(modes * np.pi * sensor) * math.sin(modes * np.pi * actuator)
        stiff = (natural**2)[:, None] - omega**2
        loss = 2 * ratio[:, None] * natural[:, None] * omega
        size = stiff**2 + loss**2
        real = (residues[:, None] * stiff / size).sum(axis=0)
        imaginary = (residues[:, None] * loss / size).sum(axis=0)
        return math.log10(omega * math.sqrt(real**2 + imaginary**2))

    measured = output(np, np.full(MODES, 0.04), PLACE, PLACE)
    began = time.perf_counter()
    with pm.Model() as model:
        ratios = [pm.Uniform(f"ratio_{number}", 0.02, 0.06) for number in (1, 2)]
        places = [pm.Uniform(name, PLACE - WITHIN, PLACE + WITHIN) for name in ("s1", "a1")]
        ratio = pt.concatenate([pt.stack(ratios), np.full(MODES - 2, 0.04)])
        pm.Normal("z", output(pt, ratio, *places), SIGMA, observed=measured)
    compiled = nutpie.compile_pymc_model(model)
    trace = nutpie.sample(
        compiled, draws=DRAWS, tune=WARMUP, chains=CHAINS, seed=1, progress_bar=False
    )
    names = ["ratio_1", "ratio_2", "s1", "a1"]
    drawn = np.stack([np.asarray(trace.posterior[name]) for name in names], axis=-1)
    return figures(drawn, time.perf_counter() - began)


if __name__ == "__main__":
    print(json.dumps({"ours": ours, "floor": floor, "pymc": pymc}[sys.argv[1]]()), flush=True)
    os._exit(0)  # with threads of nutpie the interpreter may wait at its end for ever
