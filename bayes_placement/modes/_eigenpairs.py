"""_eigenpairs: in, a symmetric matrix; out, its eigenpairs, with derivatives where pairs coincide.

Not known here: modes, structures. Eigenvectors of a repeated eigenvalue have no derivative, but
what is made of all of them has one; the part of it that no eigenvector can carry is handed out.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .. import _types  # noqa: F401  double precision, before the first array is made

_CLOSE = 1e-6  # of the greater eigenvalue of a pair, below which it counts as repeated
_ROUNDING = 1e-12  # of the greatest eigenvalue of all: rigid-body modes are repeated zeros


class Eigenpairs(NamedTuple):
    """Eigenpairs in ascending order, and what still couples those that coincide.

    Parameters
    ----------
    values
        Eigenvalues.
    vectors
        Eigenvectors as columns.
    coupling
        The matrix between eigenvectors of one repeated eigenvalue, off its diagonal. It is zero,
        but its derivative is not: second-order terms in it carry what the vectors cannot.
    """

    values: Float[Array, "mode"]
    vectors: Float[Array, "mode mode"]
    coupling: Float[Array, "mode mode"]


def eigenpairs(matrix: Float[Array, "mode mode"]) -> Eigenpairs:
    """Eigenpairs whose first derivatives are finite and exact, by perturbation.

    Nelson, AIAA Journal 14 (1976) 1201, DOI 10.2514/3.7211, for vectors of distinct eigenvalues.
    Derivatives of second order are exact where no eigenvalue is repeated.
    """
    return Eigenpairs(*_solved(matrix))


@jax.custom_jvp
def _solved(matrix: Float[Array, "mode mode"]) -> tuple[Any, Any, Any]:
    return (*jnp.linalg.eigh(matrix), jnp.zeros(matrix.shape))


@_solved.defjvp
def _solved_jvp(primals: Any, tangents: Any) -> tuple[Any, Any]:
    values, vectors, coupling = _solved(*primals)
    change = vectors.T @ tangents[0] @ vectors
    gap = values[None, :] - values[:, None]
    size = jnp.maximum(jnp.abs(values[None, :]), jnp.abs(values[:, None]))
    close = jnp.abs(gap) <= _CLOSE * size + _ROUNDING * jnp.max(jnp.abs(values))
    turning = jnp.where(close, 0.0, change / jnp.where(close, 1.0, gap))
    others = close & ~jnp.eye(values.size, dtype=bool)
    changes = (jnp.diagonal(change), vectors @ turning, jnp.where(others, change, 0.0))
    return (values, vectors, coupling), changes
