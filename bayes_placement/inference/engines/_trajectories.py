"""Trajectories along gradients, which move a population of many unknowns.

Steps of a random walk must shrink as the square root of the number of unknowns, those of a
trajectory as its fourth root (Neal, doi:10.1201/b10905-6).
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from blackjax.mcmc import hmc
from jaxtyping import Array, Float

from ..._shared.dimensions import Key
from ..batches import mapped
from .engine import Draws, Flat, Scalar

MANY = 12
"""Unknowns from which a population moves along trajectories besides."""

TRAJECTORIES, STEPS = 4, 5
"""Trajectories of each particle at one temperature, and steps of each."""

FIRST_STEP = 0.4
"""Length of a step at first, where a curvature of 1 turns a particle in pi / 2."""

ACCEPTED = 0.75
"""Share of trajectories that the length of a step is adapted to."""

Density = Callable[[Flat], Scalar]


class Travelled(NamedTuple):
    """Particles after their trajectories, and the share of these that was accepted."""

    particles: Draws
    rate: Scalar


def travelled(
    density: Density, key: Key, particles: Draws, length: Scalar, batch: int
) -> Travelled:
    """Move particles along trajectories of Hamiltonian Monte Carlo.

    The length of a step is in units in which the mean curvature of the log density is 1; `batch`
    particles are moved at once.
    """
    states = mapped(lambda particle: hmc.init(particle, density), particles, batch)
    inverse_mass = jnp.linalg.inv(_mean_curvature(states.logdensity_grad))
    kernel = hmc.build_kernel()

    def move(state: hmc.HMCState, key: Key) -> tuple[hmc.HMCState, Scalar]:
        length_key, key = jax.random.split(key)
        # Of one length, trajectories of a period would end where they began.
        of_this = length * jax.random.uniform(length_key, minval=0.6, maxval=1.2)
        state, info = kernel(key, state, density, of_this, inverse_mass, STEPS)
        return state, info.acceptance_rate

    def travel(pair: tuple[hmc.HMCState, Key]) -> tuple[Flat, Scalar]:
        state, key = pair
        end, rates = jax.lax.scan(move, state, jax.random.split(key, TRAJECTORIES))
        return end.position, jnp.mean(rates)

    keys = jax.random.split(key, len(particles))
    moved, rates = mapped(travel, (states, keys), batch)
    return Travelled(moved, jnp.mean(rates))


def _mean_curvature(gradients: Draws) -> Float[Array, "unknown unknown"]:
    """Mean curvature of minus the log density that particles are drawn from.

    It is the mean product of the gradients (Fisher's identity). The distance between modes does not
    enter it, as it does a covariance of the particles.
    """
    finite = jnp.all(jnp.isfinite(gradients), axis=1)
    gradients = jnp.where(finite[:, None], gradients, 0.0)
    dimension = gradients.shape[1]
    # As if as many gradients as unknowns were those of a standard normal density.
    total = gradients.T @ gradients + dimension * jnp.eye(dimension)
    return total / (jnp.sum(finite) + dimension)
