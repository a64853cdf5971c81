"""The live page: compare a model with what was measured, change it by hand, fit, search.

State lives in Python, and the page shows it; nothing is computed here that criticism or inference
could compute. The room has another name than `bp.explore`, for which the import of a folder of its
name would stand afterwards.
"""

from .opened import explore

__all__ = ["explore"]
