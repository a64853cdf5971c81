"""Matrices of straight Euler-Bernoulli members in space.

The sections are round, so that an element needs no orientation about its axis. Independent of
bayes_placement.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array

DIRECTIONS = 6


@dataclass(frozen=True)
class RoundBar:
    """Material and solid round section."""

    radius: float = 0.01
    youngs_modulus: float = 2.1e11
    poisson_ratio: float = 0.3
    density: float = 7850.0

    @property
    def area(self) -> float:
        return np.pi * self.radius**2

    @property
    def moment(self) -> float:
        """Second moment of area; that of torsion is twice as great."""
        return np.pi * self.radius**4 / 4

    @property
    def shear_modulus(self) -> float:
        return self.youngs_modulus / (2 + 2 * self.poisson_ratio)


def line(start, end, count):
    """Nodes and elements of one member."""
    share = np.linspace(0.0, 1.0, count + 1)[:, None]
    nodes = np.arange(count)
    return (1 - share) * start + share * np.asarray(end), np.stack([nodes, nodes + 1], axis=1)


def matrices(position, elements, bar):
    """Stiffness, mass, position and dof, six rows a node: arguments of Matrices."""
    rows = (DIRECTIONS * elements[:, :, None] + np.arange(DIRECTIONS)).reshape(len(elements), -1)
    size = DIRECTIONS * len(position)
    pairs = np.stack([element(*position[ends], bar) for ends in elements], axis=1)
    places = (np.repeat(rows, 12, axis=1).ravel(), np.tile(rows, 12).ravel())
    stiffness, mass = (coo_array((values.ravel(), places), shape=(size, size)) for values in pairs)
    node = np.repeat(np.arange(1, len(position) + 1), DIRECTIONS)
    dof = np.stack([node, np.tile(np.arange(1, DIRECTIONS + 1), len(position))], axis=1)
    return dict(stiffness=stiffness.tocsc(), mass=mass.tocsc(), position=position, dof=dof)


def element(start, end, bar):
    """Stiffness and mass of one element in space, consistent, without rotary inertia in bending."""
    length = np.linalg.norm(end - start)
    along = (end - start) / length
    across = np.linalg.svd(along[None])[2][1]
    turn = np.kron(np.eye(4), np.stack([along, across, np.cross(along, across)]))
    return [turn.T @ matrix @ turn for matrix in _local(length, bar)]


def _local(length, bar):
    h, stiffness, mass = length, np.zeros((12, 12)), np.zeros((12, 12))
    per_length = bar.density * bar.area
    bending = bar.youngs_modulus * bar.moment / h**3
    stiff = bending * np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]])
    heavy = [[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]
    for rows, sign in (([1, 5, 7, 11], 1), ([2, 4, 8, 10], -1)):  # dw/dx = -theta_y
        scale = np.array([1, sign * h, 1, sign * h])
        stiffness[np.ix_(rows, rows)] = stiff * np.outer(scale, scale)
        mass[np.ix_(rows, rows)] = per_length * h / 420 * np.array(heavy) * np.outer(scale, scale)
    twist = 2 * bar.moment
    axial, torsion = bar.youngs_modulus * bar.area, bar.shear_modulus * twist
    for rows, rigidity, inertia in (
        ([0, 6], axial, per_length),
        ([3, 9], torsion, bar.density * twist),
    ):
        stiffness[np.ix_(rows, rows)] = rigidity / h * np.array([[1, -1], [-1, 1]])
        mass[np.ix_(rows, rows)] = inertia * h / 6 * np.array([[2, 1], [1, 2]])
    return stiffness, mass
