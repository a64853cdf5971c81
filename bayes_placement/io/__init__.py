"""io: in, files of other programs; out, measurements, experiments and results; and back.

Not known here: physics, probability.
"""

import lazy_loader

SUBMODULES = {
    "case",
    "matrix_files",
    "mesh",
    "model",
    "nastran",
    "netcdf",
    "npz_modes",
    "uff",
}

__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submodules=SUBMODULES)
