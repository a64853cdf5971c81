"""_compiled: in, a function of trees of numbers; out, its compiled form, shared by like trees.

Not known here: experiments, data. Two masses on two members, or two springs along two axes, differ
in numbers only; compiling takes most of the time of a search, so they are compiled once.
"""

import functools
import threading
from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import numpy as np

from ..._sites import site_name


class Compiled:
    """A function whose trees are bound.

    Parameters
    ----------
    function
        A function of the trees and of further arguments.
    arguments
        Further arguments, for their shapes.
    trees
        Trees whose arrays are its inputs, and the numbers in their effects; all else is fixed.
    """

    def __init__(self, function: Callable[..., Any], arguments: tuple[Any, ...], *trees: Any):
        pairs, structure = jax.tree_util.tree_flatten_with_path(trees)
        self.numbers = [np.asarray(leaf) for path, leaf in pairs if _is_input(path, leaf)]
        fixed = tuple(None if _is_input(path, leaf) else leaf for path, leaf in pairs)
        shapes = tuple((one.shape, one.dtype) for one in self.numbers)
        inputs = tuple((np.shape(one), np.asarray(one).dtype) for one in arguments)
        self._entry = _entry(_Key(function, structure, fixed, shapes, inputs))

    def prepare(self) -> None:
        """Compile it, unless that is done. Any thread may."""
        self._entry.compiled()

    def __call__(self, *arguments: Any) -> Any:
        """Run it. Only one thread at a time may: two can wait for each other for ever."""
        return self._entry.compiled()(self.numbers, *arguments)


class _Key(NamedTuple):
    """What compiled functions must have in common to be one."""

    function: Callable[..., Any]
    structure: Any
    fixed: tuple[Any, ...]
    shapes: tuple[Any, ...]
    inputs: tuple[Any, ...]


class _Entry:
    """One function, traced when made and compiled when first asked for."""

    def __init__(self, key: _Key):
        def whole(numbers: list[Any], *arguments: Any) -> Any:
            given = iter(numbers)
            leaves = [next(given) if one is None else one for one in key.fixed]
            return key.function(*jax.tree.unflatten(key.structure, leaves), *arguments)

        numbers = [jax.ShapeDtypeStruct(*one) for one in key.shapes]
        inputs = [jax.ShapeDtypeStruct(*one) for one in key.inputs]
        self._lowered = jax.jit(whole).lower(numbers, *inputs)
        self._lock = threading.Lock()
        self._compiled: Any = None

    def compiled(self) -> Any:
        """Compile it once, whoever asks first."""
        with self._lock:
            if self._compiled is None:
                self._compiled = self._lowered.compile()
            return self._compiled


@functools.lru_cache(maxsize=256)
def _entry(key: _Key) -> _Entry:
    return _Entry(key)


def _is_input(path: tuple[Any, ...], leaf: Any) -> bool:
    # Other numbers are alike in all variants; as constants they may also steer the tracing.
    in_effect = any(site_name((key,)) in ("effects", "chain") for key in path)
    return isinstance(leaf, np.ndarray | jax.Array) or (in_effect and isinstance(leaf, float))
