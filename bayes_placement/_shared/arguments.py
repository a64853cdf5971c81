"""Checks of what a public function was given, by its annotations and by hand."""

import dataclasses
import functools
import inspect
import types
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeGuard, TypeVar, Union, cast, get_args, get_origin

import jax
import numpy as np
from jaxtyping import Array
from numpy.typing import ArrayLike
from numpyro.distributions import Distribution

from .dimensions import Parameter
from .errors import InputError

Function = TypeVar("Function", bound=Callable[..., object])


def check_kind(
    argument: str, value: object, kinds: type | tuple[type, ...], needed: str, instead: str
) -> None:
    """Refuse another kind, with what is `needed` and why, and the line that fixes it."""
    if not isinstance(value, kinds):
        raise InputError(f"{argument}={shown(value)} was given; {needed}: {instead}.")


def check_count(argument: str, value: object, least: int, instead: str) -> None:
    """Refuse what is no whole number, or is below a least one."""
    if not (_is_count(value) and value >= least):
        words = f"{argument}={shown(value)} was given; a whole number of at least {least} is needed"
        raise InputError(f"{words}, since it counts: {instead}.")


def finite_number(argument: str, value: object, instead: str) -> float:
    """Return one finite number."""
    number = np.asarray(value)
    if number.dtype.kind not in "iuf" or number.ndim or not np.isfinite(number):
        words = f"{argument}={shown(value)} was given; one finite number is needed, in SI units"
        raise InputError(f"{words}: {instead}.")
    return float(number)


def check_positive(argument: str, value: object, instead: str, most: float = np.inf) -> None:
    """Refuse what is no number above zero, or is above a greatest one."""
    if not 0 < finite_number(argument, value, instead) <= most:
        limit = "" if most == np.inf else f" and up to {most:g}"
        raise InputError(
            f"{argument}={shown(value)} was given; a number above zero{limit} is needed, since it "
            f"divides or scales: {instead}."
        )


def shown(value: object) -> str:
    """Write what was given briefly: a text or a number itself, all else by its kind."""
    if isinstance(value, str | int | float | type(None)):
        return repr(value)
    if isinstance(value, type):
        return f"the class {value.__name__}"
    if isinstance(value, list | tuple | dict | set):
        return f"{type(value).__name__} of {len(value)}"
    return f"an object of {type(value).__name__}"


class _Kind(NamedTuple):
    """What an annotation allows: a test of a value; what is needed, why, and an example."""

    allows: Callable[[object], bool]
    words: str
    example: str = "..."
    reason: str = "since its attributes are used"


def arguments_checked(function: Function) -> Function:
    """Refuse arguments of a public function that are of another kind than its annotations say.

    Single numbers are finite. Shapes and ranges are the function's own matter.
    """
    signature = inspect.signature(function)

    @functools.wraps(function)
    def checked(*positional: object, **named: object) -> object:
        try:
            bound = signature.bind(*positional, **named)
        except TypeError as error:  # one is missing, or has another name
            call = f"{function.__name__}({', '.join(signature.parameters)})"
            raise InputError(f"{error}; the arguments of {call} are needed.") from error
        for name, value in bound.arguments.items():
            parameter = signature.parameters[name]
            if parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD):
                check_annotated(name, value, parameter.annotation)
        return function(*positional, **named)

    return cast(Function, checked)


def check_fields(module: Any, *but: str) -> None:
    """Raise an InputError if a field of a dataclass is of another kind than its annotation says."""
    for field in dataclasses.fields(module):
        if field.name not in but:
            check_annotated(field.name, getattr(module, field.name), field.type)


def check_annotated(name: str, value: object, annotation: object) -> None:
    """Raise an InputError if a value is of another kind than an annotation says."""
    kind = _kind(annotation)
    if not kind.allows(value):
        usual = f"{kind.words} is needed, {kind.reason}: {name}={kind.example}"
        raise InputError(f"{name}={shown(value)} was given; {SENTENCES.get(name, usual)}.")


