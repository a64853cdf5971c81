"""Factors of a sparse symmetric matrix: solutions and inertia."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

BLOCK = 64
"""Right-hand sides that are solved together."""

BACKWARD_ERROR = 1e-12  # above which a factor without pivoting is not trusted


@dataclass(frozen=True, eq=False)
class SymmetricFactor:
    """Triangular factors of a matrix whose rows are eliminated in the order they stand in.

    SuperLU without pivoting (symmetric mode); made by `factorised`.
    """

    matrix: csc_array
    triangles: Any

    def solve(self, right: Float[np.ndarray, "row *column"]) -> Float[np.ndarray, "row *column"]:
        """Solution for one or many right-hand sides, block by block."""
        if right.ndim == 1:
            return self.triangles.solve(right)
        solution = np.empty(right.shape)
        for block in blocks(right.shape[1]):
            solution[:, block] = self.triangles.solve(np.asfortranarray(right[:, block]))
        return solution

    def negative_pivots(self) -> int:
        """Number of negative eigenvalues, by Sylvester's law of inertia."""
        return int(np.count_nonzero(self.triangles.U.diagonal() < 0))

    def trustworthy(self) -> bool:
        """Tell whether no row was exchanged and the backward error is small.

        The backward error of Rigal and Gaches (1967, DOI 10.1145/321406.321416): near a natural
        frequency a solution is large, and so is its residual, however good the factor.
        """
        unpivoted = np.array_equal(self.triangles.perm_r, self.triangles.perm_c)
        right = start_vector(self.matrix.shape[0])
        solution = self.solve(right)
        residual = np.abs(self.matrix @ solution - right).max()
        size = np.abs(self.matrix).sum(axis=1).max() * np.abs(solution).max() + np.abs(right).max()
        return bool(unpivoted and residual < BACKWARD_ERROR * size)


def factorised(matrix: csc_array) -> SymmetricFactor:
    """Factor of a symmetric matrix; a zero pivot is replaced by one of rounding size."""
    try:
        return SymmetricFactor(matrix, _triangles(matrix))
    except RuntimeError:  # SuperLU: exactly singular
        shifted = csc_array(matrix + 1e-14 * diags_array(_positive(matrix.diagonal())))
        return SymmetricFactor(matrix, _triangles(shifted))


def blocks(count: int) -> Iterator[slice]:
    """Ranges of columns, `BLOCK` of them at once."""
    return (slice(first, min(first + BLOCK, count)) for first in range(0, count, BLOCK))


def start_vector(size: int, seed: int = 0) -> Float[np.ndarray, "row"]:
    """A random vector, always the same."""
    return np.random.default_rng(seed).standard_normal(size)


def _triangles(matrix: csc_array) -> Any:
    options = {"SymmetricMode": True}
    return splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options=options)


def _positive(diagonal: np.ndarray) -> np.ndarray:
    size = np.abs(diagonal)
    return np.where(size > 0, size, size.max(initial=1e-300))
