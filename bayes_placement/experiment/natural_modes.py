"""Natural frequencies and mode shapes of a structure with what is attached to it."""

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._shared.compiled import Bound, compiled, programs_kept
from ..modes.modes import Modes
from ..modes.points import Points, joined
from .frf import linear_laws
from .structure import Structure

STEPS = 400
"""Frequencies at which changes of sign are looked for."""

SAME = 1e-9
"""Share of a natural frequency to which it is found."""

PROGRAMS = programs_kept(24)
"""Those of eight structures: each that is looked at has three, and may be looked at once."""


class NaturalModes(NamedTuple):
    """Natural frequencies and mode shapes without damping."""

    frequency: Float[np.ndarray, "mode"]
    """Natural frequencies [Hz], ascending, without those of rigid-body modes."""
    shape: Float[np.ndarray, "mode point 3"]
    """Displacement at points along x, y and z, the greatest of each mode being 1."""


def natural_modes(
    structure: Structure, points: np.ndarray, up_to: float, most: int
) -> NaturalModes:
    """Return the natural modes of a structure with its linear attachments, without damping.

    With the amplitudes q of the modes of the structure proper and an attachment of the dynamic
    stiffness Z at ports p, (diag(omega_n^2) + Phi_p' (1/Z + R)^-1 Phi_p - omega^2) q = 0. R is the
    static flexibility of the modes left out (MacNeal 1971, DOI 10.1016/0045-7949(71)90031-9). A
    natural frequency is where an eigenvalue of this matrix falls through zero; at the natural
    frequency of an absorber by itself it jumps upwards instead. Springs that depend on the
    amplitude are left out. Points at which shapes are read [m] are numbers on a line, else three
    each; modes are the lowest ones up to a frequency [Hz].
    """
    at_line = compiled(_at_line).bound(structure, effort=0, programs=PROGRAMS)
    at_ports = compiled(_at_ports).bound(structure, effort=0, programs=PROGRAMS)()
    pencil = _Pencil(at_line, *map(np.asarray, at_ports))
    grid = 2 * np.pi * up_to * (np.arange(STEPS) + 1) / STEPS
    roots = list(_roots(pencil, grid, most))
    frequency = np.array([root for root, _ in roots]) / (2 * np.pi)
    if not roots:
        return NaturalModes(frequency, np.zeros((0, len(points), 3)))
    shape = np.zeros((len(roots), len(points), 3))
    of_points = structure, np.asarray(points)
    at_points = compiled(_at_points).bound(*of_points, effort=0, programs=PROGRAMS)()
    read, left_out = map(np.asarray, at_points)
    for mode, (root, branch) in enumerate(roots):
        amplitude = pencil.vector(root, branch)
        modulus, attached = pencil.attached(root)
        # The forces of the attachments also bend what the kept modes leave out.
        force = -attached @ pencil.shapes @ amplitude
        for axis, number in enumerate(structure.modes.axes):
            of_modes = read[:, axis] @ amplitude
            shape[mode, :, number - 1] = of_modes + left_out[axis] @ force / modulus
    largest = np.linalg.norm(shape, axis=2).max(axis=1)
    return NaturalModes(frequency, shape / largest[:, None, None])


class _Pencil(NamedTuple):
    """Modal matrix of a structure as a function of the angular frequency."""

    at_line: Bound[tuple[Array, Array]]
    """`_at_line` of the structure, compiled."""
    natural: np.ndarray
    """Natural angular frequencies [mode] of the structure proper [rad/s]."""
    shapes: np.ndarray
    """Shapes at the ports of all attachments [port, mode] [kg^-1/2]."""
    residual: np.ndarray
    """Flexibility between ports of the modes left out [m/N]."""

    def attached(self, omega: float) -> tuple[float, np.ndarray]:
        """Modulus over that as drawn [1], and stiffness of ports in series with `residual`."""
        modulus, stiffness = map(np.asarray, self.at_line(np.array([omega])))
        # (1 + Z R)^-1 Z, as of an oscillator.
        factor = np.eye(stiffness.size) + stiffness[:, None] * self.residual / float(modulus)
        return float(modulus), np.linalg.solve(factor, np.diag(stiffness))

    def matrix(self, omega: float) -> np.ndarray:
        """Modal dynamic stiffness [(rad/s)^2]."""
        modulus, attached = self.attached(omega)
        added = self.shapes.T @ attached @ self.shapes
        return np.diag(self.natural**2 * modulus - omega**2) + (added + added.T) / 2

    def eigenvalues(self, omega: float) -> np.ndarray:
        """Eigenvalues of the matrix, ascending."""
        return np.linalg.eigvalsh(self.matrix(omega))

    def vector(self, omega: float, branch: int) -> np.ndarray:
        """Amplitudes of the modes at a natural frequency."""
        return np.linalg.eigh(self.matrix(omega))[1][:, branch]


def _roots(pencil: _Pencil, grid: np.ndarray, most: int) -> Iterator[tuple[float, int]]:
    """Angular frequencies at which an eigenvalue falls through zero, and its number."""
    before, count = pencil.eigenvalues(grid[0]), 0
    for low, high in itertools.pairwise(grid):
        after = pencil.eigenvalues(high)
        for branch in np.flatnonzero((before > 0) & (after <= 0)):
            if count < most:
                yield _root(pencil, low, high, int(branch)), int(branch)
            count += 1
        if count >= most:
            return
        before = after


def _root(pencil: _Pencil, low: float, high: float, branch: int) -> float:
    from scipy.optimize import brentq  # it takes long to import

    root = brentq(lambda omega: pencil.eigenvalues(omega)[branch], low, high, rtol=SAME)
    return float(root)


def _ports(structure: Structure, modes: Modes) -> Points | None:
    """Ports of all attachments; None where nothing is attached."""
    laws = linear_laws(structure, modes, jnp.ones(1))
    return joined([law.points for law in laws]) if laws else None


def _at_ports(structure: Structure) -> tuple[Array, Array, Array]:
    """Natural angular frequencies, shapes at the ports, and the flexibility left out there."""
    modes = structure.proper_modes()
    natural, ports = modes.angular_frequency(), _ports(structure, modes)
    if ports is None:
        return natural, jnp.zeros((0, natural.size)), jnp.zeros((0, 0))
    return natural, ports.exact_shapes(modes), ports.flexibility_left_out(modes, ports)


def _at_line(structure: Structure, omega: Float[Array, "1"]) -> tuple[Array, Array]:
    """Modulus over that as drawn [1], and dynamic stiffness of each port [N/m], without loss."""
    modes = structure.proper_modes()
    pairs = [law.of_each() for law in linear_laws(structure, modes, omega)]
    stiffness = [jnp.real(numerator / denominator)[:, 0] for numerator, denominator in pairs]
    modulus = jnp.real(structure.relative_modulus(omega))[0]
    return modulus, jnp.concatenate([jnp.zeros(0), *stiffness])


def _at_points(structure: Structure, points: Array) -> tuple[Array, Array]:
    """Shapes [point, axis, mode] [kg^-1/2], and flexibility left out [axis, point, port] [m/N]."""
    modes = structure.proper_modes()
    ports, axes = _ports(structure, modes), len(modes.axes)
    read = jax.vmap(modes.shapes)(points)
    if ports is None:
        return read, jnp.zeros((axes, points.shape[0], 0))
    along = [jnp.broadcast_to(row, (points.shape[0], axes)) for row in np.eye(axes)]
    return read, jnp.stack(
        [Points(points, row).flexibility_left_out(modes, ports) for row in along]
    )