@functools.cache
def _kind(annotation: object) -> _Kind:
    """Kind of an annotation; anything where nothing is known of it."""
    origin, inner = get_origin(annotation), _kinds_within(annotation)
    if origin in (Union, types.UnionType) or isinstance(annotation, TypeVar):
        words = " or ".join(dict.fromkeys(kind.words for kind in inner if kind is not _NOTHING))
        first = inner[0]
        return first._replace(
            allows=lambda value: any(kind.allows(value) for kind in inner), words=words
        )
    if origin in (tuple, list, Sequence, Collection, Iterable):
        return _list_of(inner, fixed=origin is tuple and Ellipsis not in get_args(annotation))
    if origin in (dict, Mapping):
        return _mapping_to(inner[-1])
    if origin is type:
        base = get_args(annotation)[0]
        return _Kind(lambda value: isinstance(value, type) and issubclass(value, base), "a class")
    if origin in _KINDS or annotation in _KINDS:
        return _KINDS[origin if origin in _KINDS else annotation]
    if isinstance(annotation, type) and getattr(annotation, "dim_str", None) is not None:
        return _array_of(getattr(annotation, "dim_str", ""))
    if isinstance(annotation, type) and not origin:
        return _object_of(annotation)
    if annotation in ("pd.DataFrame", "xr.DataTree"):
        return _object_named(annotation.partition(".")[2])
    return _ANYTHING


def _kinds_within(annotation: object) -> list[_Kind]:
    """Kinds of the annotations within an annotation; of a common union one."""
    parts = _parts(annotation)
    for union, kind in _UNIONS:
        members = get_args(union)  # none where NumPy writes it as an alias, from Python 3.12 on
        if members and {*members} <= {*parts}:
            return [kind, *(_kind(part) for part in parts if part not in members)]
    return [_kind(part) for part in parts]


def _parts(annotation: object) -> list[object]:
    """Annotations within an annotation; a type variable stands for what binds it."""
    if isinstance(annotation, TypeVar):
        return [*annotation.__constraints__] or [annotation.__bound__ or Any]
    parts = get_args(annotation)
    return [part for part in parts if part is not Ellipsis and not isinstance(part, list)]


def _list_of(inner: list[_Kind], fixed: bool) -> _Kind:
    """A list, each entry of a kind; of fixed length, each entry of its own."""

    def allows(value: object) -> bool:
        if isinstance(value, np.ndarray | Array):
            of_numbers = bool(inner) and inner[0] in (_KINDS[int], _NUMBER)
            return (value.ndim == 1 if of_numbers else value.ndim > 0) and value.dtype.kind != "U"
        if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
            return False
        if not isinstance(value, Collection):  # a generator is read once only
            return not fixed
        kinds = inner if fixed else inner[:1] * len(value)
        pairs = zip(kinds, value, strict=False)
        return len(kinds) == len(value) and all(kind.allows(entry) for kind, entry in pairs)

    first = inner[0] if inner else _ANYTHING
    words = f"a list, each entry of it {first.words},"
    return _Kind(allows, words, f"[{first.example}]", "since each is treated in turn")


def _mapping_to(inner: _Kind) -> _Kind:
    def allows(value: object) -> bool:
        return isinstance(value, Mapping) and all(inner.allows(entry) for entry in value.values())

    words = f"a dictionary, each name with {inner.words},"
    return _Kind(allows, words, f"{{'name': {inner.example}}}", "since each belongs to a name")


def _array_of(dimensions: str) -> _Kind:
    """An array of numbers with as many dimensions as are named, any number where one repeats."""
    names = dimensions.split()
    repeats = any(name.startswith("*") or name == "..." for name in names)

    def allows(value: object) -> bool:
        if repeats or not _is_numeric(value):
            return _is_numeric(value)
        pairs = zip(names, np.shape(value), strict=False)
        sizes = all(int(name) == size for name, size in pairs if name.isdigit())
        return np.ndim(value) == len(names) and sizes

    words = f"an array of numbers [{', '.join(names)}]"
    return _Kind(allows, words, "numpy.array(...)", _COMPUTED)


def _object_of(kind: type) -> _Kind:
    """An object of a class; of a protocol, one that has its attributes."""
    if not getattr(kind, "_is_protocol", False):
        words = f"an object of {kind.__name__}"
        return _Kind(lambda value: isinstance(value, kind), words, f"{kind.__name__}(...)")
    names = {name for name in vars(kind) if not name.startswith("_")}

    def allows(value: object) -> bool:
        return not isinstance(value, type) and names <= {*dir(value)}

    return _Kind(allows, f"an object with {', '.join(sorted(names))}")


def _object_named(name: str) -> _Kind:
    """An object of a class by its name, whose library is imported only where it is needed."""
    words = f"an object of {name}"
    return _Kind(lambda value: name in [base.__name__ for base in type(value).__mro__], words)


