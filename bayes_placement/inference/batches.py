"""A batch of experiments with values: their numbers, and the form that all of them share.

Numbers are inputs of a compiled function, the form is fixed in it. Priors are used up before, and
effects are applied as far as they are plain numbers: hypotheses that differ in these only share one
compiled response.
"""

import functools
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.extend.core import ClosedJaxpr, Jaxpr, Literal, Var
from jaxtyping import Array, Float, Int, Shaped
from numpyro.distributions import ImproperUniform, constraints

from .._shared.compiled import Bound
from .._shared.processes import has_one_core
from .._shared.sites import substitute
from ..experiment.experiment import Experiment
from ..experiment.with_effects_applied import with_effects_applied

Input = TypeVar("Input")
Output = TypeVar("Output")

MOST_BYTES = 1 << 29
"""Memory [bytes] that the evaluations of one batch may take together."""


def working_bytes(function: Bound[Output], *arguments: object) -> int:
    """Return the most memory [bytes] that a function holds at once, besides its arguments.

    Every intermediate array counts from where it is computed to where it is used last. XLA fuses
    many of them and needs less.
    """
    return _greatest(function.program(*arguments))


def available_bytes() -> int | None:
    """Memory [bytes] that is free on this machine; None where the system does not say it."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return None
    free = [line.split() for line in lines if line.startswith("MemAvailable:")]
    return int(free[0][1]) * 1024 if free else None


def affordable_batch(function: Bound[Output], argument: object, most: int) -> int:
    """Return how many evaluations of a function fit into memory at once.

    They are at least one and at most `most`. The argument is one element of a batch.
    """
    return int(np.clip(MOST_BYTES // max(working_bytes(function, argument), 1), 1, most))


def mapped(function: Callable[[Input], Output], arguments: Input, batch: int) -> Output:
    """Return the values of a function for each element of arrays, a batch of them at once.

    Elements lie along the first axis of the arrays.
    """
    if batch >= jax.tree.leaves(arguments)[0].shape[0]:
        return jax.vmap(function)(arguments)
    return jax.lax.map(function, arguments, batch_size=batch)


def _greatest(jaxpr: Jaxpr) -> int:
    """Most bytes that are alive at once while a program runs, its arguments left out."""
    last_use = _last_uses(jaxpr)
    alive = most = 0
    for number, equation in enumerate(jaxpr.eqns):
        within = max(map(_greatest, _parts(equation.params)), default=0)
        alive += sum(map(_size, equation.outvars))
        most = max(most, alive + within)
        used = {variable for variable in equation.invars if isinstance(variable, Var)}
        alive -= sum(
            _size(variable)
            for variable in used
            if last_use[variable] == number and variable not in jaxpr.invars
            if variable not in jaxpr.constvars
        )
    return most


def _last_uses(jaxpr: Jaxpr) -> Mapping[Var, int]:
    """Number of the equation that uses each variable last; that after all for what is returned."""
    uses = {
        variable: number
        for number, equation in enumerate(jaxpr.eqns)
        for variable in equation.invars
        if not isinstance(variable, Literal)
    }
    returned = [variable for variable in jaxpr.outvars if not isinstance(variable, Literal)]
    return uses | dict.fromkeys(returned, len(jaxpr.eqns))


def _parts(params: Mapping[str, object]) -> Iterator[Jaxpr]:
    """Programs inside an equation: bodies of loops and calls, of which one runs at a time."""
    for value in params.values():
        for part in value if isinstance(value, list | tuple) else [value]:
            if isinstance(part, ClosedJaxpr):
                yield part.jaxpr
            elif isinstance(part, Jaxpr):
                yield part


def _size(variable: Any) -> int:
    return int(np.prod(variable.aval.shape)) * int(variable.aval.dtype.itemsize)


Points = Float[np.ndarray, "point unknown"]


@dataclass(frozen=True)
class Form:
    """Form of an experiment without its numbers."""

    structure: jax.tree_util.PyTreeDef
    """Structure of its tree."""
    sources: tuple[int | None, ...]
    """For each leaf of the tree, the leaf of the declared experiment that it is; None for a number
    that differs within the batch."""

    def shared(self, declared: Experiment) -> list[object]:
        """Leaves that all experiments of the batch share, from the declared experiment."""
        leaves = jax.tree.leaves(declared)
        return [leaves[source] for source in self.sources if source is not None]

    def apart_from_declared(self) -> "Form":
        """Return the form of any experiment whose leaves are shared in the same places."""
        counter = iter(range(len(self.sources)))
        sources = (None if source is None else next(counter) for source in self.sources)
        return Form(self.structure, tuple(sources))

    def filled(self, numbers: Sequence[Array], shared: Sequence[object]) -> Experiment:
        """Return the experiment with these numbers, once the form is apart from a declared one."""
        inputs = iter(numbers)
        leaves = [next(inputs) if source is None else shared[source] for source in self.sources]
        return jax.tree.unflatten(self.structure, leaves)


@jax.tree_util.register_pytree_node_class
class Batch:
    """Numbers of experiments [point, ...], and their form; shapes alone where traced."""

    def __init__(self, numbers: Sequence[object], form: Form):
        self.numbers = list(numbers)
        self.form = form

    def tree_flatten(self) -> tuple[list[object], Form]:
        """Return the numbers, and what is fixed."""
        return self.numbers, self.form

    @classmethod
    def tree_unflatten(cls, form: Form, numbers: Sequence[object]) -> "Batch":
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


BATCH = 8
"""Points evaluated together: fewer cost compiled calls, more are in vain where one is asked for."""


class BatchedFunction:
    """A function of batches of points, at any number of them.

    It maps points [size, unknown] and further arguments to arrays [size, ...], and is compiled at
    its first call.
    """

    def __init__(self, function: Callable[..., tuple[Array | np.ndarray, ...]], size: int = BATCH):
        self._function, self._size = function, size
        self._is_compiled = False

    def fill(self, arrays: Sequence[np.ndarray], points: Points, *arguments: object) -> None:
        """Write what the function returns into arrays [point, ...]: nothing is copied twice."""
        write = functools.partial(self._write, arrays, points, arguments)
        begins = range(0, len(points), self._size)
        if begins and not self._is_compiled:  # alone, since two threads would both compile
            write(begins[0])
            self._is_compiled, begins = True, begins[1:]
        threaded_map(write, begins)

    def _write(
        self,
        arrays: Sequence[np.ndarray],
        points: np.ndarray,
        arguments: tuple[object, ...],
        begin: int,
    ) -> None:
        batch = points[begin : begin + self._size]
        padded = np.concatenate([batch, np.repeat(batch[-1:], self._size - len(batch), axis=0)])
        for array, values in zip(arrays, self._function(padded, *arguments), strict=True):
            array[begin : begin + self._size] = np.asarray(values)[: len(batch)]


MOST_AT_ONCE = 4
"""Most calls at once: linear algebra in them waits for threads of JAX, see `LEAST_THREADS`."""


def threaded_map(function: Callable[[Input], Output], inputs: Sequence[Input]) -> list[Output]:
    """Outputs of a function, in the order of its inputs."""
    threads = None if has_one_core() else _threads(os.getpid())
    if threads is None or len(inputs) < 2:
        return [function(value) for value in inputs]
    return list(threads.map(function, inputs))


@functools.cache
def _threads(process: int) -> ThreadPoolExecutor | None:
    """One thread for each core, none where there is a single one.

    By the number of the process: one that is forked has no thread of its parent, and would wait.
    """
    count = min(os.cpu_count() or 1, MOST_AT_ONCE)
    return ThreadPoolExecutor(count, thread_name_prefix="threaded_map") if count > 1 else None


def distinct_rows(
    rows: Shaped[np.ndarray, "row column"],
) -> tuple[Int[np.ndarray, "different"], Int[np.ndarray, "row"]]:
    """Return the first index of each distinct row, and for each row which of these it is."""
    number: dict[bytes, int] = {}
    which = np.array([number.setdefault(row.tobytes(), len(number)) for row in rows], dtype=int)
    _, first = np.unique(which, return_index=True)
    return first, which
