"""finite_elements: modes from the matrices, or the modes, of a finite element code."""

from . import interpolation, nodal_modes, soft_supports
from .finite_elements import affine, from_scikit_fem, modes
from .matrices import Matrices
from .modal_model import ModalModel

__all__ = [
    "Matrices",
    "ModalModel",
    "affine",
    "from_scikit_fem",
    "interpolation",
    "modes",
    "nodal_modes",
    "soft_supports",
]
