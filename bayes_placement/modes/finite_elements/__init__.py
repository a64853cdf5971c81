"""Modes from the matrices, or from the modes, of a finite element code."""

from . import interpolation, soft_supports
from .affine_modes import AffineModes
from .from_matrices import affine, modes
from .interpolation._scikit_fem_elements import from_scikit_fem
from .loose_joints import joints
from .matrices import Affine, Matrices
from .modal_model import ModalModel
from .nodal_modes import DerivedNodalModes, NodalModes, UnknownModes, modes_from_shapes

__all__ = [
    "Affine",
    "AffineModes",
    "DerivedNodalModes",
    "Matrices",
    "ModalModel",
    "NodalModes",
    "UnknownModes",
    "affine",
    "from_scikit_fem",
    "interpolation",
    "joints",
    "modes",
    "modes_from_shapes",
    "soft_supports",
]
