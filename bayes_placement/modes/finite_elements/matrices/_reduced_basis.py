"""A fixed basis in which modes stay accurate for all factors in a box."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import eigh

from ...._shared.errors import InputError
from . import _eigenmodes as eigenmodes
from ._affine import Affine, Factors
from ._eigenmodes import Eigenmodes
from ._ritz_span import RitzSpan
from ._static_flexibility import StaticFlexibility

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
