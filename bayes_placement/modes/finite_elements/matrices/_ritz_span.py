"""_ritz_span: in, vectors and matrices that factors scale; out, Ritz modes, their estimated errors.

Not known here: how vectors are chosen, nodes, probability.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import eigh
from scipy.sparse import csc_array

from ._affine import Affine, Factors, scaled
from ._static_flexibility import StaticFlexibility

RELEVANT = 0.05  # of the tolerance, below which a direction is not worth a vector
DEPENDENT = 1e-10


class Ritz(NamedTuple):
    """Ritz modes for some factors, elastic ones only."""

    squares: Float[np.ndarray, "mode"]
    """Squared angular frequencies [(rad/s)^2], from above."""
    error: Float[np.ndarray, "mode"]
    """Estimated relative errors of the natural frequencies."""
    weight: Float[np.ndarray, "part mode"]
    """Residual forces over the columns of `RitzSpan.response`."""


class RitzSpan(NamedTuple):
    r"""Mass-orthonormal vectors, rigid-body modes first, with all that factors need from them.

    A Ritz pair leaves the residual force r = K(theta) x - mu M(theta) x. To first order its natural
    frequency is too high by r^T G r / (2 mu), relatively, with G the static flexibility of the
    modes outside (Parlett, The Symmetric Eigenvalue Problem, 1998, section 11), and G r is what the
    vectors lack. Both are combinations of what is computed once, for any factors.
    """

    flexibility: StaticFlexibility
    affine: Affine
    basis: Float[np.ndarray, "row vector"]
    response: Float[np.ndarray, "row part"]
    """G K_i V and G M_i V, by vector and then by term."""
    gram: Float[np.ndarray, "part part"]
    stiffness: Float[np.ndarray, "stiff vector vector"]
    mass: Float[np.ndarray, "heavy vector vector"]

    @classmethod
    def of(cls, flexibility: StaticFlexibility, affine: Affine) -> "RitzSpan":
        """Begin with the rigid-body modes."""
        empty = np.zeros((flexibility.mass.shape[0], 0))
        stiff, heavy = 1 + len(affine.stiffness), 1 + len(affine.mass)
        none, nothing = np.zeros((stiff, 0, 0)), np.zeros((heavy, 0, 0))
        span = cls(flexibility, affine, empty, empty, np.zeros((0, 0)), none, nothing)
        return span._appended(flexibility.fields)

    def extended(self, vectors: Float[np.ndarray, "row new"]) -> "RitzSpan":
        """Add what vectors bring beyond the span."""
        mass = self.flexibility.mass
        for _ in range(2):
            vectors = vectors - self.basis @ (self.basis.T @ (mass @ vectors))
            vectors = vectors / np.sqrt(np.einsum("rv,rv->v", vectors, mass @ vectors))
        inertia, mixture = eigh(vectors.T @ (mass @ vectors))
        kept = inertia > DEPENDENT * inertia[-1]
        return self._appended(vectors @ (mixture[:, kept] / np.sqrt(inertia[kept])))

    def ritz(self, factors: Factors, up_to: float) -> Ritz:
        """Elastic Ritz modes up to a squared angular frequency."""
        stiff, heavy = self.affine.weights(factors)
        stiffness, mass = np.tensordot(stiff, self.stiffness, 1), np.tensordot(heavy, self.mass, 1)
        squares, shape = eigh(stiffness, mass)
        chosen = slice(self.rigid, max(int(np.searchsorted(squares, up_to)), self.rigid))
        squares, shape = squares[chosen], shape[:, chosen]
        terms = np.vstack([np.tile(stiff[:, None], squares.size), -np.outer(heavy, squares)])
        weight = (shape[:, None] * terms).reshape(-1, squares.size)
        energy = np.einsum("pm,pm->m", weight, self.gram @ weight)
        softest = min([1.0, *(factors[name] for name in self.affine.stiffness)])
        return Ritz(squares, energy / (2 * squares * softest), weight)

    def corrections(self, ritz: Ritz, tolerance: float) -> Float[np.ndarray, "row new"]:
        """Displacements G r that the Ritz modes lack, merged where they resemble each other."""
        bad = ritz.error > RELEVANT * tolerance
        weight = ritz.weight[:, bad] / np.sqrt(2 * ritz.squares[bad])
        share, mixture = eigh(weight.T @ self.gram @ weight)
        kept = share > min(RELEVANT * tolerance, 0.5 * share[-1])
        return self.response @ (weight @ mixture[:, kept])

    def matrices(self, factors: Factors) -> tuple[csc_array, csc_array]:
        """Full stiffness and mass for some factors."""
        stiff, heavy = self.affine.weights(factors)
        nominal = self.flexibility
        return (
            scaled(nominal.stiffness, self.affine.stiffness, stiff),
            scaled(nominal.mass, self.affine.mass, heavy),
        )

    @property
    def rigid(self) -> int:
        """How many rigid-body modes there are."""
        return self.flexibility.fields.shape[1]

    def _appended(self, new: np.ndarray) -> "RitzSpan":
        """Add mass-orthonormal vectors."""
        basis = np.hstack([self.basis, new])
        stiff = [one @ new for one in (self.flexibility.stiffness, *self.affine.stiffness.values())]
        heavy = [one @ new for one in (self.flexibility.mass, *self.affine.mass.values())]
        force = np.stack([*stiff, *heavy], axis=2).reshape(len(new), -1)
        response = self.flexibility(force)
        return self._replace(
            basis=basis,
            response=np.hstack([self.response, response]),
            gram=_grown(self.gram, self.response.T @ force, force.T @ response),
            stiffness=np.stack(_projected(self.stiffness, stiff, self.basis, new)),
            mass=np.stack(_projected(self.mass, heavy, self.basis, new)),
        )


def _projected(
    before: np.ndarray, images: list[np.ndarray], basis: np.ndarray, new: np.ndarray
) -> list[np.ndarray]:
    return [
        _grown(old, basis.T @ image, new.T @ image)
        for old, image in zip(before, images, strict=True)
    ]


def _grown(old: np.ndarray, between: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Symmetric matrix with new rows and columns."""
    return np.block([[old, between], [between.T, (own + own.T) / 2]])
