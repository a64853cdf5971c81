"""The lowest elastic modes, none missed."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.linalg import eigh, null_space
from scipy.sparse import csc_array
from scipy.sparse.linalg import LinearOperator, eigsh

from ...._shared.errors import InputError, NumericalError
from ._static_flexibility import StaticFlexibility, factorised, start_vector, with_sign

ATTEMPTS = 3
DENSE = 3
"""Rows for each mode wanted, up to which a dense solution is cheaper."""

SHIFTS = (0.0, 1e-6, -1e-6, 1e-5, -1e-5)


class Eigenmodes(NamedTuple):
    """Eigenvalues omega_n^2 [(rad/s)^2] and mass-normalised shapes of elastic modes."""

    eigenvalues: Float[np.ndarray, "mode"]
    shape: Float[np.ndarray, "row mode"]


def lowest(flexibility: StaticFlexibility, count: int) -> Eigenmodes:
    """Return the lowest elastic modes by shift-invert Lanczos at zero, checked by inertia.

    The operator is the static flexibility, in which no rigid-body mode is left. Single-vector
    Lanczos may miss a copy of a repeated mode. Sturm's count of the modes below the last one
    shows it (Bathe, Finite Element Procedures, section 11.6).
    """
    if count < 1:
        return _none(flexibility)
    return _checked(flexibility, count, lambda values: not _missed(flexibility, values))


def below(flexibility: StaticFlexibility, eigenvalue: float) -> Eigenmodes:
    """All elastic modes below an eigenvalue, as many as the inertia there says."""
    count = modes_below(flexibility, eigenvalue) - flexibility.fields.shape[1]
    if count < 1:
        return _none(flexibility)
    level = (1 + 2 * max(SHIFTS)) * eigenvalue
    return _checked(flexibility, count, lambda values: bool(values[-1] < level))


def modes_below(flexibility: StaticFlexibility, eigenvalue: float) -> int:
    """Number of modes, rigid-body modes included, below an eigenvalue [(rad/s)^2].

    The negative pivots of K - omega^2 M, by Sylvester's law of inertia.
    """
    for relative in SHIFTS:
        shift = (1 + relative) * eigenvalue
        factor = factorised(csc_array(flexibility.stiffness - shift * flexibility.mass))
        if factor.trustworthy():
            return factor.negative_pivots()
    raise NumericalError(
        f"K - omega^2 M cannot be factorised near {np.sqrt(eigenvalue) / (2 * np.pi):g} Hz without "
        "exchanging rows, so the modes below cannot be counted. Use another frequency."
    )


def _none(flexibility: StaticFlexibility) -> Eigenmodes:
    return Eigenmodes(np.zeros(0), np.zeros((flexibility.mass.shape[0], 0)))


def _checked(
    flexibility: StaticFlexibility, count: int, complete: Callable[[np.ndarray], bool]
) -> Eigenmodes:
    """Lanczos iteration, repeated where it is not complete; dense where many modes are wanted."""
    elastic = flexibility.mass.shape[0] - flexibility.fields.shape[1]
    if DENSE * count >= elastic:
        return _dense(flexibility, count)
    for attempt in range(ATTEMPTS):
        modes = _lanczos(flexibility, count + 4 * attempt, attempt)
        if complete(modes.eigenvalues[:count]):
            return Eigenmodes(modes.eigenvalues[:count], modes.shape[:, :count])
        if flexibility.factor.negative_pivots():
            raise _indefinite()
    raise NumericalError(
        f"Lanczos iteration missed modes among the lowest {count} in {ATTEMPTS} attempts, as the "
        "inertia of the shifted stiffness shows. Ask for a few modes more: modes(count=...)."
    )


def _lanczos(flexibility: StaticFlexibility, count: int, seed: int) -> Eigenmodes:
    size = flexibility.mass.shape[0]
    operator = LinearOperator((size, size), matvec=flexibility, dtype=float)
    eigenvalues, shape = eigsh(
        flexibility.stiffness,
        k=count,
        M=flexibility.mass,
        sigma=0.0,
        OPinv=operator,
        v0=start_vector(size, seed),
    )
    if (eigenvalues <= 0).any():
        raise _indefinite()
    order = np.argsort(eigenvalues)
    return Eigenmodes(eigenvalues[order], with_sign(shape[:, order]))


def _missed(flexibility: StaticFlexibility, eigenvalues: np.ndarray) -> bool:
    """Tell whether there are more modes clearly below the last one than were found."""
    level = (1 - 1e-5) * eigenvalues[-1]
    count = flexibility.fields.shape[1] + np.count_nonzero(eigenvalues < level)
    return bool(modes_below(flexibility, level) != count)


def _dense(flexibility: StaticFlexibility, count: int) -> Eigenmodes:
    """Return the lowest modes by a dense solution among the motions orthogonal to the fields."""
    stiffness, mass = flexibility.stiffness.toarray(), flexibility.mass.toarray()
    elastic = null_space((mass @ flexibility.fields).T) if flexibility.pins.size else None
    if elastic is not None:
        stiffness, mass = (elastic.T @ matrix @ elastic for matrix in (stiffness, mass))
    # M in terms of K, since the mass may be singular and the stiffness is not.
    try:
        inverse, shape = eigh(mass, stiffness)
    except np.linalg.LinAlgError as error:
        raise _indefinite() from error
    inverse, shape = inverse[::-1], shape[:, ::-1]
    known = int(np.count_nonzero(inverse > 1e-14 * inverse[0]))
    if count > known:
        raise InputError(
            f"{count} elastic modes were asked for, but the structure has {known}: not more than "
            "it has degrees of freedom with mass. Ask for fewer."
        )
    shape = shape[:, :count] / np.sqrt(inverse[:count])
    return Eigenmodes(1 / inverse[:count], with_sign(shape if elastic is None else elastic @ shape))


def _indefinite() -> InputError:
    return InputError(
        "The stiffness is not positive semi-definite: a motion has negative strain energy. A "
        "structure at rest needs strain energy to deform. Look at how stiffness was assembled, at "
        "its sign, and at the digits it was written with: a free structure needs all sixteen."
    )
