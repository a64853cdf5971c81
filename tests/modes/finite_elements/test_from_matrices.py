"""Modes from matrices compared with closed forms and direct solutions."""

import functools
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
import skfem
from skfem.helpers import dd, ddot, dot, eye, sym_grad, trace
from threadpoolctl import threadpool_info, threadpool_limits

import bayes_placement as bp
from bayes_placement import finite_elements
from bayes_placement.experiment import frf
from bayes_placement.modes.finite_elements import from_matrices
from bayes_placement.modes.points import Points
from tests.modes.finite_elements.dense_receptance import dense_receptance
from tests.simulator import space_frames
from tests.simulator.element_models import weights
from tests.small_models import DENSITY, POISSON, STIFFNESS

RATIO = 0.01
RECOMMENDED = {"portal": (80, 11), "plate": (150, 10)}
model_names = pytest.mark.parametrize("name", RECOMMENDED)


def receptance(modes, places, directions, frequency):
    """Receptance [m/N] between places along directions, by the public pieces."""
    structure = bp.Structure(modes, damping=bp.damping.Modal(RATIO))
    points = Points(jnp.asarray(places), np.asarray(directions)[:, np.array(modes.axes) - 1])
    return np.asarray(_receptance(structure, points, jnp.asarray(2 * np.pi * frequency)))


@eqx.filter_jit
def _receptance(structure, points, omega):
    return frf.receptance(structure, points, points, omega)


def direct(matrices, rows, frequency, count):
    """Receptance by a solution at each line, as many modes damped."""
    return dense_receptance(matrices, rows, frequency, matrices.modes(count=count), RATIO)


def error(estimate, expected):
    """Largest relative error away from antiresonances."""
    driving_point = np.sqrt(np.mean(np.abs(np.einsum("iif->if", expected)) ** 2, axis=1))
    felt = np.abs(expected) > 0.02 * np.sqrt(np.outer(driving_point, driving_point))[..., None]
    return np.abs(estimate / np.where(felt, expected, 1.0) - 1)[felt].max()


class HandedOver(NamedTuple):
    matrices: Any
    interpolation: Any
    frequency: Any

    def __hash__(self):
        return id(self.matrices)

    def __eq__(self, other):
        return self.matrices is other.matrices


@functools.cache
def handed_over(folder):
    arrays = bp.io.npz_modes.read_nodes(folder / "nominal.npz")
    regions = {f"region {number}": folder / f"K_region_{number:02d}.npz" for number in range(12)}
    system = bp.io.matrix_files.read(folder / "K.npz", folder / "M.npz", regions=regions)
    model = bp.finite_elements.Matrices(
        system.stiffness,
        system.mass,
        arrays.position,
        arrays.dof,
        node=arrays.node,
        fixed=arrays.fixed,
        regions=system.regions,
    )
    elements = np.searchsorted(arrays.node, arrays.element)
    kind = (
        bp.finite_elements.interpolation.frame
        if elements.shape[1] == 2
        else bp.finite_elements.interpolation.plate
    )
    return HandedOver(
        matrices=model,
        interpolation=kind(model, elements),
        frequency=bp.io.npz_modes.read(folder / "nominal.npz").natural_frequency,
    )


@functools.cache
def kept(model, count):
    """So many modes with the static flexibility."""
    up_to = 1.0001 * model.frequency[count - 1]
    return finite_elements.modes(model.matrices, model.interpolation, up_to=up_to)


@pytest.fixture
def model(shared_data, name):
    return handed_over(shared_data / "cases" / "models" / name)


def some_rows(matrices, axes, count):
    """Rows that may move, their places and directions."""
    free = np.setdiff1d(np.arange(len(matrices.dof)), matrices.fixed)
    free = free[np.isin(matrices.dof[free, 1], axes)]
    rows = np.sort(np.random.default_rng(4).choice(free, count, replace=False))
    node = np.argsort(matrices.node)[np.searchsorted(np.sort(matrices.node), matrices.dof[rows, 0])]
    return rows, matrices.position[node], np.eye(3)[matrices.dof[rows, 1] - 1]


@pytest.mark.parametrize("name", ["portal", pytest.param("plate", marks=pytest.mark.long)])
def test_natural_frequencies_are_those_handed_over(model, name):
    count, _ = RECOMMENDED[name]
    modes = kept(model, count)
    frequency = np.sqrt(modes.eigenvalues[:count]) / (2 * np.pi)
    np.testing.assert_allclose(frequency, model.frequency[:count], rtol=1e-6)


