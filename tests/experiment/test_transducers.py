"""Transducers: shapes read at a position and orientation, and tolerances of the position."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from numpyro import handlers
from scipy.spatial.transform import Rotation

import bayes_placement as bp
from bayes_placement import Actuator, Sensor, beams, positions
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.sites import realise, substitute, unknowns
from bayes_placement.experiment.measurement import Channel
from bayes_placement.modes.modes import Modes
from bayes_placement.positions import places
from tests import in_space

BEAM = beams.beam(4, length=1.2, area=1e-3, second_moment=1e-8, youngs_modulus=7e10, density=2700.0)


class InSpace(Modes):
    """Two modes that move along x and z but not along y, unlike each other."""

    axes: tuple[int, ...] = eqx.field(static=True, default=(1, 3))
    rigid_body_modes: int = eqx.field(static=True, default=0)

    def angular_frequency(self):
        return jnp.array([10.0, 20.0])

    def shapes(self, position, derivative=0):
        return jnp.array([[1.0, 2.0], [3.0, 5.0]]) * (1 + position)

    def static_flexibility(self, position, other):
        return None

    def bounds(self):
        return 0.0, 1.0


def test_a_sensor_reads_the_shapes_where_it_sits():
    sensor = Sensor("s1", at=0.7).on(BEAM)
    np.testing.assert_allclose(sensor.shapes(BEAM), BEAM.shapes(jnp.asarray(0.7)), rtol=1e-14)


def test_a_sensor_without_directions_reads_along_the_motion():
    assert Sensor("s1", at=0.7).on(BEAM).directions == (3,)
    assert Sensor("s1", at=0.7).on(InSpace()).directions == (1, 3)
    assert Sensor("s1", at=0.7, directions=(-3,)).on(BEAM).directions == (-3,)


def test_recorded_directions_pick_axes_with_their_sign():
    shapes = Sensor("s1", at=1.0, directions=(-3, 1, 2)).on(InSpace()).shapes(InSpace())
    np.testing.assert_allclose(shapes, 2 * np.array([[-3.0, -5.0], [1.0, 2.0], [0.0, 0.0]]))


@pytest.mark.parametrize(
    ("directions", "angles", "expected"),
    [
        # z turned about y leans towards +x; x turned about y leans towards -z.
        ((3,), (0.0, 0.3, 0.0), [[np.sin(0.3), np.cos(0.3)]]),
        ((1,), (0.0, 0.3, 0.0), [[np.cos(0.3), -np.sin(0.3)]]),
        ((3,), (0.3, 0.0, 0.0), [[0.0, np.cos(0.3)]]),
        ((-2,), (0.3, 0.0, 0.0), [[0.0, -np.sin(0.3)]]),
        ((1, 3), (0.0, 0.0, 0.3), [[np.cos(0.3), 0.0], [0.0, 1.0]]),
        ((2,), (0.0, 0.0, 0.3), [[-np.sin(0.3), 0.0]]),
    ],
)
def test_a_rolled_sensor_reads_along_its_true_axes(directions, angles, expected):
    sensor = Sensor("s1", at=0.0, directions=directions, angles=angles).on(InSpace())
    xz = np.array([[1.0, 2.0], [3.0, 5.0]])
    np.testing.assert_allclose(sensor.shapes(InSpace()), np.array(expected) @ xz, atol=1e-14)


def test_angles_have_gradients():
    def read(angle):
        angles = (0.0, angle, 0.0)
        return Sensor("s1", at=0.0, directions=(3,), angles=angles).shapes(InSpace())[0, 0]

    slope = jax.jit(jax.grad(read))(0.3)
    np.testing.assert_allclose(slope, np.cos(0.3) * 1.0 - np.sin(0.3) * 3.0, rtol=1e-12)


def test_unknown_places_and_angles_are_named_and_sampled():
    angles = (0.0, dist.Uniform(-0.2, 0.2), 0.0)
    sensor = Sensor("s1", at=positions.Segment(0.7, within=0.05), angles=angles).on(BEAM)
    named = [(unknown.name, unknown.unit) for unknown in unknowns(sensor)]
    assert named == [("position", "m"), ("angles.2", "rad")]
    with handlers.seed(rng_seed=4):
        real = realise(sensor)
    assert 0.65 < real.position < 0.75
    expected = BEAM.shapes(real.position) * jnp.cos(real.angles[1])
    np.testing.assert_allclose(real.shapes(BEAM), expected, rtol=1e-12)


def test_a_segment_becomes_a_uniform_distribution_on_the_structure():
    position = Actuator("a1", at=positions.Segment(1.19, within=0.05)).on(BEAM).position
    np.testing.assert_allclose([position.low, position.high], [1.14, 1.2])


@pytest.mark.parametrize(
    ("at", "stated", "recorded"),
    [
        (0.3, None, 0.3),
        (positions.Segment(1.19, within=0.05), None, 1.19),
        (dist.Uniform(0.2, 0.6), None, 0.4),
        (dist.Uniform(0.2, 0.6), 0.25, 0.25),
        (positions.Segment(0.3, within=0.1), 0.35, 0.35),
    ],
)
def test_the_record_is_kept_on_the_structure(at, stated, recorded):
    np.testing.assert_allclose(Sensor("s1", at=at, recorded=stated).on(BEAM).recorded, recorded)


def test_channels_are_labelled_by_name_and_direction():
    sensor = Sensor("tip", at=0.7, directions=(1, -3))
    assert sensor.channels == (Channel("tip", 1), Channel("tip", -3))


@pytest.mark.parametrize(("kind", "word"), [(Sensor, "Sensor"), (Actuator, "Actuator")])
def test_a_place_outside_the_structure_is_refused(kind, word):
    message = rf'{word} "t1": position 1.25 m lies outside the structure \(0 to 1.2 m\)'
    with pytest.raises(ValueError, match=message):
        kind("t1", at=1.25).on(BEAM)
    message = rf'{word} "t1": Segment\(1.3, within=0.04\) m has no point on the structure'
    with pytest.raises(ValueError, match=message):
        kind("t1", at=positions.Segment(1.3, within=0.04)).on(BEAM)


@pytest.mark.parametrize("directions", [(0,), (4,), (1, -7)])
def test_a_direction_that_is_none_is_refused(directions):
    with pytest.raises(ValueError, match=r'Sensor "s1": directions=.* each must be one of \+-1'):
        Sensor("s1", at=0.3, directions=directions)


def test_angles_come_in_threes():
    with pytest.raises(ValueError, match=r'Sensor "s1": 2 angles were given; three Euler angles'):
        Sensor("s1", at=0.3, angles=(0.0, 0.1))


PLACE = (0.7, 0.2, 0.4)
ANGLES = (0.3, -0.2, 0.15)
RECORDED = np.eye(3)


def read_along(directions, angles=(0.0, 0.0, 0.0)):
    """Shapes that channels see at PLACE, by SciPy's rotation and nothing of the package."""
    turned = Rotation.from_euler("XYZ", angles).as_matrix()
    signs = np.sign(directions)[:, None]
    true = signs * np.stack([turned @ RECORDED[abs(direction) - 1] for direction in directions])
    return true @ in_space.shapes(PLACE)


