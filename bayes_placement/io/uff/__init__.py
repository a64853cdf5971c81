"""Universal files (UFF): measured FRFs, in and out, and modes of finite element models."""

from ._datasets import MeasurementFileError
from ._write import node_numbers, write
from .frfs import left_out, read
from .modes import read as read_modes

__all__ = ["MeasurementFileError", "left_out", "node_numbers", "read", "read_modes", "write"]
