"""Every effect compared with an independent finite element simulation of it."""

import dataclasses
import functools

import numpy as np
import pytest

from bayes_placement import (
    Actuator,
    Experiment,
    Sensor,
    Structure,
    beams,
    damping,
    effects,
    observe,
)
from bayes_placement._shared.compiled import compiled
from tests.simulator import fine_elements, hidden_structures
from tests.simulator.fine_elements import NOTHING, Line, effect
from tests.simulator.hidden_structures import Instrument

BAR = Line("bar", "fixed-fixed", 1.0, 1e-3, 1e9, 9000.0, 0.02)
BEAM = Line("beam", "fixed-free", 0.6, 1.8e-4, 70e9, 2700.0, 0.01, 5.4e-10)
PINNED = dataclasses.replace(BEAM, ends="fixed-pinned")
MASS = BEAM.mass
BENDING = BEAM.rigidity
# Poisson's ratio .3 and a shear coefficient of 5/6: E / (k G) = 2 (1 + nu) / k.
SHEAR = effect("shear_and_rotary_inertia", shear_correction=5 / 6, poisson_ratio=0.3)
DEEP = dataclasses.replace(BEAM, area=3e-4, second_moment=3e-4 * 0.012**2 / 12)

# Line, what the simulation hides, and the effect that should say the same.
CASES = {
    "nothing, bar": (BAR, NOTHING, []),
    "nothing, beam": (BEAM, NOTHING, []),
    "point_mass, bar": (
        BAR,
        effect("point_mass", at=0.31, mass=1.0),
        [effects.point_mass(0.31, 1.0)],
    ),
    "point_mass": (
        BEAM,
        effect("point_mass", at=0.21, mass=0.3 * MASS),
        [effects.point_mass(0.21, 0.3 * MASS)],
    ),
    "ground_spring": (
        BEAM,
        effect("ground_spring", at=0.21, stiffness=2e4),
        [effects.ground_spring(0.21, 2e4)],
    ),
    "ground_dashpot": (
        BEAM,
        effect("ground_dashpot", at=0.21, viscosity=5.0),
        [effects.ground_dashpot(0.21, 5.0)],
    ),
    "tuned_absorber": (
        BEAM,
        effect("tuned_absorber", at=0.5, mass=0.05, frequency=90.0, damping_ratio=0.04),
        [effects.tuned_absorber(0.5, 0.05, 90.0, 0.04)],
    ),
    "local_stiffness_loss": (
        BEAM,
        effect("local_stiffness_loss", at=0.21, extent=0.015, share=0.5),
        [effects.local_stiffness_loss(0.21, 0.015, 0.5)],
    ),
    "local_stiffness_loss, held at both ends": (
        PINNED,
        effect("local_stiffness_loss", at=0.21, extent=0.015, share=0.5),
        [effects.local_stiffness_loss(0.21, 0.015, 0.5)],
    ),
    "local_stiffness_loss, bar": (
        BAR,
        effect("local_stiffness_loss", at=0.31, extent=0.02, share=0.5),
        [effects.local_stiffness_loss(0.31, 0.02, 0.5)],
    ),
    "hysteretic_damping": (
        BEAM,
        effect("hysteretic_damping", loss_factor=0.03),
        [effects.hysteretic_damping(0.03)],
    ),
    "viscoelastic_modulus": (
        BEAM,
        effect("viscoelastic_modulus", relaxing=0.2, relaxation_time=1e-3),
        [effects.viscoelastic_modulus(0.2, 1e-3)],
    ),
    "modulus": (
        BEAM,
        effect("viscoelastic_modulus", relaxing=0.2, relaxation_time=1e-3),
        [effects.modulus(effects.Spring(0.2) - effects.Dashpot(2e-4))],
    ),
    "compliant_support": (
        BEAM,
        effect("compliant_support", end="left", compliance=0.1 * 0.6 / BENDING),
        [effects.compliant_support(0.1 * 0.6 / BENDING)],
    ),
    "compliant_support, bar": (
        BAR,
        effect("compliant_support", end="right", compliance=5e-8),
        [effects.compliant_support(5e-8, end="right", motion="translation")],
    ),
    "axial_preload": (
        PINNED,
        effect("axial_preload", tension=500.0),
        [effects.axial_preload(500.0)],
    ),
    "axial_preload, compression": (
        PINNED,
        effect("axial_preload", tension=-300.0),
        [effects.axial_preload(-300.0)],
    ),
    "shear_and_rotary_inertia": (
        DEEP,
        SHEAR,
        [effects.shear_and_rotary_inertia(2.6 / (5 / 6))],
    ),
    "sensor_mass, roving": (
        BEAM,
        effect("sensor_mass", mass=0.02, roving=True),
        [effects.sensor_mass(0.02)],
    ),
    "sensor_mass, fixed": (
        BEAM,
        effect("sensor_mass", mass=0.02, roving=False),
        [effects.sensor_mass(0.02)],
    ),
    "time_delay": (BEAM, effect("time_delay", delay=3e-4), [effects.time_delay(3e-4)]),
    "gain_error": (
        BEAM,
        effect("gain_error", sensor="s2", error=-0.3),
        [effects.gain_error("s2", -0.3)],
    ),
    "mount_resonance": (
        BEAM,
        effect("mount_resonance", sensor="s1", frequency=700.0, damping_ratio=0.05),
        [effects.mount_resonance("s1", 700.0, 0.05)],
    ),
    "misplaced_sensor": (
        BEAM,
        effect("misplaced_sensor", sensor="s2", position=0.15),
        [effects.misplaced_sensor("s2", 0.15 - 0.33)],
    ),
}


