"""Receptance by a direct solution at each frequency."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float
from scipy.sparse import block_array, csc_array, diags_array
from scipy.sparse.linalg import splu

PIVOT_THRESHOLD = 1e-3
"""Share of the largest entry of its column, below which a pivot is exchanged."""


class ModalDamping(NamedTuple):
    """Viscous damping U diag(2 zeta omega_n) U^T of some modes, U = M Phi."""

    momentum: Float[np.ndarray, "row mode"]
    rate: Float[np.ndarray, "mode"]


def receptance(
    stiffness: csc_array,
    mass: csc_array,
    damping: ModalDamping,
    read: Float[np.ndarray, "row response"],
    driven: Float[np.ndarray, "row reference"],
    omega: Float[np.ndarray, "frequency"],
) -> Complex[np.ndarray, "response reference frequency"]:
    """Receptance [m/N] between forces and displacements.

    Modal damping couples all rows. The modal displacements y = U^T x are therefore kept as
    unknowns, so that the equations stay sparse but for their border.

    The stiffness has its loss factor. `read` and `driven` are the weights of the rows in each
    displacement, and of each force on the rows; omega is in rad/s.
    """
    modes = damping.rate.size
    right = np.vstack([driven, np.zeros((modes, driven.shape[1]))]).astype(complex)
    receptance = np.empty((read.shape[1], driven.shape[1], omega.size), dtype=complex)
    for line, angular in enumerate(omega):
        matrix = _bordered(stiffness - angular**2 * mass, damping, angular)
        # The order of the rows fills little, the border is last; few rows need to be exchanged.
        solution = splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=PIVOT_THRESHOLD).solve(
            right
        )
        receptance[..., line] = read.T @ solution[: len(driven)]
    return receptance


def _bordered(dynamic: csc_array, damping: ModalDamping, omega: float) -> csc_array:
    if not damping.rate.size:
        return csc_array(dynamic, dtype=complex)
    force = csc_array(1j * omega * damping.momentum * damping.rate)
    identity = diags_array(np.ones(damping.rate.size))
    return csc_array(block_array([[dynamic, force], [csc_array(damping.momentum.T), -identity]]))
