"""Ways to explore a posterior, one file each; `__init__.pyi` is their registry.

An engine is imported on first use, so that the command line can list the names before JAX is
loaded. Its name there and in `infer(engine="smc")` is that of its class in lower case.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
