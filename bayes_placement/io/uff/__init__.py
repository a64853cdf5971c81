"""Universal files (UFF): measured FRFs, in and out, and modes of finite element models."""

from ._datasets import MeasurementFileError
from ._write import write
from .frfs import read
from .modes import read as read_modes

__all__ = ["MeasurementFileError", "read", "read_modes", "write"]