@pytest.mark.parametrize("kind", [Sensor, Actuator])
@pytest.mark.parametrize("directions", [(1, 2, 3), (-3,), (2,), (3, -1, -2)])
def test_a_rolled_transducer_in_space_sees_along_its_true_axes(kind, directions):
    modes = in_space.Linear()
    transducer = kind("t1", at=PLACE, directions=directions, angles=ANGLES).on(modes)
    shapes = jax.jit(lambda: transducer.shapes(modes))()
    np.testing.assert_allclose(shapes, read_along(directions, ANGLES), rtol=1e-12)
    assert not np.allclose(shapes, read_along(directions), atol=0.01)


@pytest.mark.parametrize("kind", [Sensor, Actuator])
@pytest.mark.parametrize("directions", [(1, 2, 3), (-3,), (1,), (-2, 3)])
def test_on_a_structure_that_moves_along_z_only_z_is_seen(kind, directions):
    modes = in_space.Linear(axes=(3,))
    transducer = kind("t1", at=PLACE, directions=directions, angles=ANGLES).on(modes)
    turned = Rotation.from_euler("XYZ", ANGLES).as_matrix()
    shares = [np.sign(signed) * turned[2, abs(signed) - 1] for signed in directions]
    expected = np.outer(shares, in_space.shapes(PLACE)[2])
    np.testing.assert_allclose(jax.jit(lambda: transducer.shapes(modes))(), expected, rtol=1e-12)


def experiment_in_space(sensor, actuator):
    return bp.Experiment(
        bp.Structure(in_space.Linear(), damping=bp.damping.Modal([0.02, 0.05, 0.03])),
        sensors=[sensor],
        actuators=[actuator],
        frequency=[30.0, 65.0, 100.0],
        observe=bp.observe.Complex("displacement"),
        noise=bp.noise.Gaussian(0.01),
    )