@pytest.mark.parametrize("name", ["portal", pytest.param("plate", marks=pytest.mark.long)])
def test_receptances_are_those_of_a_direct_solution(model, name):
    count, in_band = RECOMMENDED[name]
    modes = kept(model, count)
    rows, places, directions = some_rows(model.matrices, modes.axes, 5)
    frequency = np.linspace(0.05, 1.03, 9) * model.frequency[in_band - 1]
    expected = direct(model.matrices, rows, frequency, modes.eigenvalues.size)
    receptances = receptance(modes, places, directions, frequency)
    assert error(receptances, expected) < 0.005
    plain = receptance(_without_statics(modes), places, directions, frequency)
    assert error(plain, expected) > 0.005


def _without_statics(modes):
    fields = {name: getattr(modes, name) for name in modes.__dataclass_fields__}
    return type(modes)(**{**fields, "flexibility": None})


# A scikit-fem model as it stands: basis, stiffness, mass.

SIDES = (0.4, 0.3)
THICKNESS = 0.004
RIGIDITY = STIFFNESS * THICKNESS**3 / 12 / (1 - POISSON**2)
AREA_MASS = DENSITY * THICKNESS


def bending(u, v, _):
    moment = (1 - POISSON) * dd(u) + POISSON * eye(trace(dd(u)), 2)
    return RIGIDITY * ddot(moment, dd(v))


def plate_basis(element, cells=(10, 8)):
    sides = [np.linspace(0.0, side, count + 1) for side, count in zip(SIDES, cells, strict=True)]
    kind = skfem.MeshTri if isinstance(element, skfem.ElementTriMorley) else skfem.MeshQuad
    return skfem.Basis(kind.init_tensor(*sides).with_defaults(), element)


@functools.cache
def handed_plate(element, held=True, cells=(10, 8)):
    basis = plate_basis(element(), cells)
    edge = basis.get_dofs().all("u")
    if held and "u_x" in basis.elem.dofnames:  # along an edge the deflection and its slope vanish
        x, y = (basis.get_dofs(names) for names in (["bottom", "top"], ["left", "right"]))
        edge = np.concatenate([edge, x.all("u_x"), y.all("u_y")])
    return finite_elements.from_scikit_fem(
        basis,
        skfem.BilinearForm(bending).assemble(basis),
        skfem.BilinearForm(lambda u, v, _: AREA_MASS * u * v).assemble(basis),
        axes=(3,),
        fixed=edge if held else None,
    )


NAVIER = np.array([[m, n] for m in range(1, 300) for n in range(1, 300)])
WAVES = np.pi * NAVIER / SIDES
NATURAL = np.sqrt(RIGIDITY / AREA_MASS) * np.sum(WAVES**2, axis=1)


def navier(places, frequency):
    """Receptance of the simply supported plate between places, structural damping of no mode."""
    shape = np.prod(np.sin(WAVES * places[:, None, :2]), axis=2)
    shape *= 2 / np.sqrt(AREA_MASS * SIDES[0] * SIDES[1])
    omega = 2 * np.pi * frequency
    modal = 1 / (NATURAL[:, None] ** 2 - omega**2 + 2j * RATIO * NATURAL[:, None] * omega)
    return np.einsum("im,jm,mf->ijf", shape, shape, modal, optimize=True)


def test_a_scikit_fem_plate_is_that_of_navier():
    modes = finite_elements.modes(*handed_plate(skfem.ElementQuadBFS), up_to=8000.0)
    natural = np.sqrt(modes.eigenvalues[:8]) / (2 * np.pi)
    np.testing.assert_allclose(natural, np.sort(NATURAL)[:8] / (2 * np.pi), rtol=2e-3)
    places = np.array([[0.131, 0.077, 0.0], [0.252, 0.203, 0.0], [0.333, 0.058, 0.0]])
    frequency = np.array([60.0, 120.0, 260.0, 420.0])
    expected = navier(places, frequency)
    again = receptance(modes, places, np.tile([0.0, 0.0, 1.0], (3, 1)), frequency)
    size = np.abs(expected).max()
    # A force within an element meets a mesh that is a little too stiff there.
    np.testing.assert_allclose(again / size, expected / size, atol=5e-3)


