"""Annotations of the package, checked at every call for as little time as that takes.

`jaxtyping.jaxtyped` binds the arguments of every call and checks them twice. Here beartype checks
them once, and only functions whose annotations have shapes get a context in which a dimension has
one size: most have none, and their checks are a fortieth of the price.
"""

import functools
import inspect
import types
from collections.abc import Callable
from typing import Any, TypeVar, get_args, get_type_hints

import jaxtyping
from beartype import beartype

_CONTEXT = jaxtyping.jaxtyped("context")


def check_annotations(package: str) -> None:
    """Check the annotations of every function and dataclass of a package imported after this."""
    jaxtyping.jaxtyped = lambda typechecker: checked  # which the hook writes above each of them
    jaxtyping.install_import_hook(package, "beartype.beartype")


def checked(decorated: Any) -> Any:
    """A function, or a class with the function that makes it, whose annotations are checked."""
    if not inspect.isclass(decorated):
        return _checked_function(decorated)
    if "__dataclass_fields__" in vars(decorated) and not hasattr(decorated.__init__, "is_checked"):
        decorated.__init__ = _checked_function(decorated.__init__)
    return decorated


def _checked_function(function: Callable) -> Callable:
    try:
        annotations = get_type_hints(function)
    except NameError:  # of a class that is defined below, or imported for its type alone
        return _checked_when_called(function)
    return _with_checks(function, annotations)


def _with_checks(function: Callable, annotations: dict[str, Any]) -> Callable:
    by_beartype = beartype(function)
    if any(map(_is_shaped, annotations.values())):
        by_beartype = _in_context(by_beartype)
    by_beartype.is_checked = True
    return by_beartype


def _in_context(function: Callable) -> Callable:
    @functools.wraps(function)
    def in_context(*arguments, **options):
        __tracebackhide__ = True
        with _CONTEXT:
            return function(*arguments, **options)

    return in_context


def _checked_when_called(function: Callable) -> Callable:
    """A function whose annotations are resolved when it is first called, as far as they can be."""

    @functools.cache
    def resolved() -> Callable:
        annotations = {
            name: _resolved(annotation, function)
            for name, annotation in function.__annotations__.items()
        }
        function.__annotations__ = annotations
        return _with_checks(function, annotations)

    @functools.wraps(function)
    def checked_when_called(*arguments, **options):
        __tracebackhide__ = True
        return resolved()(*arguments, **options)

    checked_when_called.is_checked = True
    return checked_when_called


def _resolved(annotation: Any, function: Callable) -> Any:
    """An annotation with the classes that it names; anything where one is not there."""
    holder = types.SimpleNamespace(__annotations__={"it": annotation})
    try:
        return get_type_hints(holder, function.__globals__)["it"]
    except NameError:
        return Any


def _is_shaped(annotation: Any) -> bool:
    inner = list(annotation) if isinstance(annotation, list) else list(get_args(annotation))
    if isinstance(annotation, TypeVar):
        inner = [annotation.__bound__, *annotation.__constraints__]
    return hasattr(annotation, "dim_str") or any(map(_is_shaped, inner))
