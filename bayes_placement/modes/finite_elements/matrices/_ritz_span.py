"""Ritz modes in a span of vectors, with estimates of their errors."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import eigh
from scipy.sparse import csc_array

from ...._shared.errors import InputError
from ._affine import Affine, Factors, scaled
from ._static_flexibility import StaticFlexibility

RELEVANT = 0.05  # of the tolerance, below which a direction is not worth a vector
DEPENDENT = 1e-10


class Ritz(NamedTuple):
    """Ritz modes for some factors, elastic ones only."""

    eigenvalues: Float[np.ndarray, "mode"]
    """Eigenvalues omega_n^2 [(rad/s)^2], from above."""
    error: Float[np.ndarray, "mode"]
    """Estimated relative errors of the natural frequencies."""
    weight: Float[np.ndarray, "part mode"]
    """Residual forces over the columns of `RitzSpan.response`."""


class RitzSpan(NamedTuple):
    r"""Mass-orthonormal vectors, rigid-body modes first, with the matrices between them.

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
    stiffness: Float[np.ndarray, "stiffness vector vector"]
    mass: Float[np.ndarray, "mass vector vector"]

    @classmethod
    def of(cls, flexibility: StaticFlexibility, affine: Affine) -> "RitzSpan":
        """Begin with the rigid-body modes."""
        empty = np.zeros((flexibility.mass.shape[0], 0))
        stiffness = np.zeros((1 + len(affine.stiffness), 0, 0))
        mass = np.zeros((1 + len(affine.mass), 0, 0))
        span = cls(flexibility, affine, empty, empty, np.zeros((0, 0)), stiffness, mass)
        return span._appended(flexibility.fields)

    def extended(self, vectors: Float[np.ndarray, "row new"]) -> "RitzSpan":
        """Add the part of vectors outside the span."""
        mass = self.flexibility.mass
        for _ in range(2):
            vectors = vectors - self.basis @ (self.basis.T @ (mass @ vectors))
            vectors = vectors / np.sqrt(np.einsum("rv,rv->v", vectors, mass @ vectors))
        inertia, combination = eigh(vectors.T @ (mass @ vectors))
        independent = inertia > DEPENDENT * inertia[-1]
        return self._appended(
            vectors @ (combination[:, independent] / np.sqrt(inertia[independent]))
        )

    def ritz(self, factors: Factors, up_to: float) -> Ritz:
        """Elastic Ritz modes up to an eigenvalue [(rad/s)^2]."""
        of_stiffness, of_mass = self.affine.weights(factors)
        stiffness = np.tensordot(of_stiffness, self.stiffness, 1)
        mass = np.tensordot(of_mass, self.mass, 1)
        eigenvalues, shape = eigh(stiffness, mass)
        chosen = slice(self.rigid, max(int(np.searchsorted(eigenvalues, up_to)), self.rigid))
        if chosen.stop == chosen.start:
            asked, lowest = np.sqrt([up_to, eigenvalues[self.rigid]]) / (2 * np.pi)
            raise InputError(
                f"up_to={asked:g} Hz was given; a frequency above the lowest natural frequency, "
                f"{lowest:g} Hz, is needed, since modes up to it are kept: give several times the "
                "band."
            )
        eigenvalues, shape = eigenvalues[chosen], shape[:, chosen]
        count = eigenvalues.size
        terms = np.vstack([np.tile(of_stiffness[:, None], count), -np.outer(of_mass, eigenvalues)])
        weight = (shape[:, None] * terms).reshape(-1, count)
        energy = np.einsum("pm,pm->m", weight, self.gram @ weight)
        softest = min([1.0, *(factors[name] for name in self.affine.stiffness)])
        return Ritz(eigenvalues, energy / (2 * eigenvalues * softest), weight)

    def corrections(self, ritz: Ritz, tolerance: float) -> Float[np.ndarray, "row new"]:
        """Displacements G r that the Ritz modes lack, merged where they resemble each other."""
        inaccurate = ritz.error > RELEVANT * tolerance
        weight = ritz.weight[:, inaccurate] / np.sqrt(2 * ritz.eigenvalues[inaccurate])
        share, combination = eigh(weight.T @ self.gram @ weight)
        relevant = share > min(RELEVANT * tolerance, 0.5 * share[-1])
        return self.response @ (weight @ combination[:, relevant])

    def matrices(self, factors: Factors) -> tuple[csc_array, csc_array]:
        """Full stiffness and mass for some factors."""
        of_stiffness, of_mass = self.affine.weights(factors)
        nominal = self.flexibility
        return (
            scaled(nominal.stiffness, self.affine.stiffness, of_stiffness),
            scaled(nominal.mass, self.affine.mass, of_mass),
        )

    @property
    def rigid(self) -> int:
        """Number of rigid-body modes."""
        return self.flexibility.fields.shape[1]

    def _appended(self, new: np.ndarray) -> "RitzSpan":
        """Add mass-orthonormal vectors."""
        basis = np.hstack([self.basis, new])
        nominal, parts = self.flexibility, self.affine
        stress = [matrix @ new for matrix in (nominal.stiffness, *parts.stiffness.values())]
        momentum = [matrix @ new for matrix in (nominal.mass, *parts.mass.values())]
        force = np.stack([*stress, *momentum], axis=2).reshape(len(new), -1)
        response = self.flexibility(force)
        return self._replace(
            basis=basis,
            response=np.hstack([self.response, response]),
            gram=_extended(self.gram, self.response.T @ force, force.T @ response),
            stiffness=np.stack(_projected(self.stiffness, stress, self.basis, new)),
            mass=np.stack(_projected(self.mass, momentum, self.basis, new)),
        )


def _projected(
    before: np.ndarray, images: list[np.ndarray], basis: np.ndarray, new: np.ndarray
) -> list[np.ndarray]:
    return [
        _extended(old, basis.T @ image, new.T @ image)
        for old, image in zip(before, images, strict=True)
    ]


def _extended(old: np.ndarray, between: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Symmetric matrix with new rows and columns."""
    return np.block([[old, between], [between.T, (new + new.T) / 2]])
