"""Tempered Monte Carlo over many unknowns, and where some of its populations are stuck."""

from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
import numpyro
import numpyro.distributions as dist
import pytest
from arviz_stats.base import array_stats
from scipy.special import gammaln, logsumexp

from bayes_placement import engines
from bayes_placement._shared.parts import done_by
from bayes_placement._shared.progress import no_progress
from bayes_placement.inference.unconstrained import UnconstrainedModel

MANY = 30
COUNTS = np.geomspace(1, 300, MANY).round()
RATES = np.log(COUNTS) - 1.0
TURNED = np.linalg.qr(np.random.default_rng(0).normal(size=(MANY, MANY)))[0]


def counted():
    """Counts whose log rates are turned axes: in these the posterior is a product, all skew."""
    x = numpyro.sample("x", dist.Normal(jnp.zeros(MANY), 1.0).to_event(1))
    numpyro.sample("y", dist.Poisson(jnp.exp(TURNED @ x + RATES)), obs=jnp.asarray(COUNTS))


def quadrature():
    """Mean and standard deviation along each turned axis, and the log evidence."""
    nodes = np.linspace(-8.0, 8.0, 4001)
    rate = nodes + RATES[:, None]
    log_density = -0.5 * nodes**2 + COUNTS[:, None] * rate - np.exp(rate)
    total = logsumexp(log_density, axis=1, keepdims=True)
    weight = np.exp(log_density - total)
    mean = weight @ nodes
    constants = np.log(nodes[1] - nodes[0]) - 0.5 * np.log(2 * np.pi) - gammaln(COUNTS + 1)
    return mean, np.sqrt(weight @ nodes**2 - mean**2), np.sum(total[:, 0] + constants)


@pytest.mark.long
@pytest.mark.longest
def test_thirty_unknowns_mix():
    particles = 1000
    target = UnconstrainedModel(counted, {"x": dist.Normal(jnp.zeros(MANY), 1.0).to_event(1)})
    draws = engines.SMC(particles=particles, populations=2).run(
        target, jax.random.PRNGKey(1), no_progress
    )
    turned = np.asarray(draws.position) @ TURNED.T
    mean, deviation, log_evidence = quadrature()
    off = (turned.mean(axis=(0, 1)) - mean) / deviation
    wider = turned.std(axis=(0, 1)) / deviation - 1
    assert np.all(np.abs(off) < 5 / np.sqrt(particles))
    assert np.all(np.abs(wider) < 5 / np.sqrt(2 * particles))
    assert np.max(array_stats.rhat(np.moveaxis(turned, 2, 0))) < 1.05
    # Walks alone do not keep up with the temperature: their evidence is 1.8 too high, 7 errors.
    assert abs(draws.log_evidence - log_evidence) < 5 * draws.log_evidence_error
    assert draws.log_evidence_error < 0.5
    assert not draws.warnings


def lesser_mode():
    x = numpyro.sample("x", dist.Uniform(-3.0, 5.0))
    wide, narrow = (dist.Normal(*mode).log_prob(x) for mode in ((-2.0, 0.3), (2.0, 0.01)))
    numpyro.factor("y", jnp.logaddexp(wide, 10.0 + narrow))


def test_populations_that_end_in_lesser_modes_count_for_nothing():
    # The mode at 2 has e^10 times the evidence; so few particles hit it in two of four populations.
    target = UnconstrainedModel(lesser_mode, {"x": dist.Uniform(-3.0, 5.0)})
    engine = engines.SMC(particles=80, prior_draws=1)
    draws = engine.run(target, jax.random.PRNGKey(1), no_progress)
    x = np.asarray(jax.vmap(jax.vmap(target.constrain))(draws.position)["x"])
    np.testing.assert_allclose(x.mean(axis=1), 2.0, atol=0.02)
    assert not np.array_equal(*x[np.argsort(x.mean(axis=1))][:2])  # a copy has moved on
    (sentence,) = draws.warnings
    assert "2 of 4 independent SMC populations ended in modes of less than a hundredth" in sentence
    assert abs(draws.log_evidence - (10.0 - np.log(8.0))) < 5 * draws.log_evidence_error


SMALL = engines.SMC(particles=160, prior_draws=2)


def tempered(progress=no_progress):
    target = UnconstrainedModel(lesser_mode, {"x": dist.Uniform(-3.0, 5.0)})
    return SMALL.run(target, jax.random.PRNGKey(1), progress)


def test_an_executor_does_every_population_and_changes_nothing():
    with ThreadPoolExecutor(1) as pool:
        given = []
        submit = pool.submit
        pool.submit = lambda *task: given.append(task) or submit(*task)
        with done_by(pool):
            draws = tempered()
    assert len(given) == SMALL.populations
    here = tempered()
    np.testing.assert_array_equal(draws.position, here.position)
    assert draws.log_evidence == here.log_evidence


def test_the_share_that_is_done_grows_within_a_population():
    shares = []
    tempered(shares.append)
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert sum(0 < share < 0.25 for share in shares) > 1
