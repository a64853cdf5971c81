"""What becomes of the placement, one way a file; `__init__.pyi` is their registry.

A marginal is imported on first use, so that the command line can list the names before JAX is
loaded. Its name there and in `infer(marginal="kde")` is that of its class in lower case.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
