"""Modal models of finite element codes: normalisation, units and refusals."""

import tracemalloc

import numpy as np
import pytest

from bayes_placement.modes.finite_elements.modal_model import ModalModel

SEED = np.random.SeedSequence(41)
MASS = np.array([0.5, 2.0, 8.0])
FREQUENCY = np.array([12.0, 31.0, 77.0])


@pytest.fixture(scope="module")
def arrays():
    random = np.random.default_rng(SEED)
    return {
        "position": random.uniform(size=(4, 3)),
        "shape": random.normal(size=(4, 3, 3)),
        "natural_frequency": FREQUENCY,
        "modal_mass": MASS,
    }


def built(arrays, **changes):
    return ModalModel.from_arrays(**(arrays | changes))


def test_shapes_are_divided_by_the_roots_of_the_modal_masses(arrays):
    model = built(arrays, node=[40, 30, 20, 10])
    assert model.dof[4].tolist() == [30, 2]
    np.testing.assert_allclose(model.shape[4], arrays["shape"][1, 1] / np.sqrt(MASS), rtol=1e-15)
    assert model.rigid_body_modes == 0 and model.damping_ratio is None


def test_normalised_shapes_have_unit_modal_mass():
    """A chain of masses on springs: the modal masses of the result, from its mass matrix, are 1."""
    mass = np.diag([1.0, 2.0, 3.0, 0.5])
    stiffness = 1e4 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    # NumPy 2.5 returns complex numbers, whose imaginary parts are zero.
    squared, shape = (values + 0j for values in np.linalg.eig(np.linalg.solve(mass, stiffness)))
    squared = squared.real
    order = np.argsort(squared)
    shape = shape[:, order] * [1.0, -3.0, 0.2, 7.0]
    model = ModalModel.from_arrays(
        position=np.eye(4, 3),
        dof=[(n, 1) for n in range(1, 5)],
        shape=shape,
        natural_frequency=np.sqrt(squared[order]) / (2 * np.pi),
        modal_mass=np.diag(shape.T @ mass @ shape).real,
    )
    np.testing.assert_allclose(model.shape.T @ mass @ model.shape, np.eye(4), atol=1e-13)
    omega = 2 * np.pi * model.natural_frequency
    np.testing.assert_allclose(
        model.shape.T @ stiffness @ model.shape, np.diag(omega**2), atol=1e-9 * omega[-1] ** 2
    )


def test_six_axes_and_rows_by_dof_are_the_same_model(arrays):
    turning = np.concatenate([arrays["shape"], 3 * arrays["shape"]], axis=1)
    by_axis = built(arrays, shape=turning)
    rows = np.random.default_rng(SEED).permutation(24)
    by_row = built(arrays, shape=turning.reshape(24, 3)[rows], dof=by_axis.dof[rows])
    assert sorted(set(by_axis.dof[:, 1].tolist())) == [1, 2, 3, 4, 5, 6]
    np.testing.assert_array_equal(by_row.shape, by_axis.shape[rows])
    np.testing.assert_array_equal(by_row.dof, by_axis.dof[rows])


def test_units_of_length_and_mass(arrays):
    """The same structure in mm and tonnes: 1 m is 1000 mm, a rotation of 1 rad/m is 1e-3 rad/mm."""
    directions = [1, 2, 3, 4, 5, 6, 7] * 2
    dof = np.column_stack([np.repeat([1, 2], 7), directions])
    in_si = np.random.default_rng(SEED).normal(size=(14, 3))
    length = np.array([1e3, 1e3, 1e3, 1, 1, 1, 1e-3] * 2)  # of a displacement, slope, twist in mm
    settings = {"natural_frequency": FREQUENCY, "dof": dof}
    metres = ModalModel.from_arrays(position=np.eye(2, 3), shape=in_si, modal_mass=MASS, **settings)
    # Kinetic energy of one modal coordinate, in t mm2 instead of kg m2, is 1e3 as much.
    millimetres = ModalModel.from_arrays(
        position=1e3 * np.eye(2, 3),
        shape=in_si * length[:, None],
        modal_mass=1e3 * MASS,
        length_unit=1e-3,
        mass_unit=1e3,
        **settings,
    )
    np.testing.assert_allclose(millimetres.position, metres.position, rtol=1e-15)
    np.testing.assert_allclose(millimetres.shape, metres.shape, rtol=1e-12)


