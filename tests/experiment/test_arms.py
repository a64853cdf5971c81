"""Transducers beside the axis of a beam, whose force brings a moment: against a fine mesh."""

import jax
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from tests.simulator import fine_beams
from tests.simulator.fine_beams import outer, row

BEAM = {
    "length": fine_beams.LENGTH,
    "area": fine_beams.AREA,
    "second_moment": fine_beams.MOMENT,
    "youngs_modulus": fine_beams.STIFFNESS,
    "density": fine_beams.DENSITY,
}
LINES = np.array([6.3, 40.0, 111.0, 302.0, 801.0])
AT, ARM = 0.31, 0.03
MASS = 0.05


def experiment(sensors, actuators, *additions, **settings):
    structure = bp.Structure(bp.beams.beam(60, **BEAM), damping=bp.damping.Modal(1e-13))
    base = bp.Experiment(
        structure,
        sensors=[bp.Sensor(f"s{at}".replace(".", "_"), at, arm=arm) for at, arm in sensors],
        actuators=[bp.Actuator(f"a{at}".replace(".", "_"), at, arm=arm) for at, arm in actuators],
        frequency=LINES,
        observe=bp.observe.Complex("displacement"),
        noise=None,
        **settings,
    )
    for effect in additions:
        base = base + effect
    return base


def frf(*arguments, **settings):
    return np.asarray(jax.jit(lambda: experiment(*arguments, **settings).frf())())


def mesh(places, added=lambda omega: 0.0):
    return fine_beams.receptance(places, 2 * np.pi * LINES, added)


@pytest.mark.parametrize("arm", [ARM, -0.2])
def test_a_force_beside_its_place_brings_a_moment(arm):
    expected = mesh([(0.18, 0.0), (0.57, 0.0), (AT, arm)])[:2, 2:]
    ours = frf([(0.18, 0.0), (0.57, 0.0)], [(AT, arm)])
    np.testing.assert_allclose(ours, expected, atol=1e-6 * np.abs(expected).max())


def test_a_moment_also_turns_what_is_attached():
    inertia = bp.effects.rotary_inertia(0.28, 2e-4)
    turned = row(0.28, slope=True)
    expected = mesh([(0.18, 0.0), (AT, ARM)], lambda w: -(w**2) * 2e-4 * outer(turned))
    ours = frf([(0.18, 0.0)], [(AT, ARM)], inertia)
    np.testing.assert_allclose(ours[0, 0], expected[0, 1], rtol=1e-6)


def test_what_a_moment_moves_turns_under_a_force():
    there = frf([(0.18, 0.0)], [(AT, ARM)])
    back = frf([(AT, ARM)], [(0.18, 0.0)])
    np.testing.assert_allclose(there, back, rtol=1e-12)


@pytest.mark.parametrize("mounted", ["roving", "fixed"])
def test_a_mass_of_the_sensor_is_at_its_foot(mounted):
    foot = row(AT)
    expected = mesh([(AT, ARM), (0.18, 0.0)], lambda w: -(w**2) * MASS * outer(foot))
    load = bp.effects.sensor_mass(MASS)
    ours = frf([(AT, ARM)], [(0.18, 0.0)], load, sensors_mounted=mounted)
    np.testing.assert_allclose(ours[0, 0], expected[0, 1], rtol=1e-6)


def test_each_of_several_exciters_is_mounted_at_its_own_foot():
    actuators, load = [(0.18, 0.0), (AT, ARM)], bp.effects.actuator_mass(MASS)
    ours = frf([(0.57, 0.0)], actuators, load)
    for column, (at, arm) in enumerate(actuators):
        foot = row(at)
        expected = mesh([(0.57, 0.0), (at, arm)], lambda w, f=foot: -(w**2) * MASS * outer(f))
        np.testing.assert_allclose(ours[0, column], expected[0, 1], rtol=1e-6)


def test_without_an_arm_nothing_changes():
    plain = experiment([(0.18, 0.0)], [(AT, 0.0)]).actuator["a0_31"]
    assert bp.Actuator("a1", AT, arm=0.0).arm is None
    assert bp.Actuator("a1", AT, arm=1e-3).arm == 1e-3
    assert plain.points((3,)).combination is None


def test_an_unknown_arm_is_one_of_the_placement():
    unsure = experiment([(0.18, 0.0)], [(AT, dist.Normal(0.0, 0.01))])
    unknown = unsure.unknown["actuator.a0_31.arm"]
    assert (unknown.unit, unknown.is_of_transducer) == ("m", True)
    response = jax.jit(lambda arm: unsure.fix({"actuator.a0_31.arm": arm}).frf().real)
    slope = (response(ARM + 1e-4) - response(ARM - 1e-4)) / 2e-4
    np.testing.assert_allclose(jax.jit(jax.jacfwd(response))(ARM), slope, rtol=1e-6)
    assert float(np.abs(slope).max()) > 0


def test_an_arm_needs_a_beam():
    bar = bp.beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    structure = bp.Structure(bar, damping=bp.damping.Modal(0.01))
    with pytest.raises(
        InputError, match="an arm was given on UniformBar; a uniform beam is needed"
    ):
        bp.Actuator("a1", AT, arm=ARM).on(structure.modes)
