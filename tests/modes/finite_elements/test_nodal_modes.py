"""Scaled, moved and renumbered models compared with new solutions; free structures."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.spatial.transform import Rotation

import bayes_placement as bp
from bayes_placement import finite_elements
from bayes_placement._shared.sites import unknowns
from bayes_placement.experiment import frf
from bayes_placement.modes.finite_elements import modes_from_shapes
from bayes_placement.modes.finite_elements.nodal_modes import UnknownModes, nodal_of
from bayes_placement.modes.points import Points
from tests.modes.finite_elements.test_from_matrices import direct, error, receptance, some_rows
from tests.simulator import space_frames

BAR = space_frames.RoundBar()
TOP = 2500.0
FREQUENCY = np.linspace(4.0, 160.0, 30)


def corner():
    """Nodes and elements of two members at an angle, neither along an axis."""
    first, ends = space_frames.line(np.array([0.2, -0.1, 0.3]), [0.7, 0.5, 0.9], 12)
    second, further_ends = space_frames.line(first[-1], [1.2, 0.2, 1.1], 12)
    return np.vstack([first, second[1:]]), np.vstack([ends, further_ends + len(ends)])


def frame(bar=BAR, *, held=True, turn=None, shift=0.0, order=None):
    """Matrices of the corner and how it is read, moved in space, its nodes in another order."""
    position, elements = corner()
    order = np.arange(len(position)) if order is None else order
    elements = np.argsort(order)[elements]
    position = (position if turn is None else position @ turn.T)[order] + shift
    foot = int(np.flatnonzero(order == 0)[0])
    fixed = 6 * foot + np.arange(6) if held else None
    matrices = bp.finite_elements.Matrices(
        **space_frames.matrices(position, elements, bar), fixed=fixed
    )
    return matrices, bp.finite_elements.interpolation.frame(matrices, elements)


@functools.cache
def built(held=True):
    matrices, reading = frame(held=held)
    return matrices, finite_elements.modes(matrices, reading, up_to=TOP)


PLACES = np.array([[0.43, 0.176, 0.576], [0.72, 0.488, 0.908], [1.0, 0.32, 1.02]])
DIRECTIONS = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.48, 0.6, 0.64]])


@functools.cache
def nominal():
    return receptance(built()[1], PLACES, DIRECTIONS, FREQUENCY)


def close(result, expected, tolerance):
    size = np.abs(expected).max()
    np.testing.assert_allclose(result / size, expected / size, atol=tolerance)


@functools.partial(jax.jit, static_argnums=0)
def _static(number, modes, places):
    return jax.vmap(lambda x: jax.vmap(lambda y: modes.static_flexibility(x, y))(places))(places)


def static(modes, places):
    return np.asarray(_static(0, modes, jnp.asarray(places)))


def test_modulus_and_density_scale_as_if_solved_anew():
    stiffer = space_frames.RoundBar(youngs_modulus=1.7 * BAR.youngs_modulus, density=6000.0)
    expected = finite_elements.modes(*frame(stiffer), up_to=1.05 * np.sqrt(1.7 / 6 * 7.85) * TOP)
    scaled = finite_elements.modes(
        *frame(),
        up_to=TOP,
        youngs_modulus=stiffer.youngs_modulus,
        density=stiffer.density,
        nominal=(BAR.youngs_modulus, BAR.density),
    )
    count = scaled.eigenvalues.size
    np.testing.assert_allclose(
        scaled.natural_frequency, np.sqrt(expected.eigenvalues[:count]) / (2 * np.pi), rtol=1e-8
    )
    close(static(scaled, PLACES), static(expected, PLACES), 1e-9)
    receptances = receptance(scaled, PLACES, DIRECTIONS, FREQUENCY)
    close(receptances, receptance(expected, PLACES, DIRECTIONS, FREQUENCY), 1e-5)
    assert np.abs(receptances - nominal()).max() > 0.1 * np.abs(nominal()).max()


def test_priors_of_modulus_and_density_are_unknowns():
    matrices, reading = frame()
    distribution = dist.Uniform(0.9, 1.1)
    modes = finite_elements.modes(
        matrices, reading, up_to=TOP, youngs_modulus=distribution, density=distribution
    )
    names = [(unknown.name, unknown.unit) for unknown in unknowns(modes)]
    assert names == [("youngs_modulus", "Pa"), ("density", "kg/m3")]


def test_the_static_flexibility_is_that_of_the_matrices():
    matrices, modes = built()
    rows, places, directions = some_rows(matrices, (1, 2, 3), 4)
    flexibility = np.einsum("ia,ijab,jb->ij", directions, static(modes, places), directions)
    close(flexibility, matrices.static_flexibility(rows), 1e-12)


def test_between_nodes_it_is_that_of_elements_cut_there():
    """A place within an element becomes a node of a finer model: cubics are exact there."""
    position, elements = corner()
    middle = (position[7] + position[8]) / 2
    cut = [element for element in elements.tolist() if element != [7, 8]]
    finer = np.array([*cut, [7, 25], [25, 8]])
    arrays = space_frames.matrices(np.vstack([position, middle]), finer, BAR)
    matrices = bp.finite_elements.Matrices(**arrays, fixed=np.arange(6))
    expected = matrices.static_flexibility(6 * 25 + np.arange(3), 6 * 20 + np.arange(3))
    flexibility = static(built()[1], np.stack([middle, position[20]]))[0, 1]
    close(flexibility, expected, 1e-10)


def test_moving_the_coordinate_system_changes_nothing():
    turn = Rotation.from_euler("xyz", [0.3, -0.7, 1.1]).as_matrix()
    shift = np.array([3.0, -2.0, 0.5])
    modes = finite_elements.modes(*frame(turn=turn, shift=shift), up_to=TOP)
    receptances = receptance(modes, PLACES @ turn.T + shift, DIRECTIONS @ turn.T, FREQUENCY)
    close(receptances, nominal(), 1e-7)


def test_the_order_of_nodes_is_of_no_consequence():
    order = np.random.default_rng(2).permutation(25)
    modes = finite_elements.modes(*frame(order=order), up_to=TOP)
    close(receptance(modes, PLACES, DIRECTIONS, FREQUENCY), nominal(), 1e-7)


def test_rows_that_are_never_read_are_not_kept():
    matrices, reading = frame()
    near = reading.near(PLACES, 0.01)
    modes = finite_elements.modes(matrices, near, up_to=TOP)
    assert modes.shape.shape[0] < 0.5 * built()[1].shape.shape[0]
    close(receptance(modes, PLACES, DIRECTIONS, FREQUENCY), nominal(), 1e-12)


def test_modes_alone_give_a_plain_modal_sum():
    matrices, reading = frame()
    model = matrices.modes(count=60)
    modes = modes_from_shapes(model, reading)
    place = jnp.asarray(PLACES[0])
    assert modes.static_flexibility(place, place) is None
    close(receptance(modes, PLACES, DIRECTIONS, FREQUENCY), nominal(), 0.02)


def test_a_free_structure_is_that_of_a_direct_solution():
    matrices, modes = built(held=False)
    assert modes.rigid_body_modes == 6 and (modes.eigenvalues[:6] == 0).all()
    rows, places, directions = some_rows(matrices, (1, 2, 3), 4)
    expected = direct(matrices, rows, FREQUENCY, modes.eigenvalues.size)
    assert error(receptance(modes, places, directions, FREQUENCY), expected) < 0.005


def test_a_free_structure_moves_as_a_rigid_body_at_low_frequency():
    _, modes = built(held=False)
    mass = np.eye(3) / modes.mass
    assert modes.mass == pytest.approx(BAR.density * BAR.area * _length(), rel=1e-12)
    places, low = PLACES[:1].repeat(3, axis=0), np.array([0.01])
    receptances = receptance(modes, places, np.eye(3), low)[..., 0]
    arm = PLACES[0] - _centre()
    turn = -np.cross(np.eye(3), arm)
    expected = mass + turn.T @ np.linalg.solve(_inertia(), turn)
    close(-((0.02 * np.pi) ** 2) * receptances.real, expected, 1e-3)


def _pieces():
    position, elements = corner()
    ends = position[elements]
    return ends.mean(axis=1), ends[:, 1] - ends[:, 0]


def _length():
    return np.linalg.norm(_pieces()[1], axis=1).sum()


def _centre():
    middle, chord = _pieces()
    return np.average(middle, axis=0, weights=np.linalg.norm(chord, axis=1))


def _inertia():
    """Of thin straight pieces, with the polar inertia of their sections."""
    total = np.zeros((3, 3))
    for middle, chord in zip(*_pieces(), strict=True):
        mass = BAR.density * BAR.area * np.linalg.norm(chord)
        arm = middle - _centre()
        total += mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        total += mass / 12 * (chord @ chord * np.eye(3) - np.outer(chord, chord))
        along = chord / np.linalg.norm(chord)
        total += mass * BAR.radius**2 / 2 * np.outer(along, along)
    return total


def test_the_mass_follows_from_modes_where_no_matrix_tells():
    matrices, reading = frame(held=False)
    modes = modes_from_shapes(matrices.modes(count=40), reading)
    assert modes.mass == pytest.approx(BAR.density * BAR.area * _length(), rel=0.2)


def test_effects_may_sit_in_the_box_or_on_the_pieces():
    modes = built()[1]
    low, high = modes.bounds()
    np.testing.assert_allclose(low, corner()[0].min(axis=0))
    np.testing.assert_allclose(high, corner()[0].max(axis=0))
    regions = modes.anywhere()
    assert len(regions) == 1
    member = bp.positions.Member(corner()[0][0], corner()[0][12])
    matrices, reading = frame()
    piecewise = modes_from_shapes(matrices.modes(count=4), reading, pieces=[member])
    assert len(piecewise.anywhere()) == 1
    assert type(piecewise.anywhere()[0]) is bp.positions.places.OnMember


# Errors.


def test_a_derivative_of_shapes_is_refused():
    with pytest.raises(ValueError, match=r"derivative of order 2.*jax\.jacfwd\(modes\.shapes\)"):
        built()[1].shapes(jnp.asarray(PLACES[0]), 2)


def test_an_interpolation_of_another_model_is_refused():
    matrices, _ = frame()
    longer = bp.finite_elements.interpolation.nearest(matrices)
    small = matrices.modes(count=3).restricted([1, 2, 3])
    with pytest.raises(ValueError, match="reads row 146, but the model has 18 degrees"):
        modes_from_shapes(small, longer)


def test_a_part_that_does_not_exist_is_refused():
    loss = bp.effects.region_stiffness_loss("roof", 0.1)
    with pytest.raises(ValueError, match="region='roof' was given, but the model has none"):
        loss.on(built()[1])
    with pytest.raises(ValueError, match="region=0 was given, but the model has none"):
        dataclasses.replace(loss, region=0).on(built()[1])


# Natural frequencies and modal masses as unknowns.


@functools.cache
def shapes(count=4, held=True):
    matrices, reading = frame(held=held)
    return modes_from_shapes(matrices.modes(count=count), reading)


TRUE = np.array([12.3, 14.1, 47.0, 60.5])
MASS = np.array([0.8, 1.3, 1.1, 0.9])


def test_unknown_modes_are_the_shapes_at_other_frequencies_and_masses():
    modes = UnknownModes(shapes(), frequency=TRUE.tolist(), modal_mass=MASS.tolist())
    place = jnp.asarray(PLACES[1])
    np.testing.assert_allclose(modes.natural_frequency, TRUE, rtol=1e-12)
    np.testing.assert_allclose(
        modes.shapes(place), shapes().shapes(place) / np.sqrt(MASS), rtol=1e-12
    )
    assert modes.static_flexibility(place, place) is None
    assert nodal_of(modes) is shapes() and modes.bounds() == shapes().bounds()
    assert len(modes.anywhere()) == 1


def test_without_modal_masses_shapes_stay_as_they_are():
    modes = UnknownModes(shapes(), frequency=TRUE.tolist())
    place = jnp.asarray(PLACES[1])
    np.testing.assert_array_equal(modes.shapes(place), shapes().shapes(place))


def test_rigid_body_modes_are_known_and_not_counted():
    free = shapes(8, held=False)
    modes = UnknownModes(free, frequency=[50.0, 70.0], modal_mass=[2.0, 3.0])
    np.testing.assert_allclose(modes.natural_frequency, [0] * 6 + [50.0, 70.0])
    place = jnp.asarray(PLACES[1])
    shapes_after, before = np.asarray(modes.shapes(place)), np.asarray(free.shapes(place))
    np.testing.assert_array_equal(shapes_after[:, :6], before[:, :6])
    np.testing.assert_allclose(shapes_after[:, 6:], before[:, 6:] / np.sqrt([2.0, 3.0]))


def test_crossing_frequencies_keep_their_shapes_and_damping():
    """A draw in another order is the same structure counted otherwise."""
    omega = jnp.asarray(2 * np.pi * FREQUENCY)
    points = Points(jnp.asarray(PLACES), DIRECTIONS)
    shapes()  # made before JAX traces, whichever test comes first
    crossed = jax.jit(
        lambda frequency: frf.receptance(
            bp.Structure(_placed(frequency), damping=bp.damping.Modal([0.01, 0.03, 0.02, 0.02])),
            points,
            points,
            omega,
        )
    )
    receptances = np.asarray(crossed(jnp.array([20.0, 14.0, 47.0, 60.0])))
    shape = np.einsum(
        "pa,pam->pm", DIRECTIONS, jax.jit(jax.vmap(shapes().shapes))(jnp.asarray(PLACES))
    )
    natural, ratio = 2 * np.pi * np.array([20.0, 14.0, 47.0, 60.0]), [0.01, 0.03, 0.02, 0.02]
    loss = 2j * (np.array(ratio) * natural)[:, None] * omega
    modal = 1 / (natural[:, None] ** 2 - omega**2 + loss)
    close(receptances, np.einsum("im,jm,mf->ijf", shape, shape, modal), 1e-12)


def _placed(frequency):
    return UnknownModes(shapes(), frequency=[*frequency])


SIGMA = 1e-5


def experiment(frequency, modal_mass):
    matrices, _ = frame()
    nodal = modes_from_shapes(
        matrices.modes(count=4).count(2), bp.finite_elements.interpolation.nearest(matrices)
    )
    modes = UnknownModes(nodal, frequency=frequency, modal_mass=modal_mass)
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.02)),
        sensors=[bp.Sensor("s1", at=PLACES[2])],
        actuators=[bp.Actuator("a1", at=PLACES[1])],
        frequency=np.linspace(8.0, 20.0, 60),
        observe=bp.observe.Complex("displacement"),
        noise=bp.noise.Gaussian(SIGMA),
    )


@pytest.mark.long
@pytest.mark.longest
def test_frequencies_and_masses_are_recovered_from_noisy_data():
    exact = experiment(TRUE[:2].tolist(), MASS[:2].tolist()).nominal_measurement()
    normal = np.random.default_rng(6).normal(size=(2, *exact.frf.shape))
    measured = dataclasses.replace(exact, frf=exact.frf + SIGMA * (normal[0] + 1j * normal[1]))
    assert np.abs(exact.frf).max() > 10 * SIGMA
    frequency, mass = dist.Uniform(0.98 * TRUE[0], 1.03 * TRUE[0]), dist.LogNormal(0.0, 0.3)
    unknown = experiment([frequency, TRUE[1]], [MASS[0], mass])
    engine = bp.engines.MAP(starts=2, draws=200)
    result = bp.infer(unknown, measured, engine=engine, key=2)
    draws = result["posterior"].to_dataset()
    for name, value, sharp in (("frequency.1", TRUE[0], 1e-3), ("modal_mass.2", MASS[1], 0.03)):
        samples = draws[f"structure.modes.{name}"]
        mean, deviation = float(samples.mean()), float(samples.std())
        assert abs(mean - value) < 4 * deviation and 0 < deviation < sharp * value, name


@pytest.mark.parametrize(
    ("frequency", "modal_mass", "message"),
    [
        ([1.0, 2.0, 3.0], None, "3 natural frequencies and 4 modal masses for 4 elastic"),
        ([1.0, 2.0, 3.0, 4.0], [1.0], "4 natural frequencies and 1 modal masses"),
        ([1.0, 3.0, 2.0, 4.0], None, "mode 2 at 3 Hz and mode 3 at 2 Hz; means that ascend"),
        ([1.0, dist.Uniform(2, 9), 3.0, 4.0], None, r"mode 2 at 5\.5 Hz"),
    ],
)
def test_frequencies_that_do_not_fit_the_shapes_are_refused(frequency, modal_mass, message):
    with pytest.raises(ValueError, match=message):
        UnknownModes(shapes(), frequency=frequency, modal_mass=modal_mass)
