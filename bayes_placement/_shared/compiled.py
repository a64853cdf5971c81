"""Functions of trees, compiled once for all trees of one structure.

Compiling takes most of the time of many small computations. Two structures of one form differ in
numbers only; where these are inputs of a compiled function, not constants in it, one serves both.
"""

import functools
from collections.abc import Callable, Sequence
from typing import Any, Generic, NamedTuple, TypeAlias, TypeVar

import jax
import jax.numpy as jnp
import jaxlib
import numpy as np
from jax.extend.core import Jaxpr, get_opaque_trace_state
from numpyro.distributions import Distribution

Result = TypeVar("Result")
Outcome = TypeVar("Outcome")

MOST_PROGRAMS = 192
"""Compiled functions that stay, of 4 MB each, so that a process of many searches stops growing."""

WIDEST = 512
"""Bits of the widest vectors of a processor; one that has narrower ones takes these."""

_Options: TypeAlias = tuple[tuple[str, int], ...] | None


def compiled(function: Callable[..., Result]) -> "Compiled[Result]":
    """Return the compiled form of a function: `compiled(function)(tree, *arguments)`.

    Arrays and Python floats anywhere in the arguments are its inputs; all else (structure of the
    trees, static fields, integers, booleans, names) is fixed and hashed. The same function of the
    same structure with other numbers is never compiled again, wherever it is called from. It is
    defined once: of a module or a class, not inside another function, where it would be a new one
    at every call. Where a Python float steers it (`if`, `float`), floats are fixed as well, so that
    other ones are compiled anew; an array must not steer it.
    """
    return Compiled(function)


def of_jax(tree: object, least: int = 0) -> Any:
    """Return a tree whose arrays are of JAX, where large ones are computed with again and again.

    Smaller ones than `least` bytes stay: Python reads numbers of NumPy in less time.

    One of NumPy is copied at each call, unless it happens to begin at a multiple of 64 bytes: a
    structure with 30 MB of them took up to five times as long.
    """

    def converted(leaf: object) -> object:
        is_large = isinstance(leaf, np.ndarray) and leaf.nbytes >= least
        return jnp.asarray(leaf) if is_large else leaf

    return jax.tree.map(converted, tree)


class Compiled(Generic[Result]):
    """Compiled form of a function of trees."""

    def __init__(self, function: Callable[..., Result]):
        self.function = function

    def __call__(self, *arguments: object) -> Result:
        """Run it, compiled for the structure of its arguments."""
        return self.bound(*arguments)()

    def bound(
        self,
        *trees: object,
        effort: int | None = None,
        is_long: bool = False,
        programs: "Programs | None" = None,
    ) -> "Bound[Result]":
        """Return it with its first arguments given, which are then taken apart only once.

        By its effort, from 0 to 3, the compiler takes at 1 three quarters of the time of 3, the
        default, for functions that run as fast, at 0 less than half for functions that take twice
        as long. Where it computes with long arrays, wider vectors of the processor, where it has
        them, save a quarter of the time and are worth a longer compilation. It stays among
        `programs`, see `programs_kept`.
        """
        return Bound(self.function, trees, effort, is_long, programs or _jitted)


class Bound(Generic[Result]):
    """Compiled form of a function whose first arguments are given.

    `effort` is how much the compiler tries, None for its default; `is_long` whether it computes
    with long arrays; `programs` where it stays.
    """

    def __init__(
        self,
        function: Callable[..., Result],
        trees: tuple[object, ...],
        effort: int | None,
        is_long: bool,
        programs: "Programs",
    ):
        self._effort, self._is_long, self._programs = effort, is_long, programs
        leaves, structure = jax.tree.flatten(with_sorted_fields(trees))
        self._parts = _parts(_Form(function, structure), leaves, _is_number)
        if self._parts.key in _STEERED:
            self._parts = self._parts.with_fixed_floats()

    def prepare(self, *arguments: object) -> None:
        """Compile it for arguments of the shapes of these, unless that is done. Any thread may."""
        self._tried(lambda parts: self._jitted(parts).lower(parts.numbers, arguments).compile())

    def program(self, *arguments: object) -> Jaxpr:
        """Return its JAX program for arguments of these shapes; traced once, not compiled."""
        return self._tried(
            lambda parts: self._jitted(parts).trace(parts.numbers, arguments).jaxpr.jaxpr
        )

    def outcome(self, *arguments: object) -> Result:
        """Return what it returns for arguments of these shapes, shapes in place of arrays."""
        return self._tried(
            lambda parts: self._jitted(parts).trace(parts.numbers, arguments).out_info
        )

    def __call__(self, *arguments: object) -> Result:
        """Run it. Only one thread at a time may: two can wait for each other for ever."""
        alone = not _is_inside_another()
        return self._tried(lambda parts: self._jitted(parts, alone)(parts.numbers, arguments))

    def _jitted(self, parts: "_Parts", alone: bool = True) -> jax.stages.Wrapped:
        return self._programs(parts.key, self._options if alone else None)

    @functools.cached_property
    def _options(self) -> "_Options":
        return _options(self._effort, self._is_long)

    def _tried(self, action: Callable[["_Parts"], Outcome]) -> Outcome:
        try:
            return action(self._parts)
        except _STEERING:
            _STEERED.add(self._parts.key)
            self._parts = self._parts.with_fixed_floats()
            return action(self._parts)


