"""Draws from independent priors, of which those of one form share one program."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike
from jaxtyping import Array
from numpyro.distributions import Distribution

from .._shared.compiled import compiled, with_sorted_fields
from .._shared.dimensions import Key
from .._shared.sites import Unknown


class _PriorForm(NamedTuple):
    """What priors have in common that differ in numbers alone."""

    structure: jax.tree_util.PyTreeDef
    shapes: tuple[tuple[int, ...], ...]


def draws_from_priors(
    unknowns: Sequence[Unknown], key: int | Key, count: int
) -> dict[str, np.ndarray]:
    """Draws [draw, ...] of unknowns from their priors, by name."""
    priors = [unknown.distribution for unknown in unknowns]
    # Drawn once: to compile it well takes longer than to run it.
    draws = compiled(_drawn).bound(priors, key, count, effort=0)()
    return {
        unknown.name: np.asarray(values) for unknown, values in zip(unknowns, draws, strict=True)
    }


def _drawn(priors: Sequence[Distribution], key: int | Key, count: int) -> list[Array]:
    # Within the compiled function: each operation on a key is a program of its own otherwise.
    start = jax.random.key(key) if isinstance(key, int) else key
    keys = jax.random.split(start, (count, max(1, len(priors))))
    return [*prior_draws({str(n): prior for n, prior in enumerate(priors)}, keys).values()]


def prior_draws(priors: Mapping[str, Distribution], keys: Key) -> dict[str, Array]:
    """Draws from priors by name [draw, ...], for a compiled function.

    A distribution that is drawn by rejection takes a second to compile, and a model has many.
    Random keys are [draw, unknown].
    """
    numbers = {name: number for number, name in enumerate(priors)}
    values: dict[str, Array] = {}
    for form, alike in _by_form(priors).items():
        stacked = [jnp.stack(leaves) for leaves in zip(*alike.values(), strict=True)]
        of_priors = keys[:, jnp.array([numbers[name] for name in alike])]

        def draw(leaves: list[Array], key: Key, form: _PriorForm = form) -> Array:
            return jax.tree.unflatten(form.structure, leaves).sample(key)

        for_draws = jax.vmap(draw, in_axes=(None, 0))
        drawn = jax.vmap(for_draws, in_axes=(0, 1))(stacked, of_priors)
        values |= dict(zip(alike, drawn, strict=True))
    return {name: values[name] for name in priors}


def _by_form(priors: Mapping[str, Distribution]) -> dict[_PriorForm, dict[str, list[ArrayLike]]]:
    """Numbers of priors by name, of those of one form together."""
    forms: dict[_PriorForm, dict[str, list[ArrayLike]]] = {}
    for name, prior in priors.items():
        leaves, structure = jax.tree.flatten(with_sorted_fields(prior))
        form = _PriorForm(structure, tuple(jnp.shape(leaf) for leaf in leaves))
        forms.setdefault(form, {})[name] = leaves
    return forms
