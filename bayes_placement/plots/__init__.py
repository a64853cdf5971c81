"""Figures of results; one file for each kind of result, imported on first use."""

from types import ModuleType
from typing import Any

import lazy_loader

from .._shared.completion import offer_own

_attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    """Return a module, which offers to complete what it defines, or a function."""
    member = _attribute(name)
    if isinstance(member, ModuleType):
        offer_own(member)
    return member
