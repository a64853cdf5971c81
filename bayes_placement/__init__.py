"""Bayesian updating of models of vibrating structures with sensors at uncertain positions.

Names are imported on first use, so that the command line can answer before JAX is loaded. The
list of names is in `__init__.pyi`.
"""

from importlib.metadata import version

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__version__ = version("bayes_placement")