def _is_numeric(value: object) -> TypeGuard[ArrayLike]:
    """Whether it is an array of numbers, or can be made into it; NaN is no number."""
    if isinstance(value, jax.core.Tracer):
        return True
    return _is_array_like(value) and not np.isnan(np.asarray(value)).any()


def as_array(values: object) -> np.ndarray:
    """Return an array; an empty one of objects where rows differ in length."""
    try:
        return np.asarray(values)
    except ValueError:
        return np.empty(0, dtype=object)


def _is_array_like(value: object) -> TypeGuard[ArrayLike]:
    try:
        return as_array(value).dtype.kind in "biufc"
    except TypeError:
        return False


def _is_finite_number(value: object) -> bool:
    if isinstance(value, jax.core.Tracer):
        return True
    number = _is_numeric(value) and np.ndim(value) == 0 and np.asarray(value).dtype.kind in "iuf"
    return bool(number and np.isfinite(np.asarray(value)))


def _is_count(value: object) -> TypeGuard[int | np.integer]:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _of_class(kind: type | tuple[type, ...], *words: str) -> _Kind:
    return _Kind(lambda value: isinstance(value, kind), *words)


_COMPUTED, _COUNTED = "since it is computed with", "since it counts"
_ANYTHING = _Kind(lambda value: True, "anything")
_NOTHING = _Kind(lambda value: value is None, "")
_NUMBER = _Kind(_is_finite_number, "one finite number", "0.5", "in SI units")
_ARRAY_LIKE = _Kind(_is_array_like, "an array of numbers", "numpy.array(...)", _COMPUTED)
_PARAMETER = _Kind(
    lambda value: (
        _is_finite_number(value)
        or isinstance(value, Distribution)
        or (isinstance(value, Array | np.ndarray) and _is_array_like(value))
    ),
    "one finite number or a distribution",
    "0.5",
    "in SI units",
)
_UNIONS = ((ArrayLike, _ARRAY_LIKE), (Parameter, _PARAMETER), (float | int, _NUMBER))
_KINDS: dict[object, _Kind] = {
    type(None): _NOTHING,
    ArrayLike: _ARRAY_LIKE,
    bool: _of_class((bool, np.bool_), "True or False", "True", "since it is a choice"),
    int: _Kind(_is_count, "a whole number", "8", _COUNTED),
    float: _NUMBER,
    str: _of_class(str, "a text", "'...'", "since it is a name"),
    np.ndarray: _of_class(np.ndarray, "an array", "numpy.array(...)", _COMPUTED),
    Array: _of_class(Array, "an array", "numpy.array(...)", _COMPUTED),
    Callable: _Kind(callable, "a function", "function", "since it is called"),
    object: _ANYTHING,
    Any: _ANYTHING,
    inspect.Parameter.empty: _ANYTHING,
}

_MEASURED = "measured FRFs are needed, with their channels and lines: "
SENTENCES = {
    "experiment": "an experiment is needed, with structure, instruments and lines: "
    "bp.Experiment(structure, sensors=[...], actuators=[...], ...)",
    "measurement": f"{_MEASURED}io.read_measurement(path), or Measurement.from_arrays(...)",
    "baseline": f"{_MEASURED}baseline=io.read_measurement(path)",
    "ends": "the two ends as one word are needed, joined by a hyphen: ends='fixed-free'",
    "engine": "an engine or its name is needed, since it explores the posterior: "
    "engine=engines.SMC()",
    "marginal": "a marginal or its name is needed, since it says what becomes of the placement: "
    "marginal=marginals.Latent()",
    "results": "results by the names of their methods or models are needed, since they are "
    'compared: {"SMC": bp.infer(experiment, measurement)}',
    "places": "positions by the name of the transducer are needed, since each is tried there: "
    '{"s1": [0.2, 0.3, 0.4]}',
    "posterior": "the result of an inference is needed, since only a fitted model has a misfit: "
    "bp.check(bp.infer(experiment, measurement))",
    "result": "a tree of results is needed, as bp.infer and bp.simulate return it: "
    "bp.infer(experiment, measurement)",
    "path": "the path of a file or folder is needed, since it is read from there or written there: "
    'path="measured.uff"',
    "progress": "a function is needed, since it is called with the share that is done: "
    "with bp.design.progress_bar() as progress: ...",
}
"""What is needed, why, and the line that fixes it, by the name of an argument."""
