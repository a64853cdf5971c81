"""Draws from priors of one form in one program."""

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.experiment.prior_draws import draws_from_priors, prior_draws
from tests.criticism.small import experiment


def program():
    def drawn(low, high, keys):
        priors = {name: dist.Uniform(low[number], high[number]) for number, name in enumerate("ab")}
        return prior_draws(priors, keys)

    keys = jax.random.split(jax.random.key(0), (5, 2))
    return str(jax.make_jaxpr(drawn)(jnp.zeros(2), jnp.ones(2), keys))


@pytest.fixture
def gathered(monkeypatch):
    """NumPyro gathers the fields of a distribution in this order."""

    def gather(*names):
        monkeypatch.setattr(dist.Uniform, "gather_pytree_data_fields", lambda: names)

    return gather


def test_the_program_is_the_same_in_whatever_order_numpyro_gathers_fields(gathered):
    gathered("low", "high")
    first = program()
    gathered("high", "low")
    assert program() == first


@pytest.mark.parametrize("key", [5, jax.random.key(5)], ids=["seed", "key"])
def test_draws_are_those_of_each_prior_by_itself(key):
    setup = experiment() + bp.effects.point_mass(dist.Beta(2.0, 5.0), dist.LogUniform(1e-3, 1.0))
    draws = draws_from_priors(setup.unknowns, key, 7)
    assert [*draws] == [unknown.name for unknown in setup.unknowns]
    keys = jax.random.split(jax.random.key(5), (7, len(draws)))
    for number, unknown in enumerate(setup.unknowns):
        alone = [unknown.distribution.sample(key) for key in keys[:, number]]
        np.testing.assert_allclose(draws[unknown.name], alone, rtol=1e-12)


def test_draws_of_nothing_are_none():
    assert draws_from_priors([], 0, 7) == {}
