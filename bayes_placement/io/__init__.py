"""Files of other programs as measurements, modes, matrices and experiments; results as files."""

import pkgutil

import lazy_loader

SUBMODULES = {
    module.name for module in pkgutil.iter_modules(__path__) if not module.name.startswith("_")
}

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submodules=SUBMODULES,
    submod_attrs={
        "formats": ["read_matrices", "read_measurement", "read_modes"],
        "laws": ["read_law", "write_law"],
        "mapped": ["read"],
    },
)
