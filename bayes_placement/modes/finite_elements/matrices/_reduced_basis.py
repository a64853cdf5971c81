"""Matrices as affine functions of factors; a fixed basis in which modes stay accurate for all."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import eigh
from scipy.sparse import csc_array

from ...._shared.errors import InputError
from ...._shared.reprs import with_short_repr
from . import _eigenmodes as eigenmodes
from ._eigenmodes import Eigenmodes
from ._static_flexibility import StaticFlexibility

CORNERS = 6  # factors, up to which every corner of the box is a sample

Factors = Mapping[str, float]
Weights = Float[np.ndarray, "_"]
"""Of the nominal matrix, which is 1, and of each part."""


@with_short_repr
class Affine(NamedTuple):
    """Parts of the stiffness and mass that factors scale: K + sum_i (factor_i - 1) K_i, M likewise.

    A name that stands in both scales both. Powers, such as that of a thickness in bending, are
    separate factors.

    Examples
    --------
    >>> bp.finite_elements.Affine({"root": matrices.regions["root"]}, {}, {"root": (0.5, 1.5)}).box
    {'root': (0.5, 1.5)}
    """

    stiffness: Mapping[str, csc_array]
    mass: Mapping[str, csc_array]
    box: Mapping[str, tuple[float, float]]
    """Least and greatest value of each factor [1]; 1 is nominal."""

    def among(self, rows: np.ndarray) -> "Affine":
        """Return the same on some rows, in their order."""
        stiffness, mass = (
            {name: csc_array(csc_array(part)[rows][:, rows]) for name, part in parts.items()}
            for parts in (self.stiffness, self.mass)
        )
        return Affine(stiffness, mass, self.box)

    def weights(self, factors: Factors) -> tuple[Weights, Weights]:
        """Weights of the nominal matrix and of each part, for stiffness and for mass."""
        return (
            np.array([1.0, *(factors[name] - 1 for name in self.stiffness)]),
            np.array([1.0, *(factors[name] - 1 for name in self.mass)]),
        )

    def samples(self, count: int) -> list[dict[str, float]]:
        """Corners of the box (up to six factors) and points of a Sobol sequence."""
        from scipy.stats import qmc  # it takes long to import

        size = len(self.box)
        corners = np.array(np.meshgrid(*[[0.0, 1.0]] * size)).reshape(size, -1).T
        inside = qmc.Sobol(size, scramble=False).random_base2(int(np.log2(count)))[1:]
        return self._factors(inside if size > CORNERS else np.vstack([corners, inside]))

    def random(self, count: int, seed: int) -> list[dict[str, float]]:
        """Points drawn uniformly in the box."""
        return self._factors(np.random.default_rng(seed).uniform(size=(count, len(self.box))))

    def _factors(self, shares: np.ndarray) -> list[dict[str, float]]:
        low, high = np.array(list(self.box.values())).T
        values = (low + shares * (high - low)).tolist()
        return [dict(zip(self.box, point, strict=True)) for point in values]


def scaled(nominal: csc_array, parts: Mapping[str, csc_array], weights: Weights) -> csc_array:
    """Matrix for some weights."""
    total = nominal
    for part, weight in zip(parts.values(), weights[1:], strict=True):
        total = total + weight * part
    return csc_array(total)


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


ROUNDS = 60
SAMPLES = 32
FRESH = 6

Square = Float[np.ndarray, "vector vector"]


class Worst(NamedTuple):
    """The largest relative error of a natural frequency, and where it is."""

    error: float
    factors: dict[str, float]
    mode: int
    """Counted from 1, rigid-body modes included; 0 where no mode lies that low."""


class BasisReport(NamedTuple):
    """How a reduced basis was built, and how accurate it is."""

    up_to: float
    tolerance: float
    measured: Worst
    """By full solutions at fresh points of the box."""
    estimated: Worst
    """By residual forces at all samples."""
    samples: int
    vectors: int
    nominal_modes: int
    rows: int
    full_solutions: int

    def __str__(self) -> str:
        place = ", ".join(f"{name} = {value:.3g}" for name, value in self.measured.factors.items())
        return (
            f"Reduced basis of {self.vectors} vectors, {self.nominal_modes} of them nominal modes, "
            f"for {self.rows} rows: natural frequencies up to {self.up_to:g} Hz are accurate to "
            f"{self.measured.error:.1e} (allowed {self.tolerance:.1e}), worst for mode "
            f"{self.measured.mode} at {place}, by full solutions at fresh points, and to "
            f"{self.estimated.error:.1e} by estimate at {self.samples} samples; "
            f"{self.full_solutions} full solutions."
        )


class ReducedBasis(NamedTuple):
    """Vectors that span the modes for all factors in a box, and the matrices between them."""

    basis: Float[np.ndarray, "dof vector"]
    """Mass-orthonormal at the nominal factors, rigid-body modes first [kg^-1/2]."""
    eigenvalues: Float[np.ndarray, "vector"]
    """Diagonal of the nominal stiffness between them [(rad/s)^2], 0 for rigid-body modes."""
    stiffness: Mapping[str, Square]
    """V^T K_i V of each part [(rad/s)^2]."""
    mass: Mapping[str, Square]
    """V^T M_i V of each part [1]."""
    rigid_body_modes: int
    report: BasisReport

    def natural_frequency(self, factors: Factors) -> Float[np.ndarray, "vector"]:
        """Natural frequencies [Hz] for some factors; those far above the band are too high."""
        stiffness, mass = np.diag(self.eigenvalues), np.eye(self.eigenvalues.size)
        for name, part in self.stiffness.items():
            stiffness += (factors[name] - 1) * part
        for name, part in self.mass.items():
            mass += (factors[name] - 1) * part
        eigenvalues = eigh(stiffness, mass, eigvals_only=True)
        eigenvalues[: self.rigid_body_modes] = 0.0
        return np.sqrt(eigenvalues) / (2 * np.pi)


class Accuracy(NamedTuple):
    """Modes that are to be accurate, how accurate, and where."""

    up_to: float
    """Squared angular frequency [(rad/s)^2]."""
    tolerance: float
    samples: list[dict[str, float]]
    gap: float
    """1 - (highest frequency of interest / lowest outside the first vectors)^2."""


def reduced_basis(
    flexibility: StaticFlexibility, affine: Affine, up_to: float, *, tolerance: float, margin: float
) -> ReducedBasis:
    """Basis of nominal modes, extended where the natural frequencies in a box are worst.

    Greedy: of all samples take the one with the largest estimated error, and add what its Ritz
    modes lack, the static responses to their residual forces (Rozza, Huynh & Patera, 2008,
    DOI 10.1007/s11831-008-9019-9). The estimate is then checked by full solutions at fresh points;
    where one disagrees, its modes are added, and the search is repeated.

    Arguments are those of `Matrices.reduced_basis`, on the rows that may move.
    """
    check_policy(up_to, tolerance, margin)
    eigenvalue = (2 * np.pi * up_to) ** 2
    wanted = Accuracy(eigenvalue, tolerance, affine.samples(SAMPLES), 1 - margin**-2)
    nominal = eigenmodes.below(flexibility, margin**2 * eigenvalue).shape
    if not nominal.size:
        nominal = eigenmodes.lowest(flexibility, 1).shape
    span = RitzSpan.of(flexibility, affine).extended(nominal)
    for attempt in range(ROUNDS):
        span, estimated = extended(span, wanted)
        points = [estimated.factors, *affine.random(FRESH, seed=attempt)]
        checked = [against_full(span, point, eigenvalue) for point in points]
        measured, modes = max(checked, key=lambda error_and_modes: error_and_modes[0].error)
        if measured.error <= tolerance:
            sizes = (span.basis.shape[1], nominal.shape[1] + span.rigid, len(nominal))
            full = 1 + (attempt + 1) * len(points)
            report = BasisReport(
                up_to, tolerance, measured, estimated, len(wanted.samples), *sizes, full
            )
            return diagonal(span, report)
        span = span.extended(modes.shape)
    raise not_reached(measured, tolerance)


def extended(span: RitzSpan, wanted: Accuracy) -> tuple[RitzSpan, Worst]:
    """Add vectors until the estimated error is below the tolerance at every sample."""
    for _ in range(ROUNDS):
        modes = [span.ritz(factors, wanted.up_to) for factors in wanted.samples]
        errors = [ritz.error.max(initial=0.0) for ritz in modes]
        sample = int(np.argmax(errors))
        error = errors[sample] / wanted.gap
        mode = int(np.argmax(modes[sample].error)) + span.rigid + 1 if error else 0
        worst = Worst(error, wanted.samples[sample], mode)
        if error <= wanted.tolerance:
            return span, worst
        span = span.extended(span.corrections(modes[sample], wanted.tolerance * wanted.gap))
    raise not_reached(worst, wanted.tolerance)


def against_full(
    span: RitzSpan, factors: dict[str, float], eigenvalue: float
) -> tuple[Worst, Eigenmodes]:
    """Largest error of the natural frequencies against a full solution, and its modes."""
    full = eigenmodes.below(span.flexibility.changed(*span.matrices(factors)), eigenvalue)
    if not full.eigenvalues.size:
        return Worst(0.0, factors, 0), full
    ritz = span.ritz(factors, np.inf).eigenvalues[: full.eigenvalues.size]
    error = np.sqrt(ritz / full.eigenvalues) - 1
    worst = int(np.argmax(error))
    return Worst(float(error[worst]), factors, worst + span.rigid + 1), full


def diagonal(span: RitzSpan, report: BasisReport) -> ReducedBasis:
    """Combine the vectors so that the nominal stiffness is diagonal."""
    rigid, size = span.rigid, span.basis.shape[1]
    combination = np.eye(size)
    eigenvalues = np.zeros(size)
    eigenvalues[rigid:], combination[rigid:, rigid:] = eigh(span.stiffness[0, rigid:, rigid:])
    stiffness, mass = (
        {
            name: combination.T @ part @ combination
            for name, part in zip(names, projected[1:], strict=True)
        }
        for names, projected in (
            (span.affine.stiffness, span.stiffness),
            (span.affine.mass, span.mass),
        )
    )
    basis = span.basis @ combination
    return ReducedBasis(basis, eigenvalues, stiffness, mass, rigid, report)


def check_policy(up_to: float, tolerance: float, margin: float) -> None:
    """Refuse a band or a tolerance without meaning."""
    if not (up_to > 0 and 0 < tolerance < 1 and margin > 1):
        raise InputError(
            f"up_to={up_to:g} Hz, tolerance={tolerance:g}, margin={margin:g} was given; a "
            "frequency above 0, a relative error between 0 and 1 and a margin above 1 are needed, "
            "since the first vectors must reach beyond the band: margin=1.5."
        )


def not_reached(worst: Worst, tolerance: float) -> InputError:
    """Say how inaccurate the basis still is, and where."""
    place = ", ".join(f"{name} = {value:.3g}" for name, value in worst.factors.items())
    return InputError(
        f"The natural frequencies are still off by {worst.error:.1e} at {place}, mode "
        f"{worst.mode}; {tolerance:.1e} is needed. The box is too wide for one basis, or a factor "
        "makes the structure nearly lose its stiffness there. Narrow its box, or allow more: "
        "tolerance=..."
    )
