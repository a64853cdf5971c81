"""Figures of results; one file for each kind of result, imported on first use."""

from types import ModuleType

import lazy_loader

from .._shared.reprs import offer_own

_attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    """Return a module or a function; modules offer to complete what they define."""
    member = _attribute(name)
    loaded = [globals().get(word) for word in __all__]  # also what others import, not asked for
    offer_own(*(module for module in loaded if isinstance(module, ModuleType)))
    return member
