"""Reading of mode shapes, known at nodes, at any position of a structure."""

from ._elements import Elements, linear, reference_corners
from ._hermite_elements import frame, frame_geometric_stiffness, plate
from ._interpolation import Interpolation, NodalModel, Reading
from ._scattered import Nearest, Scattered, nearest, scattered
from ._scikit_fem_elements import scikit_fem

__all__ = [
    "Elements",
    "Interpolation",
    "Nearest",
    "NodalModel",
    "Reading",
    "Scattered",
    "frame",
    "frame_geometric_stiffness",
    "linear",
    "nearest",
    "plate",
    "reference_corners",
    "scattered",
    "scikit_fem",
]
