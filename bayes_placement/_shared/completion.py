"""What notebooks and shells offer to complete the name of a module."""

from functools import partial
from types import ModuleType


def offer_own(*modules: ModuleType) -> None:
    """Let modules offer what they define: no constants, and nothing that they import."""
    for module in modules:
        vars(module)["__dir__"] = partial(_own, module)


def _own(module: ModuleType) -> list[str]:
    named = ((name, getattr(item, "__module__", "")) for name, item in vars(module).items())
    own = [name for name, home in named if home == module.__name__ and not name.startswith("_")]
    return [*vars(module).get("__all__", own)]
