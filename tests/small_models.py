"""Matrices of small models, made by scikit-fem and by hand.

Independent of bayes_placement.
"""

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags_array
from scipy.sparse.linalg import eigsh
from skfem import Basis, BilinearForm, ElementHex1, ElementQuadBFS, ElementVector, MeshHex, MeshQuad
from skfem.helpers import dd, ddot, dot, eye, trace
from skfem.models.elasticity import lame_parameters, linear_elasticity

from tests.simulator.hermite_elements import ELEMENTS, LENGTH, Elements

STIFFNESS, POISSON, DENSITY = 7e10, 0.33, 2700.0


def free_beam():
    """Free beam along x that bends along y, rows y and rz of each node: arguments of Matrices."""
    elements, size = Elements("free-free"), 2 * (ELEMENTS + 1)
    x = np.linspace(0.0, LENGTH, ELEMENTS + 1)
    node = np.repeat(np.arange(1, ELEMENTS + 2), 2)
    return dict(
        stiffness=elements._whole(elements.stiff, size),
        mass=elements.mass,
        position=np.column_stack([x, 0 * x, 0 * x]),
        dof=np.column_stack([node, np.tile([2, 6], ELEMENTS + 1)]),
    )


def solid(cells, size):
    """Block of linear hexahedra: stiffness, mass, position, dof; three rows a node."""
    sides = [np.linspace(0.0, length, count + 1) for length, count in zip(size, cells, strict=True)]
    mesh = MeshHex.init_tensor(*sides)
    basis = Basis(mesh, ElementVector(ElementHex1()))
    stiffness = linear_elasticity(*lame_parameters(STIFFNESS, POISSON)).assemble(basis)
    mass = BilinearForm(lambda u, v, _: DENSITY * dot(u, v)).assemble(basis)
    dof = np.empty((basis.N, 2), dtype=int)
    for direction, rows in enumerate(basis.nodal_dofs):
        dof[rows] = np.column_stack([np.arange(1, mesh.p.shape[1] + 1), 0 * rows + direction + 1])
    return dict(stiffness=stiffness, mass=mass, position=mesh.p.T, dof=dof)


class Plate:
    """Simply supported thin plate of Bogner-Fox-Schmit rectangles; z, rx, ry, w_xy a node."""

    def __init__(self, cells, size, thickness=0.004):
        self.size, self.thickness = size, thickness
        sides = [
            np.linspace(0.0, length, count + 1) for length, count in zip(size, cells, strict=True)
        ]
        mesh = MeshQuad.init_tensor(*sides)
        basis = Basis(mesh, ElementQuadBFS())
        self.rigidity = STIFFNESS * thickness**3 / 12 / (1 - POISSON**2)
        self.area_mass = DENSITY * thickness
        nodal = basis.nodal_dofs  # w, w_x, w_y, w_xy
        place, direction, sign = mesh.p.T, np.array([3, 5, 4, 7]), np.array([1.0, -1.0, 1.0, 1.0])
        self.dof = np.empty((basis.N, 2), dtype=int)
        turn = np.empty(basis.N)
        for rows, axis, way in zip(nodal, direction, sign, strict=True):
            self.dof[rows] = np.column_stack([np.arange(1, len(place) + 1), 0 * rows + axis])
            turn[rows] = way
        self.turn = diags_array(turn)
        self.position = np.column_stack([place, 0 * place[:, 0]])
        at_x = np.isin(place[:, 0], [0.0, size[0]])
        at_y = np.isin(place[:, 1], [0.0, size[1]])
        held_dofs = [nodal[0, at_x | at_y], nodal[1, at_y], nodal[2, at_x]]
        self.fixed = np.concatenate(held_dofs)
        self.stiffness = self._stiffness(basis)
        self.mass = self._turned(
            BilinearForm(lambda u, v, _: self.area_mass * u * v).assemble(basis)
        )
        self.mesh = mesh

    def part(self, chosen):
        """Stiffness of the cells whose centre is chosen."""
        centre = self.mesh.p[:, self.mesh.t].mean(axis=1)
        cells = np.flatnonzero(chosen(*centre))
        return self._stiffness(Basis(self.mesh, ElementQuadBFS(), elements=cells))

    def model(self):
        """Return arguments of Matrices."""
        return dict(
            stiffness=self.stiffness,
            mass=self.mass,
            position=self.position,
            dof=self.dof,
            fixed=self.fixed,
        )

    def navier(self, count):
        """Natural frequencies [Hz] in closed form."""
        m, n = np.meshgrid(np.arange(1, 30), np.arange(1, 30))
        wave = (m * np.pi / self.size[0]) ** 2 + (n * np.pi / self.size[1]) ** 2
        omega = np.sort(wave.ravel()) * np.sqrt(self.rigidity / self.area_mass)
        return omega[:count] / (2 * np.pi)

    def _stiffness(self, basis):
        def bending(u, v, _):
            curvature = dd(u)
            moment = (1 - POISSON) * curvature + POISSON * eye(trace(curvature), 2)
            return self.rigidity * ddot(moment, dd(v))

        return self._turned(BilinearForm(bending).assemble(basis))

    def _turned(self, matrix):
        return csr_matrix(self.turn @ matrix @ self.turn)


def lowest_frequencies(system, count):
    """Lowest natural frequencies [Hz] of matrices without rigid-body modes."""
    stiffness, mass = (csc_matrix(matrix) for matrix in system[:2])
    values = eigsh(stiffness, count, mass, sigma=0.0, return_eigenvectors=False)
    return np.sqrt(np.sort(values)) / (2 * np.pi)
