"""Draws from priors of one form in one program."""

import jax
import jax.numpy as jnp
import numpyro.distributions as dist
import pytest

from bayes_placement.inference.prior_draws import prior_draws


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
