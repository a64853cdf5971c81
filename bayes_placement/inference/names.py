"""Engines and marginals by the names that people type."""

from collections.abc import Callable
from types import ModuleType
from typing import Any


def names(registry: ModuleType) -> list[str]:
    """Names of all engines (or marginals), without importing them."""
    return [name.lower() for name in registry.__all__]


def of_name(registry: ModuleType, name: str) -> Callable[..., Any]:
    """Class of `engines` or `marginals` by its name in lower case: `smc`."""
    from .._shared.errors import InputError  # imports JAX, which the list of names must not

    classes = dict(zip(names(registry), registry.__all__, strict=True))
    if name.lower() not in classes:
        kind = registry.__name__.rpartition(".")[2]
        raise InputError(
            f"{name!r} was given, but there is none of that name among the {kind}: "
            f"{', '.join(classes)}. Give one of these, or an object: "
            f"{kind}.{registry.__all__[0]}()."
        )
    return getattr(registry, classes[name.lower()])
