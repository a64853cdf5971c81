"""effects: what can be added to a structure or to its measuring chain, one physical effect a file.

In, strengths and places; out, what they do to the response. Not known here: data, probability.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