@jax.tree_util.register_pytree_node_class
class _Fields:
    """A distribution whose fields are flattened by name; unflattened it is a distribution again."""

    def __init__(self, distribution: Distribution):
        values, self.fixed = distribution.tree_flatten()
        self.kind = type(distribution)
        self.value = dict(zip(self.kind.gather_pytree_data_fields(), values, strict=True))

    def tree_flatten(self) -> tuple[list[object], tuple[type[Distribution], object]]:
        """Return values by the names of their fields, and what is fixed."""
        values = [with_sorted_fields(self.value[name]) for name in sorted(self.value)]
        return values, (self.kind, self.fixed)

    @classmethod
    def tree_unflatten(cls, fixed: Any, values: Sequence[object]) -> Distribution:
        """Return the distribution."""
        kind, auxiliary = fixed
        names = kind.gather_pytree_data_fields()
        value = dict(zip(sorted(names), values, strict=True))
        return kind.tree_unflatten(auxiliary, tuple(value[name] for name in names))


def with_sorted_fields(tree: object) -> object:
    """Return the tree with each distribution flattened by the names of its fields.

    NumPyro flattens them in the order of a set, another one in each process, and a program whose
    inputs come in another order is not found in the compilation cache.
    """
    return jax.tree.map(
        lambda leaf: _Fields(leaf) if _is_distribution(leaf) else leaf,
        tree,
        is_leaf=_is_distribution,
    )


def _is_distribution(leaf: object) -> bool:
    return isinstance(leaf, Distribution)


class _Form(NamedTuple):
    """A function, and the structure of the trees that it is given."""

    function: Callable[..., object]
    structure: jax.tree_util.PyTreeDef


class _Key(NamedTuple):
    """What calls must have in common to share one compiled function."""

    form: _Form
    fixed: tuple[object, ...]
    kinds: tuple[type, ...]  # of these: True == 1, and steers as another


class _Parts(NamedTuple):
    """Numbers of trees, which are inputs, and the rest."""

    key: _Key
    leaves: list[object]
    numbers: list[object]

    def with_fixed_floats(self) -> "_Parts":
        """Return the same with arrays alone as inputs."""
        return _parts(self.key.form, self.leaves, _is_array)


def _parts(form: _Form, leaves: list[object], is_input: Callable[[object], bool]) -> _Parts:
    fixed = tuple(_INPUT if is_input(leaf) else leaf for leaf in leaves)
    key = _Key(form, fixed, tuple(map(type, fixed)))
    return _Parts(key, leaves, [_of_stated_type(leaf) for leaf in leaves if is_input(leaf)])


def _of_stated_type(leaf: object) -> object:
    """A number whose type JAX does not adapt: it compiles once more for one that it would."""
    is_of_python = type(leaf) in (float, complex)
    if isinstance(leaf, jax.core.Tracer) or not getattr(leaf, "weak_type", is_of_python):
        return leaf
    return np.asarray(leaf)


Programs: TypeAlias = Callable[[_Key, _Options], jax.stages.Wrapped]
"""Functions of JAX that are compiled, each once."""


def programs_kept(most: int) -> Programs:
    """Return an empty store of programs, of which those that were not run for longest go."""
    return functools.lru_cache(maxsize=most)(_program)


def _program(key: _Key, options: _Options) -> jax.stages.Wrapped:
    def function(numbers: list[object], arguments: tuple[object, ...]) -> object:
        inputs = iter(numbers)
        leaves = [next(inputs) if leaf is _INPUT else leaf for leaf in key.fixed]
        return key.form.function(*jax.tree.unflatten(key.form.structure, leaves), *arguments)

    function.__name__ = getattr(key.form.function, "__name__", "function")  # for profiles
    return jax.jit(function, compiler_options=None if options is None else dict(options))


_jitted = functools.lru_cache(maxsize=MOST_PROGRAMS)(_program)
"""Where programs stay unless they have a store of their own."""


def forget_programs() -> None:
    """Forget all compiled functions; those that are called again are compiled anew."""
    _jitted.cache_clear()
    jax.clear_caches()


def _is_inside_another() -> bool:
    """Whether another function is being compiled: its options hold for all that it calls."""
    global _outside
    state = get_opaque_trace_state()
    if state == _outside:
        return False
    if isinstance(jnp.add(0, 0), jax.core.Tracer):
        return True
    _outside = state  # that addition takes as long as a small function
    return False


def _options(effort: int | None, is_long: bool) -> _Options:
    """Options by which a function is compiled in half of the time, and runs as fast.

    A compiler that does not know an option refuses it: they are given to those alone with which
    they were tried.
    """
    if jax.default_backend() != "cpu" or not jaxlib.__version__.startswith("0.10."):
        return None
    fast: tuple[tuple[str, int], ...] = (
        ("xla_cpu_use_fusion_emitters", False),
        ("xla_cpu_parallel_codegen_split_count", 1),
    )
    if is_long:
        fast = (*fast, ("xla_cpu_prefer_vector_width", WIDEST))
    if effort is None or jax.config.values["jax_disable_most_optimizations"]:
        return fast
    return (*fast, ("xla_backend_optimization_level", effort))


def _is_array(leaf: object) -> bool:
    return isinstance(leaf, np.ndarray | np.generic | jax.Array)


def _is_number(leaf: object) -> bool:
    return _is_array(leaf) or isinstance(leaf, float | complex)


_outside: object = None
"""State of JAX in which no other function was being compiled."""

_INPUT = object()
_STEERING = (jax.errors.ConcretizationTypeError, jax.errors.TracerArrayConversionError)
_STEERED: set[_Key] = set()
"""Functions of structures that a Python float steers."""
