"""Modes of the plates of the simulator, from meshes of them."""

import numpy as np
import skfem
from skfem.helpers import dd, ddot, eye, trace

import bayes_placement as bp
from tests.simulator.imperfect_scenes import PLATE_MODES, elastic
from tests.simulator.ritz_plates import Plate

CELLS = (16, 12)
"""Elements along the sides of a plate; each region of 4 by 3 has as many."""


def plate_modes(plate: Plate, cells: tuple[int, int] = CELLS, **material):
    """Modes of a mesh of Bogner-Fox-Schmit rectangles, as many for any plate."""
    sides = [
        np.linspace(0.0, size, count + 1)
        for size, count in zip((plate.length, plate.width), cells, strict=True)
    ]
    mesh = skfem.MeshQuad.init_tensor(*sides)
    basis = skfem.Basis(mesh, skfem.ElementQuadBFS())
    model = bp.finite_elements.from_scikit_fem(
        basis,
        stiffness(plate, basis),
        mass(plate, basis),
        axes=(3,),
        fixed=supported(basis, plate),
        regions=regions(plate, mesh),
    )
    last, next_one = elastic(plate)[PLATE_MODES - 1 : PLATE_MODES + 1] / (2 * np.pi)
    return bp.finite_elements.modes(
        *model,
        up_to=float(np.sqrt(last * next_one)),
        nominal=(plate.youngs_modulus, plate.density),
        **material,
    )


def stiffness(plate: Plate, basis):
    def bending(u, v, _):
        ratio = plate.poisson_ratio
        moment = (1 - ratio) * dd(u) + ratio * eye(trace(dd(u)), 2)
        return plate.rigidity * ddot(moment, dd(v))

    return skfem.BilinearForm(bending).assemble(basis)


def mass(plate: Plate, basis):
    return skfem.BilinearForm(lambda u, v, _: plate.density * plate.thickness * u * v).assemble(
        basis
    )


def supported(basis, plate: Plate) -> np.ndarray:
    """Deflection and slope along each edge."""
    deflection, along, across = basis.nodal_dofs[:3]
    x, y = basis.mesh.p
    at_x, at_y = np.isin(x, [0.0, plate.length]), np.isin(y, [0.0, plate.width])
    return np.concatenate([deflection[at_x | at_y], along[at_y], across[at_x]])


def regions(plate: Plate, mesh):
    """Stiffness of the patches, along x first."""
    x, y = mesh.p[:, mesh.t].mean(axis=1)
    columns, rows = plate.grid
    patch = (x * columns // plate.length) + columns * (y * rows // plate.width)
    element = skfem.ElementQuadBFS()
    return {
        f"patch {number}": stiffness(
            plate, skfem.Basis(mesh, element, elements=np.flatnonzero(patch == number))
        )
        for number in range(columns * rows)
    }
