"""Draws from independent priors, of which those of one form share one program."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from numpyro.distributions import Distribution

from .._compiled import with_sorted_fields
from .symmetries import Values


class _PriorStructure(NamedTuple):
    """What priors have in common that differ in numbers alone."""

    structure: Any
    shapes: tuple[tuple[int, ...], ...]


def prior_draws(priors: Mapping[str, Distribution], keys: Any) -> Values:
    """Draws from priors by name [draw, ...], for a compiled function.

    A distribution that is drawn by rejection takes a second to compile, and a model has many.

    Parameters
    ----------
    priors
        Prior of each unknown by name.
    keys
        Random keys [draw, unknown].
    """
    numbers = {name: number for number, name in enumerate(priors)}
    values: Values = {}
    for form, alike in _by_form(priors).items():
        stacked = [jnp.stack(leaves) for leaves in zip(*alike.values(), strict=True)]
        of_priors = keys[:, jnp.array([numbers[name] for name in alike])]

        def draw(leaves: Any, key: Any, form: _PriorStructure = form) -> Any:
            return jax.tree.unflatten(form.structure, leaves).sample(key)

        for_draws = jax.vmap(draw, in_axes=(None, 0))
        drawn = jax.vmap(for_draws, in_axes=(0, 1))(stacked, of_priors)
        values |= dict(zip(alike, drawn, strict=True))
    return {name: values[name] for name in priors}


def _by_form(priors: Mapping[str, Distribution]) -> dict[_PriorStructure, dict[str, list[Any]]]:
    """Numbers of priors by name, of those of one form together."""
    forms: dict[_PriorStructure, dict[str, list[Any]]] = {}
    for name, prior in priors.items():
        leaves, structure = jax.tree.flatten(with_sorted_fields(prior))
        form = _PriorStructure(structure, tuple(jnp.shape(leaf) for leaf in leaves))
        forms.setdefault(form, {})[name] = leaves
    return forms
