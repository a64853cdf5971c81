"""Functions of trees, compiled once for all trees of one structure.

Compiling takes most of the time of many small computations. Two structures of one form differ in
numbers only; where these are inputs of a compiled function, not constants in it, one serves both.
"""

import functools
from collections.abc import Callable
from typing import Any, Generic, NamedTuple, TypeVar

import jax
import numpy as np

Result = TypeVar("Result")


def compiled(function: Callable[..., Result]) -> "Compiled[Result]":
    """Return the compiled form of a function: `compiled(function)(tree, *arguments)`.

    Arrays and Python floats anywhere in the arguments are its inputs; all else (structure of the
    trees, static fields, integers, booleans, names) is fixed and hashed. The same function of the
    same structure with other numbers is never compiled again, wherever it is called from.

    Parameters
    ----------
    function
        A function of trees, defined once: of a module or a class, not inside another function,
        where it would be a new one at every call. No number of its arguments may steer it in
        Python (`if`, `np.asarray`).
    """
    return Compiled(function)


class Compiled(Generic[Result]):
    """Compiled form of a function of trees."""

    def __init__(self, function: Callable[..., Result]):
        self.function = function

    def __call__(self, *arguments: Any) -> Result:
        """Run it, compiled for the structure of its arguments."""
        leaves, structure = jax.tree.flatten(arguments)
        numbers, fixed = _parted(leaves)
        return _jitted(_Key(self.function, structure, fixed))(numbers, ())

    def bound(self, *trees: Any) -> "Bound[Result]":
        """Return it with its first arguments given, which are then taken apart only once."""
        return Bound(self.function, trees)


class Bound(Generic[Result]):
    """Compiled form of a function whose first arguments are given.

    Parameters
    ----------
    function
        The function.
    trees
        Its first arguments.
    """

    def __init__(self, function: Callable[..., Result], trees: tuple[Any, ...]):
        leaves, structure = jax.tree.flatten(trees)
        self.numbers, fixed = _parted(leaves)
        self._jitted = _jitted(_Key(function, structure, fixed))

    def prepare(self, *arguments: Any) -> None:
        """Compile it for arguments of the shapes of these, unless that is done. Any thread may."""
        self._jitted.lower(self.numbers, arguments).compile()

    def __call__(self, *arguments: Any) -> Result:
        """Run it. Only one thread at a time may: two can wait for each other for ever."""
        return self._jitted(self.numbers, arguments)


class _Key(NamedTuple):
    """What calls must have in common to share one compiled function."""

    function: Callable[..., Any]
    structure: Any
    fixed: tuple[Any, ...]


@functools.lru_cache(maxsize=512)
def _jitted(key: _Key) -> Any:
    def function(numbers: list[Any], arguments: tuple[Any, ...]) -> Any:
        inputs = iter(numbers)
        leaves = [next(inputs) if leaf is _INPUT else leaf for leaf in key.fixed]
        return key.function(*jax.tree.unflatten(key.structure, leaves), *arguments)

    return jax.jit(function)


def _parted(leaves: list[Any]) -> tuple[list[Any], tuple[Any, ...]]:
    """Numbers among leaves, which are inputs, and all leaves with a mark in their place."""
    numbers = [leaf for leaf in leaves if _is_input(leaf)]
    return numbers, tuple(_INPUT if _is_input(leaf) else leaf for leaf in leaves)


def _is_input(leaf: Any) -> bool:
    return isinstance(leaf, np.ndarray | np.generic | jax.Array | float | complex)


_INPUT = object()