def test_the_receptance_between_rolled_transducers_is_that_of_the_turned_axes():
    experiment = experiment_in_space(
        Sensor("s1", at=PLACE, directions=(1, -2, 3), angles=ANGLES),
        Actuator("a1", at=(0.1, 0.6, 0.3), directions=(-3,), angles=(-0.1, 0.25, 0.4)),
    )
    receptance = compiled(bp.Experiment.receptance)(experiment)
    pushed = Rotation.from_euler("XYZ", (-0.1, 0.25, 0.4)).apply([0.0, 0.0, -1.0])
    driven = pushed @ in_space.shapes((0.1, 0.6, 0.3))
    omega = 2 * np.pi * np.array([30.0, 65.0, 100.0])
    natural = 2 * np.pi * np.array([40.0, 70.0, 110.0])[:, None]
    ratio = np.array([0.02, 0.05, 0.03])[:, None]
    modal = 1 / (natural**2 - omega**2 + 2j * ratio * natural * omega)
    expected = (read_along((1, -2, 3), ANGLES) * driven) @ modal
    np.testing.assert_allclose(receptance[:, 0], expected, rtol=1e-10)


def test_three_numbers_or_distributions_are_a_position():
    sensor = Sensor("s1", at=(0.7, dist.Uniform(0.1, 0.4), 0.4)).on(in_space.Linear())
    assert [(unknown.name, unknown.unit) for unknown in unknowns(sensor)] == [("position.y", "m")]
    assert sensor.recorded == (0.7, 0.25, 0.4)
    assert sensor.directions == (1, 2, 3)
    exact = Sensor("s1", at=np.array(PLACE)).on(in_space.Linear())
    np.testing.assert_allclose(places.coordinates(exact.position), PLACE)
    assert exact.recorded == PLACE


def test_a_distribution_of_three_coordinates_is_a_position():
    position = dist.Normal(jnp.array(PLACE), 0.01).to_event(1)
    experiment = experiment_in_space(Sensor("s1", at=position), Actuator("a1", at=(0.1, 0.6, 0.3)))
    assert experiment.sensor["s1"].recorded == PLACE
    nominal = experiment.nominal().sensor["s1"]
    np.testing.assert_allclose(places.coordinates(nominal.position), PLACE)


CENTRE = (0.7, 0.2, 0.4)
MESH = np.stack(np.meshgrid([0.6, 0.7, 0.8], [0.1, 0.3], [0.4, 0.6]), axis=-1).reshape(-1, 3)
TOLERANCES = [
    (positions.Box(CENTRE, within=(0.1, 0.05, 0.0)), ["x", "y"], CENTRE),
    (
        positions.Member((0.7, 0.2, 0.0), (0.7, 0.2, 0.6), centre=(0.71, 0.2, 0.4), within=0.1),
        ["along"],
        CENTRE,
    ),
    (
        positions.Patch(CENTRE, (1, 0, 0), (0, 1, 1), within=(0.1, 0.05)),
        ["first", "second"],
        CENTRE,
    ),
    (positions.Ball(CENTRE, 0.1), ["share.1", "share.2", "share.3"], CENTRE),
    (positions.Nodes(MESH, positions.Ball((0.69, 0.27, 0.5), 0.2)), ["node"], (0.7, 0.3, 0.4)),
]


@pytest.mark.parametrize(
    ("tolerance", "names", "place"), TOLERANCES, ids=lambda unknown: type(unknown).__name__
)
def test_the_nominal_transducer_sits_where_it_was_recorded(tolerance, names, place):
    moved = tolerance.recorded if isinstance(tolerance, positions.Nodes) else None
    sensor = Sensor("s1", at=tolerance, directions=(3,), recorded=None if moved is None else place)
    experiment = experiment_in_space(sensor, Actuator("a1", at=tolerance, directions=(1,)))
    names_of_unknowns = {unknown.name for unknown in experiment.unknowns}
    sides = ("sensor.s1", "actuator.a1")
    assert names_of_unknowns == {f"{side}.position.{name}" for side in sides for name in names}
    position = jax.jit(lambda: places.coordinates(experiment.nominal().sensor["s1"].position))()
    np.testing.assert_allclose(position, place, atol=1e-9)


def test_a_record_outside_the_clipped_tolerance_goes_to_its_edge():
    tolerance = positions.Box((1.02, 0.2, 0.4), within=(0.04, 0.0, 0.0))
    experiment = experiment_in_space(
        Sensor("s1", at=tolerance), Actuator("a1", at=PLACE, recorded=(0.8, 0.2, 0.4))
    )
    nominal = experiment.nominal()
    np.testing.assert_allclose(places.coordinates(nominal.sensor["s1"].position), (1.0, 0.2, 0.4))
    assert nominal.actuator["a1"].recorded == (0.8, 0.2, 0.4)


