"""transducers: what a sensor reads where it sits and as it is rolled, and where it may sit."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from numpyro import handlers

from bayes_placement import Actuator, Sensor, beams, supports
from bayes_placement._sites import realise, unknowns
from bayes_placement.measurement import Channel
from bayes_placement.modes import Modes

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
    found = Sensor("s1", at=1.0, directions=(-3, 1, 2)).on(InSpace()).shapes(InSpace())
    np.testing.assert_allclose(found, 2 * np.array([[-3.0, -5.0], [1.0, 2.0], [0.0, 0.0]]))


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
    sensor = Sensor("s1", at=supports.Segment(0.7, within=0.05), angles=angles).on(BEAM)
    named = [(one.name, one.unit) for one in unknowns(sensor)]
    assert named == [("position", "m"), ("angles.2", "rad")]
    with handlers.seed(rng_seed=4):
        real = realise(sensor)
    assert 0.65 < real.position < 0.75
    expected = BEAM.shapes(real.position) * jnp.cos(real.angles[1])
    np.testing.assert_allclose(real.shapes(BEAM), expected, rtol=1e-12)


def test_a_segment_becomes_a_uniform_law_on_the_structure():
    law = Actuator("a1", at=supports.Segment(1.19, within=0.05)).on(BEAM).position
    np.testing.assert_allclose([law.low, law.high], [1.14, 1.2])


@pytest.mark.parametrize(
    ("at", "given", "recorded"),
    [
        (0.3, None, 0.3),
        (supports.Segment(1.19, within=0.05), None, 1.19),
        (dist.Uniform(0.2, 0.6), None, 0.4),
        (dist.Uniform(0.2, 0.6), 0.25, 0.25),
        (supports.Segment(0.3, within=0.1), 0.35, 0.35),
    ],
)
def test_the_record_is_kept_on_the_structure(at, given, recorded):
    np.testing.assert_allclose(Sensor("s1", at=at, recorded=given).on(BEAM).recorded, recorded)


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
        kind("t1", at=supports.Segment(1.3, within=0.04)).on(BEAM)


@pytest.mark.parametrize("directions", [(0,), (4,), (1, -7)])
def test_a_direction_that_is_none_is_refused(directions):
    with pytest.raises(ValueError, match=r'Sensor "s1": directions=.* each must be one of \+-1'):
        Sensor("s1", at=0.3, directions=directions)


def test_angles_come_in_threes():
    with pytest.raises(ValueError, match=r'Sensor "s1": 2 angles were given; three Euler angles'):
        Sensor("s1", at=0.3, angles=(0.0, 0.1))
