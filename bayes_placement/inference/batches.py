"""A batch of experiments with values: their numbers, and the form that all of them share.

Numbers are inputs of a compiled function, the form is fixed in it. Priors are used up before, and
effects are applied as far as they are plain numbers: hypotheses that differ in these only share one
compiled response.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import ImproperUniform, constraints

from .._shared.sites import substitute
from ..experiment.experiment import Experiment
from ..experiment.with_effects_applied import with_effects_applied


@dataclass(frozen=True)
class Form:
    """Form of an experiment without its numbers."""

    structure: Any
    """Structure of its tree."""
    sources: tuple[int | None, ...]
    """For each leaf of the tree, the leaf of the declared experiment that it is; None for a number
    that differs within the batch."""

    def shared(self, declared: Experiment) -> list[Any]:
        """Leaves that all experiments of the batch share, from the declared experiment."""
        leaves = jax.tree.leaves(declared)
        return [leaves[source] for source in self.sources if source is not None]

    def apart_from_declared(self) -> "Form":
        """Return the form of any experiment whose leaves are shared in the same places."""
        counter = iter(range(len(self.sources)))
        sources = (None if source is None else next(counter) for source in self.sources)
        return Form(self.structure, tuple(sources))

    def filled(self, numbers: Sequence[Array], shared: Sequence[Any]) -> Experiment:
        """Return the experiment with these numbers, once the form is apart from a declared one."""
        inputs = iter(numbers)
        leaves = [next(inputs) if source is None else shared[source] for source in self.sources]
        experiment: Experiment = jax.tree.unflatten(self.structure, leaves)
        return experiment


@jax.tree_util.register_pytree_node_class
class Batch:
    """Numbers of experiments [point, ...], and their form; shapes alone where traced."""

    def __init__(self, numbers: Sequence[Any], form: Form):
        self.numbers = list(numbers)
        self.form = form

    def tree_flatten(self) -> tuple[list[Any], Form]:
        """Return the numbers, and what is fixed."""
        return self.numbers, self.form

    @classmethod
    def tree_unflatten(cls, form: Form, numbers: Sequence[Any]) -> "Batch":
        """Return the batch."""
        return cls(numbers, form)


def without_priors(experiment: Experiment) -> Experiment:
    """Return the experiment with unknowns of which only the shape is known.

    Those that differ in their priors alone then share one batch.
    """
    unnamed = {
        unknown.name: ImproperUniform(constraints.real, (), unknown.distribution.shape())
        for unknown in experiment.unknowns
    }
    return substitute(experiment, unnamed)


def batch(experiment: Experiment, values: Float[Array, "point number"]) -> Batch:
    """Return the experiments of a batch of values of the unknowns, one after the other."""
    unknowns = experiment.unknowns
    shapes = [unknown.distribution.shape() for unknown in unknowns]
    ends = np.cumsum([math.prod(shape) for shape in shapes], dtype=int)
    # By identity: what is known of the declared experiment is computed once for all points.
    sources = {id(leaf): number for number, leaf in enumerate(jax.tree.leaves(experiment))}

    def at(row: Float[Array, "number"]) -> Batch:
        parts = zip(unknowns, jnp.split(row, ends)[:-1], shapes, strict=True)
        known = with_effects_applied(
            experiment.fix({of.name: part.reshape(to) for of, part, to in parts})
        )
        leaves, structure = jax.tree.flatten(known)
        of_leaves = tuple(sources.get(id(leaf)) for leaf in leaves)
        pairs = zip(leaves, of_leaves, strict=True)
        # Of a stated type: JAX compiles anew for one that it would adapt, as of a constant.
        numbers = [
            jnp.asarray(leaf, jnp.result_type(leaf)) for leaf, source in pairs if source is None
        ]
        return Batch(numbers, Form(structure, of_leaves))

    return jax.vmap(at)(values)
