"""Eigenpairs of a symmetric matrix, with derivatives also where eigenvalues are repeated.

Eigenvectors of a repeated eigenvalue have no derivative, but a receptance, made of all of them, has
one. `Eigenpairs.coupling` and `with_coupling` keep the part that no eigenvector can have.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float, Inexact

from .._shared import precision  # noqa: F401  double precision, before the first array is made

_CLOSE = 1e-6  # of the greater eigenvalue of a pair, below which it counts as repeated
_ROUNDING = 1e-12  # of the greatest eigenvalue of all: rigid-body modes are repeated zeros

ModalResponse = Inexact[Array, "response mode frequency"]
ModalReference = Inexact[Array, "reference mode frequency"]
Receptance = Complex[Array, "response reference frequency"]
Modal = Float[Array, "mode mode"]
Decomposed = tuple[Float[Array, "mode"], Modal, Modal]


class Eigenpairs(NamedTuple):
    """Eigenpairs in ascending order, and what still couples those that coincide."""

    values: Float[Array, "mode"]
    """Eigenvalues."""
    vectors: Modal
    """Eigenvectors as columns."""
    coupling: Modal
    """The matrix between eigenvectors of one repeated eigenvalue, off its diagonal. It is zero, but
    its derivative is not: it is what the derivatives of the vectors leave out."""


def eigenpairs(matrix: Modal) -> Eigenpairs:
    """Eigenpairs whose first derivatives are finite and exact, by perturbation.

    Nelson, AIAA Journal 14 (1976) 1201, DOI 10.2514/3.7211, for vectors of distinct eigenvalues.
    Derivatives of second order are exact where no eigenvalue is repeated.
    """
    return Eigenpairs(*_eigh(matrix))


@jax.custom_jvp
def _eigh(matrix: Modal) -> Decomposed:
    values, vectors = jnp.linalg.eigh(matrix)
    # Of the two signs the one that makes the largest component positive: what is added to a shape
    # must keep its meaning while parameters change.
    largest = jnp.argmax(jnp.abs(vectors), axis=0)
    signs = jnp.sign(jnp.take_along_axis(vectors, largest[None], axis=0))
    return values, vectors * signs, jnp.zeros(matrix.shape)


@_eigh.defjvp
def _eigh_jvp(primals: tuple[Modal], tangents: tuple[Modal]) -> tuple[Decomposed, Decomposed]:
    values, vectors, coupling = _eigh(*primals)
    change = vectors.T @ tangents[0] @ vectors
    gap = values[None, :] - values[:, None]
    size = jnp.maximum(jnp.abs(values[None, :]), jnp.abs(values[:, None]))
    close = jnp.abs(gap) <= _CLOSE * size + _ROUNDING * jnp.max(jnp.abs(values))
    rotation = jnp.where(close, 0.0, change / jnp.where(close, 1.0, gap))
    repeated = close & ~jnp.eye(values.size, dtype=bool)
    changes = (jnp.diagonal(change), vectors @ rotation, jnp.where(repeated, change, 0.0))
    return (values, vectors, coupling), changes


@jax.custom_jvp
def with_coupling(
    receptance: Receptance, coupling: Modal, response: ModalResponse, reference: ModalReference
) -> Receptance:
    """Receptance with the first-order change by a coupling of modes whose value is zero.

    The coupling is a stiffness [(rad/s)^2] between modes of one frequency; response and reference
    are modal receptances times the shapes at the points of each. The receptance stays the same, but
    its derivative has - response d(coupling) reference besides.
    """
    return receptance


@with_coupling.defjvp
def _with_coupling_jvp(
    primals: tuple[Array, ...], tangents: tuple[Array, ...]
) -> tuple[Receptance, Receptance]:
    receptance, _, response, reference = primals
    change = -jnp.einsum("pnf,nm,qmf->pqf", response, tangents[1], reference)
    return receptance, tangents[0] + change
