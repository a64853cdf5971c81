"""Speed and full reference tables of the bar; run with `python -m pytest tests/benchmarks -n 0 -s`.

Times are for reading, ratios and errors are what is asserted.
"""

import time

import numpy as np
import pytest

import bayes_placement as bp
from models import bar
from tests.benchmarks.page import Anchor, at_least, at_most

ROWS = [
    (0.05, (0.25, 0.25), (0.040452, 0.27688, 0.040363, 0.16065, 0.4071, 17.7560)),
    (0.05, (0.50, 0.50), (0.039689, 0.27471, 0.040139, 0.28783, 0.0087, 18.6788)),
    (0.05, (0.30, 0.70), (0.038978, 0.28618, 0.039765, 0.16656, 0.3907, 18.4533)),
    (0.02, (0.25, 0.25), (0.039528, 0.24154, 0.040006, 0.06489, 1.3873, 24.3053)),
    (0.02, (0.50, 0.50), (0.039093, 0.21207, 0.040092, 0.28776, 0.1815, 26.4758)),
    (0.02, (0.30, 0.70), (0.037125, 0.25514, 0.039713, 0.06790, 1.3731, 25.1947)),
    (0.01, (0.25, 0.25), (0.039385, 0.15373, 0.039983, 0.03240, 2.4862, 28.9118)),
    (0.01, (0.50, 0.50), (0.039610, 0.11574, 0.040040, 0.28778, 0.7544, 32.0588)),
    (0.01, (0.30, 0.70), (0.037468, 0.17092, 0.039846, 0.03395, 2.3958, 29.8493)),
]
ENGINES = {"SMC": bp.engines.SMC(particles=4000), "NUTS": bp.engines.NUTS()}


@pytest.mark.long
@pytest.mark.parametrize("name", ENGINES)
@pytest.mark.parametrize(("sigma", "places", "expected"), ROWS)
def test_exact_table_by_sampling(name, sigma, places, expected):
    experiment = bar.placed(*places, bp.noise.Gaussian(sigma))
    began = time.perf_counter()
    result = bp.infer(experiment, experiment.nominal_measurement(), engine=ENGINES[name], key=1)
    seconds = time.perf_counter() - began
    estimates = result["estimates"].to_dataset()
    deviations = [
        float((estimates[figure][ratio] - value) / estimates[f"{figure}_error"][ratio])
        for value, (ratio, figure) in zip(
            expected, [(0, "mean"), (0, "cv"), (1, "mean"), (1, "cv")], strict=False
        )
    ]
    kl = float(estimates["kl_parameters"]) - expected[4]
    evidence = float(estimates["log_evidence"]) - expected[5]
    print(
        f"\n{name} sigma {sigma} at {places}: {np.round(deviations, 1)} standard errors, KL off by "
        f"{kl:+.3f}, log evidence by {evidence:+.3f}, R-hat {float(estimates['r_hat'].max()):.4f}, "
        f"{seconds:.1f} s"
    )
    assert np.all(np.abs(deviations) < 5)
    if name == "SMC":
        assert abs(kl) < 0.1
        assert abs(evidence) < 0.1


@pytest.mark.parametrize(
    "engine", [bp.engines.NUTS(), bp.engines.SMC(particles=2000)], ids=["NUTS", "SMC"]
)
def test_one_fit_takes_less_than_half_a_minute(engine, page):
    experiment = bar.placed(0.25, 0.25, bp.noise.Gaussian(0.01))
    measurement = experiment.nominal_measurement()
    began = time.perf_counter()
    result = bp.infer(experiment, measurement, engine=engine)
    seconds = time.perf_counter() - began
    r_hat = float(result["estimates"]["r_hat"].max())
    assert page.add(f"infer on the bar, {type(engine).__name__}", seconds, "s", at_most(30)).met
    assert r_hat < 1.01


def test_all_prior_draws_at_once_beat_a_loop(page):
    """Paper's sizes of one configuration, against a plain NumPy loop of Table 1 over h."""
    from bayes_placement.inference.unconstrained import UnconstrainedModel

    experiment = bar.placed(0.25, 0.25, None)
    data = experiment.data(experiment.nominal_measurement())
    marginal = bp.marginals.KDE()
    distributions = {unknown.name: unknown.distribution for unknown in marginal.sampled(experiment)}
    import jax

    target = UnconstrainedModel(
        marginal.model(experiment, data, jax.random.PRNGKey(0)), distributions
    )
    vectors = target.sample_prior(jax.random.PRNGKey(1), 1000)
    evaluate = jax.jit(jax.vmap(target.log_likelihood))
    evaluate(vectors).block_until_ready()  # compiled
    took = []
    for _ in range(11):
        began = time.perf_counter()
        evaluate(vectors).block_until_ready()
        took.append(time.perf_counter() - began)
    anchor = Anchor("plain NumPy loop", 1e3 * _numpy_loop(100) * 10)
    name = "likelihoods of 1000 draws, densities over 800 places"
    assert page.add(name, 1e3 * np.median(took), "ms", at_least(2), anchor=anchor).met


def _numpy_loop(draws):
    """Seconds that a plain loop of Table 1 takes for so many draws of h."""
    random = np.random.default_rng(0)
    modes = np.arange(1, 16)
    natural, omega = modes * np.pi * np.sqrt(1e9 / 9000), 2 * np.pi * bar.PAPER_LINES
    began = time.perf_counter()
    for _ in range(draws):
        ratio = np.full(15, 0.04)
        ratio[:2] = random.uniform(0.02, 0.06, 2)
        modal = 1 / (natural[:, None] ** 2 - omega**2 + 2j * (ratio * natural)[:, None] * omega)
        places = random.uniform(0.21, 0.29, (2, 800, 1))
        shapes = np.sqrt(2 / 9) * np.sin(modes * np.pi * places)
        z = np.log10(np.abs(omega * ((shapes[0] * shapes[1]) @ modal)))
        np.exp(-0.5 * ((z - z[0]) / z.std(0)) ** 2).prod(axis=1).mean()
    return time.perf_counter() - began