def seats(line):
    sign = 1 if line.kind == "bar" else 3
    sensors = [("s1", 0.12, sign), ("s2", 0.33, -sign), ("s3", 0.58, sign)]
    actuators = [("a1", 0.43, sign), ("a2", 0.26, -sign)]
    return [[Instrument(n, x, 0.01, d, x) for n, x, d in side] for side in (sensors, actuators)]


@functools.cache
def band(line):
    """From below the first to above the fifth mode [Hz]."""
    natural = fine_elements.plant(line).natural / (2 * np.pi)
    return np.geomspace(0.4 * natural[0], np.sqrt(natural[4] * natural[5]), 150)


def modelled(line, additions, **settings):
    quantities = {"length": line.length, "area": line.area, "density": line.density}
    quantities["youngs_modulus"] = line.youngs_modulus
    if line.kind == "beam":
        quantities["second_moment"] = line.second_moment
    modes = getattr(beams, line.kind)(
        {"bar": 160, "beam": 30}[line.kind], **quantities, ends=line.ends
    )
    sides = [
        [kind(seat.name, at=seat.true, directions=(seat.direction,)) for seat in side]
        for kind, side in zip((Sensor, Actuator), seats(line), strict=True)
    ]
    experiment = Experiment(
        Structure(modes, damping=damping.Modal(line.damping_ratio)),
        sensors=sides[0],
        actuators=sides[1],
        frequency=band(line),
        observe=observe.Complex("acceleration"),
        noise=None,
        **settings,
    )
    for addition in additions:
        experiment = experiment + addition
    return np.asarray(compiled(Experiment.frf)(experiment))


def close(response, expected, tolerance=1e-3):
    size = np.sqrt(np.mean(np.abs(expected) ** 2, axis=-1, keepdims=True))
    np.testing.assert_array_less(np.abs(response - expected) / size, tolerance)


def is_variant(name):
    """Whether another case has the same effect."""
    return ", " in name and name != "sensor_mass, roving"


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.long] * is_variant(name)) for name in CASES]
)
def test_the_response_is_that_of_finite_elements(name):
    line, hidden, additions = CASES[name]
    fine = hidden_structures.accelerance(line, *seats(line), band(line), hidden)
    mounted = "fixed" if name == "sensor_mass, fixed" else "roving"
    response = modelled(line, additions, sensors_mounted=mounted)
    tolerance = TOLERANCES.get(name, 1e-3)
    close(response, fine, tolerance)
    if additions:
        plain = hidden_structures.accelerance(line, *seats(line), band(line))
        size = np.sqrt(np.mean(np.abs(fine) ** 2, axis=-1, keepdims=True))
        assert (np.abs(plain - fine) / size).max() > 50 * tolerance  # the effect is felt


TOLERANCES = {
    # Shear deflection of the modes left out is not in the static flexibility.
    "shear_and_rotary_inertia": 3e-3,
    # Two hinges move the mass between them a little otherwise than a stretch does.
    "local_stiffness_loss, bar": 5e-3,
}


def test_a_cubic_spring_is_that_of_harmonic_balance_at_every_level():
    levels, hidden = [0.02, 0.5, 2.0], effect("cubic_stiffness", at=0.21, stiffness=1e7)
    fine = [
        hidden_structures.accelerance(BEAM, *seats(BEAM), band(BEAM), hidden, level)
        for level in levels
    ]
    response = modelled(BEAM, [effects.cubic_stiffness(0.21, 1e7)], force_levels=levels)
    close(response, np.stack(fine, axis=2))
    assert np.abs(fine[2] / fine[0] - 1).max() > 0.1
