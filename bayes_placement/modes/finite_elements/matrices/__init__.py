"""Sparse stiffness and mass matrices: modes, static flexibility, reduced bases."""

from ._matrices import Matrices, Release, Sparse
from ._reduced_basis import Affine, ReducedBasis

__all__ = ["Affine", "Matrices", "ReducedBasis", "Release", "Sparse"]