@pytest.mark.long
def test_every_tolerance_has_finite_gradients_of_the_response():
    for tolerance, names, _ in TOLERANCES[:4]:
        experiment = experiment_in_space(
            Sensor("s1", at=tolerance, directions=(3,)), Actuator("a1", at=PLACE, directions=(1,))
        )
        priors = {unknown.name: unknown.distribution for unknown in experiment.unknowns}
        assert len(priors) == len(names)

        def size(values, experiment=experiment):
            return jnp.sum(jnp.abs(substitute(experiment, values).receptance()) ** 2)

        middle = {
            name: prior.low + 0.3 * (prior.high - prior.low) for name, prior in priors.items()
        }
        slope = jax.jit(jax.grad(size))(middle)
        step = 1e-6
        value = jax.jit(size)
        for name, at in middle.items():
            up, down = (value({**middle, name: at + sign * step}) for sign in (1, -1))
            np.testing.assert_allclose(slope[name], (up - down) / (2 * step), rtol=1e-5)


WRONG_PLACES = [
    (0.3, in_space.Linear(), r"position 0.3 was given, but the structure lies in space"),
    (
        dist.Uniform(0, 1),
        in_space.Linear(),
        r"position Uniform.* was given, but the structure lies",
    ),
    (
        positions.Segment(0.3, within=0.1),
        in_space.Linear(),
        r"Segment\(0.3, within=0.1\) was given",
    ),
    (PLACE, BEAM, r"position \(0.7, 0.2, 0.4\) was given, but the structure is a line"),
    (positions.Ball(PLACE, 0.1), BEAM, r"Ball.* was given, but the structure is a line"),
    ((0.7, 0.9, 0.4), in_space.Linear(), r"position \(0.7, 0.9, 0.4\) m lies outside the struct"),
    (
        (dist.Uniform(0, 1), -0.1, 0.4),
        in_space.Linear(),
        r"position \(Uniform.*, -0.1, 0.4\) m lies outside the structure \(\(0, 0, 0\) to \(1",
    ),
]


@pytest.mark.parametrize(("at", "modes", "words"), WRONG_PLACES)
def test_a_place_that_does_not_fit_the_structure_is_refused(at, modes, words):
    with pytest.raises(ValueError, match='Actuator "a1": ' + words):
        Actuator("a1", at=at).on(modes)


def test_two_coordinates_are_no_place():
    with pytest.raises(ValueError, match=r"A position of 2 coordinates was given; .* at=\(0.2,"):
        Sensor("s1", at=(0.1, 0.2))


def test_effects_have_the_same_tolerances():
    structure = experiment_in_space(Sensor("s1", at=PLACE), Actuator("a1", at=PLACE)).structure
    for tolerance, names, _ in TOLERANCES:
        changed = structure + bp.effects.point_mass(at=tolerance, mass=0.1)
        names_of_unknowns = [unknown.name for unknown in unknowns(changed)]
        assert names_of_unknowns == [f"effects.point_mass.at.{name}" for name in names]
    for at in (PLACE, places.Cartesian(*PLACE)):
        changed = structure + bp.effects.point_mass(at=at, mass=dist.Uniform(0.0, 1.0))
        assert [unknown.name for unknown in unknowns(changed)] == ["effects.point_mass.mass"]
        points = changed.effects["point_mass"].points(structure.modes)
        np.testing.assert_allclose(points.position, [PLACE] * 3)
    with pytest.raises(ValueError, match=r'Effect "point_mass": place 0.3 was given, but'):
        structure + bp.effects.point_mass(at=0.3, mass=0.1)
    with pytest.raises(ValueError, match=r'"point_mass": place \(2, 0.2, 0.4\) m lies outside'):
        structure + bp.effects.point_mass(at=(2, 0.2, 0.4), mass=0.1)


def test_an_effect_at_nodes_has_a_typical_node():
    tolerance = positions.Nodes(MESH, positions.Box((0.7, 0.3, 0.4), within=(0.06, 0.0, 0.0)))
    experiment = experiment_in_space(Sensor("s1", at=PLACE), Actuator("a1", at=PLACE))
    changed = (experiment + bp.effects.point_mass(at=tolerance, mass=0.1)).nominal()
    points = changed.structure.effects["point_mass"].points(changed.structure.modes)
    np.testing.assert_allclose(points.position, [(0.7, 0.3, 0.4)] * 3)


@pytest.mark.parametrize("name", ["", "s.1"])
def test_a_name_that_cannot_be_a_word_of_a_name_of_an_unknown_is_refused(name):
    with pytest.raises(ValueError, match=f"Sensor of the name {name!r} was given; a name without"):
        bp.Sensor(name, at=0.25)
    with pytest.raises(ValueError, match=f"Actuator of the name {name!r} was given"):
        bp.Actuator(name, at=0.25)