def test_a_scikit_fem_plate_of_morley_converges_to_that_of_navier():
    errors = []
    for cells in ((10, 8), (20, 16)):
        matrices, _ = handed_plate(skfem.ElementTriMorley, cells=cells)
        natural = 2 * np.pi * matrices.modes(count=3).natural_frequency
        errors.append(np.abs(natural / np.sort(NATURAL)[:3] - 1).max())
    assert errors[1] < 0.035
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2, abs=0.4)


@pytest.mark.long
def test_a_scikit_fem_plate_of_morley_responds_as_its_matrices_do():
    handed = handed_plate(skfem.ElementTriMorley)
    modes = finite_elements.modes(*handed, up_to=6000.0)
    rows, places, directions = some_rows(handed.matrices, (3,), 4)
    frequency = np.linspace(40.0, 500.0, 30)
    expected = direct(handed.matrices, rows, frequency, modes.eigenvalues.size)
    assert error(receptance(modes, places, directions, frequency), expected) < 0.005


@pytest.mark.parametrize("element", [skfem.ElementQuadBFS, skfem.ElementTriMorley])
def test_a_free_scikit_fem_plate_has_three_rigid_body_modes(element):
    matrices, _ = handed_plate(element, held=False)
    frequency = matrices.modes(count=5).natural_frequency
    assert (frequency[:3] == 0).all() and frequency[3] > 10


ROD = dict(length=0.8, side=0.1, stiffness=7e10, density=2700.0)


@functools.cache
def handed_rod(held=True):
    """A rod of quadratic tetrahedra without lateral contraction, clamped at its root."""
    mesh = skfem.MeshTet.init_tensor(
        np.linspace(0, ROD["length"], 7), *2 * [np.linspace(0, ROD["side"], 2)]
    ).with_boundaries({"root": lambda x: x[0] == 0})
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP2()))

    def elasticity(u, v, _):
        return ROD["stiffness"] * ddot(sym_grad(u), sym_grad(v))

    return finite_elements.from_scikit_fem(
        basis,
        skfem.BilinearForm(elasticity).assemble(basis),
        skfem.BilinearForm(lambda u, v, _: ROD["density"] * dot(u, v)).assemble(basis),
        axes=(1, 2, 3),
        fixed=basis.get_dofs("root") if held else None,
    )


def test_a_scikit_fem_solid_has_the_longitudinal_modes_of_a_rod():
    handed = handed_rod()
    speed = np.sqrt(ROD["stiffness"] / ROD["density"])
    expected = speed / (4 * ROD["length"]) * np.array([1, 3])
    natural = handed.matrices.modes(up_to=1.1 * expected[1]).natural_frequency
    for longitudinal in expected:
        assert np.abs(natural / longitudinal - 1).min() < 2e-4
    assert (np.abs(natural / expected[0] - 1) > 0.05).sum() >= 4  # bending and torsion beside them


@pytest.mark.long
def test_a_scikit_fem_solid_responds_as_its_matrices_do():
    handed = handed_rod()
    modes = finite_elements.modes(*handed, up_to=12000.0)
    rows, places, directions = some_rows(handed.matrices, (1, 2, 3), 4)
    frequency = np.linspace(50.0, 1500.0, 30)
    expected = direct(handed.matrices, rows, frequency, modes.eigenvalues.size)
    assert error(receptance(modes, places, directions, frequency), expected) < 0.01


def test_a_free_scikit_fem_solid_has_six_rigid_body_modes():
    matrices, _ = handed_rod(held=False)
    assert (matrices.modes(count=7).natural_frequency[:6] == 0).all()
    assert matrices.rigid_body_modes == 6


@pytest.mark.parametrize("kind", ["plate of rectangles", "plate of Morley", "solid"])
def test_rows_have_the_node_and_the_axis_of_what_they_move(kind):
    matrices, reading = {
        "plate of rectangles": lambda: handed_plate(skfem.ElementQuadBFS),
        "plate of Morley": lambda: handed_plate(skfem.ElementTriMorley),
        "solid": handed_rod,
    }[kind]()
    translations = np.flatnonzero(matrices.dof[:, 1] <= 3)
    some = np.random.default_rng(1).choice(translations, 12)
    place = matrices.position[matrices.dof[some, 0] - 1]
    read = weights(reading, place, len(matrices.dof))
    for row, weight in zip(some, read, strict=True):
        axis = reading.axes.index(matrices.dof[row, 1])
        expected = np.zeros(len(matrices.dof))
        expected[row] = 1.0
        np.testing.assert_allclose(weight[axis], expected, atol=1e-9)
    assert kind == "solid" or translations.size == 11 * 9


