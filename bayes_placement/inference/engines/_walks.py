"""Random walks of particles, whose steps are differences of two others of the population."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from blackjax.mcmc import random_walk

from ..._shared.dimensions import Key
from .engine import Draws, Flat, PosteriorDensity, Scalar

Jump = Callable[[Key], Flat]
Density = Callable[[Flat], Scalar]

NEIGHBOURS = 4
"""Particles of which the nearest makes a step, so that most steps stay within a mode."""

FAR_STEPS = 0.1
"""Share of the steps that are the difference of any two particles, to lead from mode to mode."""


def walked(
    posterior: PosteriorDensity,
    density: Density,
    jump: Jump,
    moves: int,
    key: Key,
    position: Flat,
) -> tuple[Flat, Scalar]:
    """Walk of one particle, at its end to a symmetric image; the share of the steps accepted."""
    walk_key, image_key = jax.random.split(key)
    kernel = random_walk.build_additive_step()

    def step(state: random_walk.RWState, key: Key) -> tuple[random_walk.RWState, Scalar]:
        state, info = kernel(key, state, density, lambda key, _: jump(key))
        return state, info.acceptance_rate

    start = random_walk.init(position, density)
    end, rates = jax.lax.scan(step, start, jax.random.split(walk_key, moves))
    return _at_image(posterior, density, image_key, end), jnp.mean(rates)


def _at_image(
    posterior: PosteriorDensity, density: Density, key: Key, state: random_walk.RWState
) -> Flat:
    """Try one symmetric image, chosen at random; each keeps the volume of the named values."""
    images = posterior.symmetric_images(state.position)
    if not images:
        return state.position
    choice_key, accept_key = jax.random.split(key)
    # One choice more than there are images: an exact symmetry would swap all particles in step.
    choice = jax.random.randint(choice_key, (), 0, len(images) + 1)
    image = jnp.stack([*images, state.position])[choice]
    inside = jnp.all(jnp.isfinite(image))
    image = jnp.where(inside, image, state.position)
    volume = posterior.log_jacobian(state.position) - posterior.log_jacobian(image)
    gain = density(image) - state.logdensity + volume
    accepted = inside & (jnp.log(jax.random.uniform(accept_key)) < gain)
    return jnp.where(accepted, image, state.position)


def difference(particles: Draws, pairs: Scalar, key: Key) -> Flat:
    """Step of a random walk: mostly the difference of two particles of one mode."""
    pair_key, far_key, sign_key, noise_key = jax.random.split(key, 4)
    first, *neighbours = jax.random.randint(pair_key, (1 + NEIGHBOURS,), 0, particles.shape[0])
    differences = particles[first] - particles[jnp.stack(neighbours)]
    # Drawn without regard to where the walker is, and with a random sign, a step is as likely as
    # its reverse, whichever pair is taken.
    nearest = differences[jnp.argmin(jnp.sum(differences**2, axis=1))]
    far = jax.random.bernoulli(far_key, FAR_STEPS)
    step = jnp.where(far, differences[0], pairs * nearest) * jax.random.rademacher(sign_key, ())
    # A little noise makes every point reachable; a thousandth of the spread changes no posterior.
    noise = 1e-3 * jnp.std(particles, axis=0) * jax.random.normal(noise_key, particles.shape[1:])
    return step + noise
