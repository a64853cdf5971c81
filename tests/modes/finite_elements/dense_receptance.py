"""Receptance by dense solutions with the matrices alone."""

import numpy as np
import scipy.linalg


def dense_receptance(matrices, rows, frequency, modes, damping_ratio):
    """Receptance [m/N] of rows, [response, reference, line], with viscous damping of some modes."""
    free = np.setdiff1d(np.arange(len(matrices.dof)), matrices.fixed)
    place = np.searchsorted(free, rows)
    stiffness, mass = (
        part.toarray()[np.ix_(free, free)] for part in (matrices.stiffness, matrices.mass)
    )
    momentum = mass @ modes.shape[free]
    rate = 2 * damping_ratio * 2 * np.pi * modes.natural_frequency
    damping = (momentum * rate) @ momentum.T
    force = np.eye(len(free))[:, place]
    lines = []
    for omega in 2 * np.pi * np.asarray(frequency):
        dynamic = stiffness - omega**2 * mass + 1j * omega * damping
        lines.append(scipy.linalg.solve(dynamic, force, assume_a="gen")[place])
    return np.stack(lines, axis=-1)
