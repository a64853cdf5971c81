"""Memory that a computation needs, known before it is compiled, and batches that keep it small."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

import jax
import numpy as np
from jax.extend.core import ClosedJaxpr, Jaxpr, Literal, Var

from .._shared.compiled import Bound

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
