"""Matrices compared with closed forms, dense solutions, and models of a finite element code."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csc_array, diags_array, load_npz

from bayes_placement.modes.finite_elements.matrices import Matrices
from bayes_placement.modes.finite_elements.matrices import _eigenmodes as eigenmodes
from bayes_placement.modes.finite_elements.matrices import _static_flexibility as statics
from bayes_placement.modes.finite_elements.matrices._static_flexibility import (
    factorised,
    nested_dissection,
)
from tests.modes.finite_elements.dense_receptance import dense_receptance
from tests.simulator.hermite_elements import AREA, BENDING, DENSITY, ELEMENTS, LENGTH, Elements
from tests.small_models import Plate, free_beam, solid

SIZE = 2 * (ELEMENTS + 1)
BEAM_ROOTS = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671])


def beam(**changes):
    return Matrices(**(free_beam() | changes))


def dense(model):
    """Natural frequencies [Hz] and shapes of all modes by a dense solution on the free rows."""
    free = np.setdiff1d(np.arange(len(model.dof)), model.fixed)
    stiffness, mass = (
        matrix.toarray()[np.ix_(free, free)] for matrix in (model.stiffness, model.mass)
    )
    squares, shape = eigh(stiffness, mass)
    shapes = np.zeros((len(model.dof), free.size))
    shapes[free] = shape
    return np.sqrt(np.maximum(squares, 0)) / (2 * np.pi), shapes


def pseudo_inverse(model, rigid):
    frequency, shape = dense(model)
    elastic = shape[:, rigid:]
    return (elastic / (2 * np.pi * frequency[rigid:]) ** 2) @ elastic.T


@pytest.fixture(scope="module")
def plate():
    return Plate((12, 9), (0.4, 0.3))


@pytest.fixture(scope="module")
def held_plate(plate):
    return Matrices(**plate.model())


@pytest.fixture(scope="module")
def block():
    return Matrices(**solid((8, 3, 3), (1.0, 0.2, 0.15)))


@pytest.fixture(scope="module", params=["portal", pytest.param("plate", marks=pytest.mark.long)])
def handed_over(request, shared_data):
    folder = shared_data / "cases" / "models" / request.param
    if not folder.is_dir():
        pytest.skip(f"the finite element models are not on this machine: there is no {folder}")
    arrays = np.load(folder / "nominal.npz")
    regions = {
        str(name): load_npz(folder / f"K_region_{number:02d}.npz")
        for number, name in enumerate(arrays["region_names"])
    }
    model = Matrices(
        load_npz(folder / "K.npz"),
        load_npz(folder / "M.npz"),
        arrays["nodes"],
        arrays["dofs"],
        arrays["node_ids"],
        arrays["fixed_dofs"],
        regions,
    )
    return model, arrays


def test_modes_are_those_that_the_code_handed_over(handed_over):
    model, arrays = handed_over
    modes = model.modes(count=arrays["freqs_hz"].size)
    assert modes.natural_frequency == pytest.approx(arrays["freqs_hz"], rel=1e-7)
    # Shapes of repeated modes may be mixed: compare what they span, weighted by 1 / omega^2.
    weight = arrays["freqs_hz"] ** -2.0
    ours = (modes.shape * weight) @ modes.shape.T
    theirs = (arrays["modes"] * weight) @ arrays["modes"].T
    assert np.abs(ours - theirs).max() < 1e-5 * np.abs(theirs).max()
    assert (modes.shape[model.fixed] == 0).all()


def test_static_flexibility_of_the_handed_over_models_is_the_inverse(handed_over):
    model, _ = handed_over
    rows = np.flatnonzero(model.dof[:, 1] <= 3)
    flexibility = model.static_flexibility(rows)
    free = np.setdiff1d(np.arange(len(model.dof)), model.fixed)
    inverse = np.zeros(model.stiffness.shape)
    inverse[np.ix_(free, free)] = np.linalg.inv(model.stiffness.toarray()[np.ix_(free, free)])
    expected = inverse[np.ix_(rows, rows)]
    assert np.abs(flexibility - expected).max() < 1e-8 * np.abs(expected).max()


def test_modes_and_static_flexibility_are_the_direct_response(handed_over):
    model, arrays = handed_over
    every = model.modes(count=arrays["freqs_hz"].size)
    band = 400.0 if len(model.dof) == 438 else 1500.0
    frequency = np.linspace(0.03, 1.0, 12) * band
    inside = np.setdiff1d(np.flatnonzero(model.dof[:, 1] <= 3), model.fixed)
    rows = inside[[5, 40, 77, 113]]
    direct = dense_receptance(model, rows, frequency, every, 0.01)
    few_lines = [2, 9]
    sparse = model.receptance(rows, rows, frequency[few_lines], modes=every, damping_ratio=0.01)
    np.testing.assert_allclose(sparse, direct[..., few_lines], rtol=1e-7)
    omega, static = 2 * np.pi * frequency, model.static_flexibility(rows)[..., None]
    slope = model.static_flexibility(rows, power=2)[..., None]
    driving = np.sqrt(np.abs(np.einsum("iif->if", direct)))
    mask = np.abs(direct) > 0.3 * driving[:, None] * driving[None]  # away from antiresonances
    narrow, wide = every.below(3 * band), every.below(5 * band)
    # Modes, whether to second order, what is allowed.
    trials = ((narrow, 1, 8e-3), (wide, 0, 8e-3), (wide, 1, 2e-3), (every, 0, 1e-3))
    for modes, second, allowed in trials:
        natural = 2 * np.pi * modes.natural_frequency[:, None]
        modal = 1 / (natural**2 - omega**2 + 2j * 0.01 * natural * omega) - natural**-2
        modal = modal - second * omega**2 * natural**-4
        modal_sum = np.einsum("im,jm,mf->ijf", *[modes.shape[rows]] * 2, modal)
        modal_sum = modal_sum + static + second * omega**2 * slope
        assert (np.abs(modal_sum - direct) / np.abs(direct))[mask].max() < allowed


def test_navier_gives_the_natural_frequencies_of_a_plate(plate, held_plate):
    frequencies = held_plate.modes(count=12).natural_frequency
    assert frequencies == pytest.approx(plate.navier(12), rel=2e-3)
    assert (frequencies > plate.navier(12)).all()  # Rayleigh: from above


def test_a_square_plate_has_its_repeated_modes():
    plate = Plate((10, 10), (0.3, 0.3))
    modes = Matrices(**plate.model()).modes(up_to=1.01 * plate.navier(12)[-1])
    assert modes.natural_frequency[:12] == pytest.approx(plate.navier(12), rel=5e-3)
    assert modes.natural_frequency[1] == pytest.approx(modes.natural_frequency[2], rel=1e-9)


def test_modes_are_mass_normalised_signed_and_always_the_same(held_plate, plate):
    modes = held_plate.modes(count=20)
    modal = modes.shape.T @ (held_plate.mass @ modes.shape)
    assert np.abs(modal - np.eye(20)).max() < 1e-9
    cantilever = beam(fixed=[0, 1]).modes(count=8).shape
    assert (cantilever.max(axis=0) > -cantilever.min(axis=0)).all()
    again = Matrices(**plate.model()).modes(count=20)
    assert np.array_equal(again.shape, modes.shape)
    assert (again.natural_frequency == modes.natural_frequency).all()


def test_all_modes_up_to_a_frequency(held_plate):
    every, _ = dense(held_plate)
    limit = (every[14] + every[15]) / 2
    modes = held_plate.modes(up_to=limit)
    assert modes.natural_frequency == pytest.approx(every[:15], rel=1e-9)


def test_lanczos_and_the_dense_solution_agree(held_plate):
    every, _ = dense(held_plate)
    count = every.size // 2
    assert held_plate.modes(count=count).natural_frequency == pytest.approx(every[:count], rel=1e-7)
    assert held_plate.modes(count=30).natural_frequency == pytest.approx(every[:30], rel=1e-9)


def test_a_free_beam_has_two_rigid_body_modes_and_the_roots_of_its_equation():
    model = beam()
    modes = model.modes(count=5)
    assert (modes.natural_frequency[:2] == 0).all() and modes.rigid_body_modes == 2
    expected = (BEAM_ROOTS / LENGTH) ** 2 * np.sqrt(BENDING / (DENSITY * AREA)) / (2 * np.pi)
    assert modes.natural_frequency[2:] == pytest.approx(expected, rel=1e-4)
    modal = modes.shape.T @ (model.mass @ modes.shape)
    assert np.abs(modal - np.eye(5)).max() < 1e-9


def test_flexibility_of_a_free_beam_is_the_pseudo_inverse_with_respect_to_mass():
    expected = Elements("free-free").flexibility
    flexibility = beam().static_flexibility(np.arange(SIZE))
    assert np.abs(flexibility - expected).max() < 1e-8 * np.abs(expected).max()


def test_a_free_block_has_six_rigid_body_modes(block):
    every, _ = dense(block)
    modes = block.modes(count=16)
    assert block.rigid_body_modes == modes.rigid_body_modes == 6
    assert modes.natural_frequency[6:] == pytest.approx(every[6:16], rel=1e-8)
    assert np.abs(modes.shape.T @ (block.mass @ modes.shape) - np.eye(16)).max() < 1e-9
    rows, columns = np.array([3, 70, 200]), np.array([0, 70])
    expected = pseudo_inverse(block, 6)[np.ix_(rows, columns)]
    flexibility = block.static_flexibility(rows, columns)
    assert np.abs(flexibility - expected).max() < 1e-8 * np.abs(expected).max()


def test_rigid_body_fields_need_no_force(block):
    place = block.position[block.node_index]
    fields = statics.geometric_fields(place, block.dof[:, 1])
    assert np.abs(block.stiffness @ fields).max() < 1e-12 * np.abs(block.stiffness).max()
    assert statics.free_fields(block.stiffness, fields, fields[:0]).shape == (len(place), 6)


def test_rotations_take_part_in_rigid_body_fields(held_plate):
    place = held_plate.position[held_plate.node_index]
    fields = statics.geometric_fields(place, held_plate.dof[:, 1])
    assert statics.free_fields(held_plate.stiffness, fields, fields[:0]).shape == (len(place), 3)


def test_handed_over_models_move_as_rigid_bodies_once_nothing_holds_them(handed_over):
    model, _ = handed_over
    place = model.position[model.node_index]
    fields = statics.geometric_fields(place, model.dof[:, 1])
    expected = 6 if len(place) == 438 else 3
    assert statics.free_fields(model.stiffness, fields, fields[:0]).shape[1] == expected


def test_supports_leave_the_motions_that_they_do_not_hold(block):
    axis = np.flatnonzero((block.position[:, 1:] == 0).all(axis=1)) + 1
    on_axis = np.isin(block.dof[:, 0], axis)
    hinged = np.flatnonzero(on_axis & (block.dof[:, 1] > 1))
    model = Matrices(block.stiffness, block.mass, block.position, block.dof, fixed=hinged)
    modes = model.modes(count=4)
    assert modes.rigid_body_modes == 2  # along the hinge line, and about it
    assert modes.natural_frequency[2:] == pytest.approx(dense(model)[0][2:4], rel=1e-7)


def test_a_soft_suspension_is_elastic():
    stiffness, spring = Elements("free-free")._whole(Elements("free-free").stiff, SIZE), 10.0
    stiffness[0, 0] += spring
    stiffness[-2, -2] += spring
    model = beam(stiffness=stiffness)
    total = beam().mass.toarray()[::2, ::2].sum()
    assert model.rigid_body_modes == 0
    bounce = np.sqrt(2 * spring / total) / (2 * np.pi)
    assert model.modes(count=3).natural_frequency[0] == pytest.approx(bounce, rel=1e-4)


def test_a_hinge_is_a_motion_without_strain_energy():
    """Two beams that share a displacement but no rotation."""
    elements = Elements("free-free")
    between = np.zeros((2 * SIZE, 2 * SIZE - 1))
    between[:SIZE, :SIZE] = np.eye(SIZE)
    between[SIZE, SIZE - 2] = 1.0
    between[SIZE + 1 :, SIZE:] = np.eye(SIZE - 1)
    stiffness, mass = (
        between.T @ np.kron(np.eye(2), matrix) @ between
        for matrix in (elements._whole(elements.stiff, SIZE), elements.mass)
    )
    x = np.linspace(0.0, LENGTH, ELEMENTS + 1)
    x = np.concatenate([x, [LENGTH], LENGTH + x[1:]])
    node = np.concatenate([np.repeat(np.arange(ELEMENTS + 1), 2), [ELEMENTS + 1]])
    node = np.concatenate([node, np.repeat(np.arange(ELEMENTS + 2, 2 * ELEMENTS + 2), 2)])
    direction = np.concatenate([np.tile([2, 6], ELEMENTS + 1), [6], np.tile([2, 6], ELEMENTS)])
    position = np.column_stack([x, 0 * x, 0 * x])
    dof = np.column_stack([node, direction])
    model = Matrices(stiffness, mass, position, dof, np.arange(x.size))
    modes = model.modes(count=6)
    assert modes.rigid_body_modes == 3
    assert modes.natural_frequency[3:] == pytest.approx(dense(model)[0][3:6], rel=1e-7)
    flexibility = model.static_flexibility([0, 4, SIZE + 3])
    expected = pseudo_inverse(model, 3)[np.ix_([0, 4, SIZE + 3], [0, 4, SIZE + 3])]
    assert np.abs(flexibility - expected).max() < 1e-7 * np.abs(expected).max()


def test_rotations_may_have_no_mass():
    lumped = np.tile([1.0, 0.0], ELEMENTS + 1)
    model = beam(mass=diags_array(lumped), fixed=[0, 1])
    free = np.arange(2, SIZE)
    retained, eliminated = free[::2], free[1::2]
    full = model.stiffness.toarray()
    inner = np.linalg.solve(
        full[np.ix_(eliminated, eliminated)], full[np.ix_(eliminated, retained)]
    )
    condensed = full[np.ix_(retained, retained)] - full[np.ix_(retained, eliminated)] @ inner
    expected = np.sqrt(np.linalg.eigvalsh(condensed)[:4]) / (2 * np.pi)
    assert model.modes(count=4).natural_frequency == pytest.approx(expected, rel=1e-8)
    with pytest.raises(ValueError, match="the structure has 20"):
        model.modes(count=30)


def test_receptance_is_the_dense_solution(held_plate):
    modes = held_plate.modes(count=15)
    frequency = np.array([40.0, modes.natural_frequency[2], 700.0])
    rows, columns = np.array([60, 121, 122]), np.array([60, 200])
    receptance = held_plate.receptance(
        rows, columns, frequency, modes=modes, damping_ratio=0.02, loss_factor=0.01
    )
    free = np.setdiff1d(np.arange(len(held_plate.dof)), held_plate.fixed)
    stiffness = held_plate.stiffness.toarray()[np.ix_(free, free)]
    mass = held_plate.mass.toarray()[np.ix_(free, free)]
    momentum = (held_plate.mass @ modes.shape)[free]
    damping = (momentum * (0.04 * 2 * np.pi * modes.natural_frequency)) @ momentum.T
    for line, omega in enumerate(2 * np.pi * frequency):
        dynamic_stiffness = stiffness * (1 + 0.01j) - omega**2 * mass + 1j * omega * damping
        expected = np.zeros((len(held_plate.dof),) * 2, dtype=complex)
        expected[np.ix_(free, free)] = np.linalg.inv(dynamic_stiffness)
        expected = expected[np.ix_(rows, columns)]
        assert np.abs(receptance[..., line] - expected).max() < 1e-7 * np.abs(expected).max()


def test_a_released_clamp_reacts_like_the_beam_table():
    clamped = beam(fixed=[0, 1, SIZE - 2, SIZE - 1])
    release = clamped.release([1], clamped.modes(count=3))
    coupled = clamped.modes(count=3).shape.T @ (clamped.mass @ release.shape)
    assert release.mass_with_modes == pytest.approx(coupled, rel=1e-9)
    assert release.stiffness == pytest.approx(np.array([[4 * BENDING / LENGTH]]))
    assert release.shape[1] == pytest.approx(1.0) and (release.shape[[0, -2, -1]] == 0).all()


def test_release_and_modes_are_the_structure_on_soft_supports():
    """All fixed-interface modes and constraint modes span every motion."""
    fixed, soft = [0, 1, SIZE - 2, SIZE - 1], [1, SIZE - 2]
    clamped, springs = beam(fixed=fixed), np.array([3e3, 2e5])
    modes = clamped.modes(count=SIZE - 4)
    release = clamped.release(soft, modes)
    squares = (2 * np.pi * modes.natural_frequency) ** 2
    none = np.zeros((squares.size, 2))
    interface = release.stiffness + np.diag(springs)
    stiffness = np.block([[np.diag(squares), none], [none.T, interface]])
    coupled = release.mass_with_modes
    mass = np.block([[np.eye(squares.size), coupled], [coupled.T, release.mass]])
    frequencies = np.sqrt(eigh(stiffness, mass, eigvals_only=True)[:6]) / (2 * np.pi)
    sprung = clamped.stiffness.toarray()
    sprung[soft, soft] += springs
    expected = beam(stiffness=sprung, fixed=[0, SIZE - 1]).modes(count=6).natural_frequency
    assert frequencies == pytest.approx(expected, rel=1e-8)


def test_a_band_is_filled_as_the_inertia_says(held_plate, monkeypatch):
    lanczos, limit = eigenmodes._lanczos, held_plate.modes(count=7).natural_frequency[-1] + 1.0

    def careless(flexibility, count, seed):
        pairs = lanczos(flexibility, count + 1, seed)
        retained = np.arange(count + 1) != (2 if seed == 0 else count)
        return eigenmodes.Eigenmodes(pairs.eigenvalues[retained], pairs.shape[:, retained])

    monkeypatch.setattr(eigenmodes, "_lanczos", careless)
    frequencies = held_plate.modes(up_to=limit).natural_frequency
    assert frequencies == pytest.approx(dense(held_plate)[0][:7], rel=1e-9)


def test_a_mode_that_lanczos_missed_is_found_again(held_plate, monkeypatch):
    lanczos, asked = eigenmodes._lanczos, []

    def careless(flexibility, count, seed):
        asked.append(seed)
        pairs = lanczos(flexibility, count + 1, seed)
        retained = np.arange(count + 1) != 2
        return (
            pairs
            if seed
            else eigenmodes.Eigenmodes(pairs.eigenvalues[retained], pairs.shape[:, retained])
        )

    monkeypatch.setattr(eigenmodes, "_lanczos", careless)
    frequencies = held_plate.modes(count=8).natural_frequency
    assert asked == [0, 1] and frequencies == pytest.approx(dense(held_plate)[0][:8], rel=1e-9)
    monkeypatch.setattr(eigenmodes, "_missed", lambda *_: True)
    with pytest.raises(ArithmeticError, match="missed modes"):
        held_plate.modes(count=8)


def test_the_order_of_elimination_fills_less(block):
    index, free = block.node_index, np.arange(len(block.dof))
    order = nested_dissection(block.stiffness, index, block.position)
    assert np.array_equal(np.sort(order), free)
    lifted = block.stiffness + block.mass
    shuffled = np.random.default_rng(0).permutation(free)
    fill = [factorised((lifted[rows][:, rows]).tocsc()).triangles.nnz for rows in (order, shuffled)]
    assert 2 * fill[0] < fill[1]


def test_a_factor_is_trusted_next_to_a_natural_frequency_too(held_plate):
    """There a solution is large, and its residual too; what counts is the error beside it."""
    flexibility = held_plate.flexibility
    square = (2 * np.pi * held_plate.modes(count=2).natural_frequency[1]) ** 2
    for nudge, below in ((-1e-9, 1), (1e-6, 2)):
        shifted = flexibility.stiffness - (1 + nudge) * square * flexibility.mass
        factor = factorised(csc_array(shifted))
        assert factor.trustworthy() and factor.negative_pivots() == below


def test_a_factor_that_grows_is_not_trusted():
    assert not factorised(csc_array([[1e-14, 1.0], [1.0, 1.0]])).trustworthy()