@pytest.mark.parametrize(
    ("natural_frequency", "rigid"),
    [
        ([0.0, 0.0, 0.0, 4.0], 3),
        ([1e-6, 2e-6, 1.9e-3, 2.0], 3),  # 1.9e-3 < 1e-3 x 2
        ([1e-6, 2e-6, 2.1e-3, 2.0], 2),  # 2e-6 < 1e-3 x 2.1e-3, which is elastic then
        ([1.0, 2.0, 3.0, 4.0], 0),
        ([0.0, 0.0, 0.0, 0.0], 4),
        ([1e-5, 3e-5, 1e-4, 2e-4], 0),  # nothing to compare with
    ],
)
def test_rigid_body_modes_have_exactly_zero(natural_frequency, rigid):
    model = ModalModel.from_arrays(
        position=np.zeros((2, 3)),
        shape=np.ones((2, 3, 4)),
        natural_frequency=natural_frequency,
        modal_mass=1,
    )
    assert model.rigid_body_modes == rigid
    assert (model.natural_frequency[:rigid] == 0).all()
    np.testing.assert_array_equal(model.natural_frequency[rigid:], natural_frequency[rigid:])


def test_a_gap_above_many_modes_makes_none_of_them_rigid():
    frequency = [*range(10, 20), 1e6]
    model = ModalModel.from_arrays(
        position=np.zeros((2, 3)),
        shape=np.ones((2, 3, 11)),
        natural_frequency=frequency,
        modal_mass=1,
    )
    assert model.rigid_body_modes == 0


def test_few_nodes_are_kept_with_their_rows(arrays):
    model = built(arrays, node=[40, 30, 20, 10], damping_ratio=[0.01, 0.02, 0.03])
    restricted = model.restricted([10, 40])
    assert restricted.node.tolist() == [40, 10]
    assert restricted.dof[:, 0].tolist() == [40] * 3 + [10] * 3
    np.testing.assert_array_equal(restricted.position, model.position[[0, 3]])
    np.testing.assert_array_equal(restricted.shape, model.shape[[0, 1, 2, 9, 10, 11]])
    np.testing.assert_array_equal(restricted.damping_ratio, model.damping_ratio)


def test_the_lowest_modes_are_kept(arrays):
    model = built(arrays, damping_ratio=[0.01, 0.02, 0.03])
    for lowest in (model.count(2), model.below(31.5)):
        np.testing.assert_array_equal(lowest.shape, model.shape[:, :2])
        assert lowest.natural_frequency.tolist() == [12.0, 31.0]
        assert lowest.damping_ratio.tolist() == [0.01, 0.02]
    assert model.below(31.0).natural_frequency.tolist() == [12.0]


def test_directions_in_which_nothing_moves_are_left_out(arrays):
    across = np.zeros((4, 6, 3))
    across[1:, 2:4] = 1.0  # the first node is held
    model = built(arrays, shape=across).without_unused_directions()
    assert model.dof.tolist() == [[n, d] for n in (1, 2, 3, 4) for d in (3, 4)]
    assert model.without_unused_directions() is model


def test_a_model_says_what_it_holds(arrays):
    model = built(arrays, natural_frequency=[0.0, 31.0, 77.0], damping_ratio=[0.01] * 3)
    assert repr(model) == (
        "ModalModel: 4 nodes, 12 degrees of freedom (x, y, z), 3 modes up to 77 Hz, 1 of them "
        "rigid-body modes; damping known"
    )


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_large_shapes_keep_their_precision_and_are_copied_once(precision):
    nodes, modes = 20_000, 30
    shape = np.ones((nodes, 3, modes), precision)
    position = np.zeros((nodes, 3))
    tracemalloc.start()
    model = ModalModel.from_arrays(
        position=position,
        shape=shape,
        natural_frequency=np.arange(1.0, modes + 1),
        modal_mass=np.full(modes, 4.0),
    )
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert model.shape.dtype == precision and (model.shape == 0.5).all()
    tables = 8 * (2 * 3 * nodes + 3 * nodes + nodes)  # dof, position, node
    assert peak < 1.05 * shape.nbytes + 4 * tables


def test_mass_normalised_shapes_are_not_copied(arrays):
    model = built(arrays, modal_mass=1)
    assert np.shares_memory(model.shape, arrays["shape"])


def test_a_mode_may_move_to_one_side_only(arrays):
    aside = np.zeros((4, 3, 3))
    aside[1] = -1.0
    assert built(arrays, shape=aside, modal_mass=1).shape.min() == -1.0
    with pytest.raises(ValueError, match=r"not finite in mode 1, 2, 3"):
        built(arrays, shape=np.where(aside < 0, -np.inf, 0.0))


