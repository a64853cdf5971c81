"""Plates by Ritz's method against closed forms, tables and finite elements."""

from dataclasses import replace

import numpy as np
import pytest
import skfem
from scipy.sparse.linalg import eigsh

from tests import meshed_plates
from tests.simulator.fine_elements import effect
from tests.simulator.ritz_plates import FINE, Plate, plate_plant

PLATE = Plate(0.4, 0.3, 0.004, 7e10, 2700.0, 0.01)
GREATEST_ERROR = {"clamped": 1e-3, "cantilever": 0.01, "free": 0.01}


def scaled(plate):
    """Natural frequencies omega a^2 (rho h / D)^1/2 of the elastic modes."""
    natural = plate_plant(plate).natural
    natural = natural[natural > 1e-3 * natural[5]]
    return natural * plate.length**2 * np.sqrt(plate.density * plate.thickness / plate.rigidity)


def test_a_supported_plate_has_naviers_frequencies_and_shapes():
    m, n = np.meshgrid(np.arange(1, 20), np.arange(1, 20))
    ratio = PLATE.length / PLATE.width
    exact = np.sort(np.pi**2 * (m**2 + (ratio * n) ** 2).ravel())[:12]
    np.testing.assert_allclose(scaled(PLATE)[:12], exact, rtol=1e-7)
    place = 0.13, 0.07
    first = 2 / np.sqrt(PLATE.mass) * np.prod(np.sin(np.pi * np.divide(place, (0.4, 0.3))))
    assert abs(plate_plant(PLATE).rows([place])[0, 0]) == pytest.approx(first, rel=1e-8)


def test_polynomials_are_enough_also_between_places_close_together():
    # Measured FRFs have 1 % of noise: between resonances what is cut off must not be seen.
    plant = plate_plant(replace(PLATE, order=FINE))
    first, second = places = np.array([[0.205, 0.263], [0.226, 0.27]])
    rows = plant.rows(places)
    m, n = np.meshgrid(np.arange(1, 400), np.arange(1, 400))
    squared = np.pi**4 * ((m / 0.4) ** 2 + (n / 0.3) ** 2) ** 2
    squared *= PLATE.rigidity / (PLATE.density * PLATE.thickness)
    shapes = [np.sin(m * np.pi * x / 0.4) * np.sin(n * np.pi * y / 0.3) for x, y in (first, second)]
    exact = np.sum(4 / PLATE.mass * shapes[0] * shapes[1] / squared)
    assert np.sum(rows[0] * rows[1] / plant.natural**2) == pytest.approx(exact, rel=2e-3)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "ends", "sides", "table"),
    [
        ("clamped", "clamped-clamped", "clamped-clamped", [35.992, 73.413, 73.413, 108.27, 131.64]),
        ("cantilever", "clamped-free", "free-free", [3.4917, 8.5246, 21.429, 27.331, 31.111]),
        ("free", "free-free", "free-free", [13.489, 19.789, 24.432, 35.024, 35.024]),
    ],
)
def test_square_plates_have_the_frequencies_of_leissas_tables(name, ends, sides, table):
    # J. Sound Vib. 31 (1973) 257, nu = 0.3: upper bounds from 36 products of beam functions.
    square = replace(PLATE, width=PLATE.length, poisson_ratio=0.3, ends=ends, sides=sides)
    ratio = scaled(square)[: len(table)] / table
    assert np.all(ratio < 1 + 2e-5)
    assert np.all(ratio > 1 - GREATEST_ERROR[name])


@pytest.mark.parametrize("region", [5, *(pytest.param(r, marks=pytest.mark.long) for r in (0, 11))])
def test_a_weak_patch_is_where_finite_elements_have_it(region):
    hidden = effect("local_stiffness_loss", region=region, loss=0.3)
    sides = np.linspace(0, PLATE.length, 25), np.linspace(0, PLATE.width, 25)
    mesh = skfem.MeshQuad.init_tensor(*sides)
    basis = skfem.Basis(mesh, skfem.ElementQuadBFS())
    stiffness = meshed_plates.stiffness(PLATE, basis)
    patches = meshed_plates.regions(PLATE, mesh)
    assert abs(sum(patches.values()) - stiffness).max() < 1e-9 * abs(stiffness).max()
    mass = meshed_plates.mass(PLATE, basis)
    fixed = meshed_plates.supported(basis, PLATE)
    weak = stiffness - 0.3 * patches[f"patch {region}"]
    free = np.setdiff1d(np.arange(basis.N), fixed)
    inner = [matrix[free][:, free] for matrix in (stiffness, weak, mass)]
    even, softer = (
        np.sort(eigsh(matrix, 8, inner[2], sigma=0.0)[0]) for matrix in (inner[0], inner[1])
    )
    change = plate_plant(PLATE, hidden).natural[:8] / plate_plant(PLATE).natural[:8] - 1
    reference = np.sqrt(softer / even) - 1
    np.testing.assert_allclose(change, reference, rtol=0.02, atol=0.02 * abs(reference).max())


def test_even_pieces_scale_the_stiffness_and_pieces_are_in_their_order():
    even = replace(PLATE, pieces=(1.21,) * 12)
    ratio = plate_plant(even).natural / plate_plant(PLATE).natural
    np.testing.assert_allclose(ratio, 1.1, rtol=1e-9)
    uneven = replace(PLATE, pieces=(1.0, 0.7, *[1.0] * 10))
    weak = effect("local_stiffness_loss", region=1, loss=0.3)
    from_pieces, from_patch = plate_plant(uneven).natural, plate_plant(PLATE, weak).natural
    np.testing.assert_allclose(from_pieces, from_patch, rtol=1e-9)
