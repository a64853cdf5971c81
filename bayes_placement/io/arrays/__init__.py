"""Files of arrays: MATLAB, NumPy, HDF5, columns of text, workbooks."""

from .loaders import load
from .named_arrays import NamedArrays

__all__ = ["NamedArrays", "load"]