NAN = np.full((4, 3, 3), 1.0)
NAN[2, 1, 1] = np.nan
STILL = np.ones((4, 3, 3))
STILL[:, :, 2] = 0.0
PLANE = [(n, d) for n in (1, 2, 3, 4) for d in (1, 3)]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"modal_mass": None}, r"3 mode shapes came without modal masses.*modal_mass=1 if"),
        ({"modal_mass": [1.0, 0.0, 1.0]}, r"modal_mass of mode 2 is 0 kg; positive"),
        ({"modal_mass": [1.0, 2.0]}, r"modal_mass has the shape \(2,\); one finite number \[kg\]"),
        ({"modal_mass": [1.0, np.nan, 2.0]}, r"modal_mass has gaps"),
        ({"shape": NAN}, r"shape holds values that are not finite in mode 2 .*Leave the mode out"),
        ({"shape": STILL}, r"shape is zero at every node in mode 3 \(counted from 1\)"),
        ({"shape": np.ones((4, 3, 3)) * 1j}, r"shape is complex; the real normal modes"),
        ({"shape": np.ones((4, 2, 3))}, r"shape has the shape \(4, 2, 3\) for 4 nodes; \[4, 3 or"),
        ({"shape": np.ones((5, 3, 3))}, r"shape has the shape \(5, 3, 3\) for 4 nodes"),
        ({"shape": np.ones((12, 3))}, r"came without dof; .*the direction in which"),
        ({"dof": PLANE}, r"shape has the shape \(4, 3, 3\) and came with dof"),
        ({"shape": np.ones((4, 3, 0)), "natural_frequency": []}, r"at least one mode at one node"),
        ({"shape": np.ones((9, 3)), "dof": PLANE}, r"dof has the shape \(8, 2\), but shape has 9"),
        ({"shape": np.ones((2, 3)), "dof": [(1, 3), (1, 8)]}, r"direction 8 of node 1; 1 to 6"),
        (
            {"shape": np.ones((2, 3)), "dof": [(1, 0), (1, 1)]},
            r"Add 1 where directions are counted",
        ),
        ({"shape": np.ones((2, 3)), "dof": [(1, 3), (7, 3)]}, r"Node 7 is not among the 4 nodes"),
        ({"shape": np.ones((2, 3)), "dof": [(1, 3), (1, 3)]}, r"node 1, direction 3 more than"),
        ({"shape": np.ones((2, 3)), "dof": [(1, 3), (1.5, 3)]}, r"dof holds float64 values; whole"),
        ({"node": [1, 2, 2, 3]}, r"node holds the number 2 more than once"),
        ({"node": [1, 2, 3]}, r"node has the shape \(3,\), but position places 4 nodes"),
        ({"position": np.ones((4, 2))}, r"position has the shape \(4, 2\); \[node, 3\] is needed"),
        ({"position": np.full((4, 3), np.inf)}, r"position of node 0 .* finite coordinates"),
        ({"natural_frequency": [12.0, 77.0, 31.0]}, r"of mode 3 is 31 Hz; numbers from 0 in asc"),
        ({"natural_frequency": [-1e-4, 1.0, 2.0]}, r"of mode 1 is -0.0001 Hz; .*Give 0 for rigid"),
        ({"natural_frequency": [1.0, 2.0]}, r"natural_frequency has the shape \(2,\); one finite"),
        ({"damping_ratio": [0.01, 2.0, 0.02]}, r"damping_ratio of mode 2 is 2; .*per cent by 100"),
        ({"damping_ratio": [0.01, -0.1, 0.02]}, r"damping_ratio of mode 2 is -0.1"),
        ({"length_unit": 0.0}, r"length_unit is 0; a positive number is needed"),
        ({"mass_unit": -1.0}, r"mass_unit is -1; a positive number"),
    ],
)
def test_what_is_refused(arrays, changes, message):
    with pytest.raises(ValueError, match=message):
        built(arrays, **changes)


def test_what_a_model_does_not_have(arrays):
    model = built(arrays)
    with pytest.raises(ValueError, match=r"Node 5, 9 is not among the 4 nodes .*1 to 4"):
        model.restricted([1, 9, 5])
    with pytest.raises(ValueError, match=r"count\(4\) was asked of a model of 3 modes; 1 to 3"):
        model.count(4)
    with pytest.raises(ValueError, match=r"count\(0\)"):
        model.count(0)
    with pytest.raises(ValueError, match=r"below\(2\) keeps no mode: the lowest .* is 12 Hz"):
        model.below(2.0)