def test_a_mesh_may_lie_anywhere_in_space():
    basis = plate_basis(skfem.ElementQuadBFS())
    stiffness = skfem.BilinearForm(bending).assemble(basis)
    mass = skfem.BilinearForm(lambda u, v, _: AREA_MASS * u * v).assemble(basis)
    directions = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    plate = finite_elements.from_scikit_fem(
        basis, stiffness, mass, axes=(1,), origin=np.array([0.5, 0.1, 0.2]), directions=directions
    )
    low, high = plate.matrices.position.min(axis=0), plate.matrices.position.max(axis=0)
    np.testing.assert_allclose(low, [0.5, 0.1, 0.2])
    np.testing.assert_allclose(high, [0.5, 0.1 + SIDES[0], 0.2 + SIDES[1]])
    assert set(plate.matrices.dof[:, 1]) == {1, 7}


# A frame in space by its own matrices.

FOOT, TIP = np.array([0.2, -0.1, 0.3]), np.array([0.7, 0.5, 0.9])
BAR = space_frames.RoundBar()


@functools.cache
def cantilever():
    """A skew cantilever of round section, clamped at its foot."""
    position, elements = space_frames.line(FOOT, TIP, 24)
    matrices = bp.finite_elements.Matrices(
        **space_frames.matrices(position, elements, BAR), fixed=np.arange(6)
    )
    return matrices, bp.finite_elements.interpolation.frame(matrices, elements)


def test_a_frame_in_space_has_the_modes_of_a_cantilever():
    length = np.linalg.norm(TIP - FOOT)
    wave = np.array([1.87510407, 4.69409113, 7.85475744]) / length
    bend = wave**2 * np.sqrt(BAR.youngs_modulus * BAR.moment / BAR.density / BAR.area)
    axial = np.pi / 2 / length * np.sqrt(BAR.youngs_modulus / BAR.density)
    torsion = np.pi / 2 / length * np.sqrt(BAR.shear_modulus / BAR.density)
    natural = 2 * np.pi * cantilever()[0].modes(up_to=2000.0).natural_frequency
    np.testing.assert_allclose(natural[:6], np.repeat(bend, 2), rtol=1e-5)
    for expected in (axial, torsion):
        assert np.abs(natural / expected - 1).min() < 2e-4


def test_a_frame_in_space_responds_as_its_matrices_do():
    matrices, reading = cantilever()
    modes = finite_elements.modes(matrices, reading, up_to=4000.0)
    rows, places, directions = some_rows(matrices, (1, 2, 3), 4)
    frequency = np.linspace(5.0, 200.0, 40)
    expected = direct(matrices, rows, frequency, modes.eigenvalues.size)
    assert error(receptance(modes, places, directions, frequency), expected) < 0.005


def test_the_mass_is_that_of_the_structure():
    modes = finite_elements.modes(*cantilever(), up_to=100.0)
    expected = BAR.density * BAR.area * np.linalg.norm(TIP - FOOT)
    assert modes.mass == pytest.approx(expected, rel=1e-12)


def test_threads_of_blas_do_not_wait_for_each_other(monkeypatch):
    threads, made = [], from_matrices._nodal

    def noted(*arguments, **options):
        threads.extend(
            pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"
        )
        return made(*arguments, **options)

    monkeypatch.setattr(from_matrices, "_nodal", noted)
    with threadpool_limits(2):
        finite_elements.modes(*cantilever(), up_to=100.0)
    assert threads and set(threads) == {1}


def test_too_many_rows_are_refused(monkeypatch):
    monkeypatch.setattr(from_matrices, "MAX_ROWS", 50)
    with pytest.raises(ValueError, match=r"reads 150 degrees of freedom.*interpolation\.near"):
        finite_elements.modes(*cantilever(), up_to=100.0)
    matrices, reading = cantilever()
    local_reading = reading.near(TIP[None], 0.05)
    assert finite_elements.modes(matrices, local_reading, up_to=100.0).shape.shape[0] < 50
