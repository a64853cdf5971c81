"""_symmetric_factor: in, a sparse symmetric matrix in order; out, its factor, solutions, inertia.

Not known here: what the matrix stands for.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

BLOCK = 64
"""Right-hand sides that are solved at once."""

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
        """How many eigenvalues are negative, by Sylvester's law of inertia."""
        return int(np.count_nonzero(self.triangles.U.diagonal() < 0))

    def trustworthy(self) -> bool:
        """Whether no row was exchanged, and a solution solves equations that are nearly these.

        The backward error of Rigal and Gaches (1967, DOI 10.1145/321406.321416): near a natural
        frequency a solution is large, and so is its residual, in the best of factors.
        """
        kept = np.array_equal(self.triangles.perm_r, self.triangles.perm_c)
        right = start_vector(self.matrix.shape[0])
        solution = self.solve(right)
        residual = np.abs(self.matrix @ solution - right).max()
        size = np.abs(self.matrix).sum(axis=1).max() * np.abs(solution).max() + np.abs(right).max()
        return bool(kept and residual < BACKWARD_ERROR * size)


def factorised(matrix: csc_array) -> SymmetricFactor:
    """Factor of a symmetric matrix; a pivot that vanishes is made one of rounding size."""
    try:
        return SymmetricFactor(matrix, _triangles(matrix))
    except RuntimeError:  # SuperLU: exactly singular
        lifted = csc_array(matrix + 1e-14 * diags_array(_positive(matrix.diagonal())))
        return SymmetricFactor(matrix, _triangles(lifted))


def blocks(count: int) -> Iterator[slice]:
    """Ranges of columns, `BLOCK` of them at once."""
    return (slice(first, min(first + BLOCK, count)) for first in range(0, count, BLOCK))


def start_vector(size: int, seed: int = 0) -> Float[np.ndarray, "row"]:
    """A vector without preference, always the same."""
    return np.random.default_rng(seed).standard_normal(size)


def _triangles(matrix: csc_array) -> Any:
    options = {"SymmetricMode": True}
    return splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options=options)


def _positive(diagonal: np.ndarray) -> np.ndarray:
    size = np.abs(diagonal)
    return np.where(size > 0, size, size.max(initial=1e-300))
