"""Effects on every kind of port against a fine mesh that this package did not make."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.optimize

from bayes_placement import Structure, beams, damping, effects
from bayes_placement._shared.errors import InputError
from bayes_placement.effects import Dashpot, LossySpring, Mass, Spring
from bayes_placement.experiment.frf import receptance
from bayes_placement.modes.points import Points
from tests.criticism.reach import cantilever
from tests.simulator import fine_beams
from tests.simulator.fine_beams import BENDING, HEAVY, LENGTH, PER_LENGTH, STIFF, outer, row, spread

BEAM = {
    "length": LENGTH,
    "area": fine_beams.AREA,
    "second_moment": fine_beams.MOMENT,
    "youngs_modulus": fine_beams.STIFFNESS,
    "density": fine_beams.DENSITY,
}
PLACES = np.array([0.18, 0.31, 0.4, 0.57])
OMEGA = 2 * np.pi * np.array([6.3, 40.0, 111.0, 302.0, 801.0, 1100.0])
AT, TO = 0.28, 0.49
START, END = 0.2, 0.44
MIDDLE, EXTENT = (START + END) / 2, END - START
FURTHER = [pytest.mark.long, pytest.mark.longest]

slope = functools.partial(row, AT, slope=True)


def structure(*additions, ends="fixed-free", modes=60):
    base = Structure(beams.beam(modes, **BEAM, ends=ends), damping=damping.Modal(1e-13))
    for effect in additions:
        base = base + effect
    return base


def response(*additions, **settings):
    base = structure(*additions, **settings)
    points = Points(jnp.asarray(PLACES), np.ones((len(PLACES), 1)))
    return np.asarray(jax.jit(lambda w: receptance(base, points, points, w))(jnp.asarray(OMEGA)))


def body(omega, mass=0.2, radius=0.02, offset=0.015):
    deflection = row(AT) + offset * slope()
    return -(omega**2) * mass * (outer(deflection) + radius**2 * outer(slope()))


def maxwell(omega):
    return 1 / (1 / 2e4 + 1 / (40j * omega))


ATTACHED = {
    "rotary inertia": (effects.rotary_inertia(AT, 2e-4), lambda w: -(w**2) * 2e-4 * outer(slope())),
    "rotational spring": (
        effects.rotational_spring(AT, 300.0),
        lambda w: 300.0 * outer(slope()),
    ),
    "network on a rotation": (
        effects.attached(AT, Spring(300.0) | Dashpot(0.2), motion="rotation"),
        lambda w: (300.0 + 0.2j * w) * outer(slope()),
    ),
    "body": (
        effects.eccentric_mass(AT, mass=0.2, radius_of_gyration=0.02, offset=0.015),
        body,
    ),
    "strut": (
        effects.strut(AT, TO, Spring(2e4) | Dashpot(3.0)),
        lambda w: (2e4 + 3j * w) * outer(row(AT) - row(TO)),
    ),
    "spring in series with a dashpot": (
        effects.attached(AT, Spring(2e4) - Dashpot(40.0)),
        lambda w: maxwell(w) * outer(row(AT)),
    ),
    "maxwell mount": (
        effects.maxwell_mount(AT, stiffness=2e4, relaxation_time=2e-3),
        lambda w: maxwell(w) * outer(row(AT)),
    ),
    "fractional mount": (
        effects.fractional_mount(AT, stiffness=2e4, order=0.4, frequency=100.0),
        lambda w: 2e4 * (1j * w / (2 * np.pi * 100.0)) ** 0.4 * outer(row(AT)),
    ),
    "mass on a segment": (
        effects.segment_mass(MIDDLE, EXTENT, 0.3),
        lambda w: -(w**2) * 0.3 / EXTENT * spread(HEAVY, START, END),
    ),
    "mass removed from a segment": (
        effects.segment_mass(MIDDLE, EXTENT, -0.05),
        lambda w: (w**2) * 0.05 / EXTENT * spread(HEAVY, START, END),
    ),
    "foundation": (
        effects.foundation(LENGTH / 2, LENGTH, 5e4),
        lambda w: 5e4 / LENGTH * spread(HEAVY, 0.0, LENGTH),
    ),
    "network over a segment": (
        effects.over(MIDDLE, EXTENT, Dashpot(30.0) - Mass(0.2)),
        lambda w: 1 / (1 / (30j * w) - 1 / (0.2 * w**2)) / EXTENT * spread(HEAVY, START, END),
    ),
    "damping layer": (
        effects.damping_layer(MIDDLE, EXTENT, 0.3),
        lambda w: 0.3j * BENDING * spread(STIFF, START, END),
    ),
    "stiff damping layer": (
        effects.damping_layer(MIDDLE, EXTENT, 0.3, 0.2),
        lambda w: 0.3 * (0.2 + 1j) * BENDING * spread(STIFF, START, END),
    ),
}
# Where a law ends on a segment the field is less smooth than the polynomials over it.
CLOSE = {
    **dict.fromkeys(["mass on a segment", "network over a segment"], 2e-5),
    **dict.fromkeys(["damping layer", "stiff damping layer"], 2e-4),
}


def deviation(seen, exact):
    """Greatest error over the size of the response at its line."""
    return np.max(np.abs(seen - exact) / np.abs(exact).max(axis=(0, 1)))


@functools.cache
def plain(ends="fixed-free"):
    return fine_beams.receptance(PLACES, OMEGA, lambda w: 0.0, ends)


VARIANTS = {
    "rotary inertia",
    "network on a rotation",
    "fractional mount",
    "mass removed from a segment",
    "stiff damping layer",
}
"""Others act at the same kind of port by a law that is as simple."""


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=FURTHER * (kind in VARIANTS)) for kind in ATTACHED]
)
def test_what_is_attached_acts_as_on_a_fine_mesh(kind):
    effect, added = ATTACHED[kind]
    exact = fine_beams.receptance(PLACES, OMEGA, added)
    assert deviation(response(effect), exact) < CLOSE.get(kind, 2e-6)
    assert deviation(plain(), exact) > 0.02


LAW = LossySpring(3e4, 0.2) | Dashpot(20.0)
LINES = OMEGA / (2 * np.pi)
TABLE = effects.Tabulated(LINES, LAW.dynamic_stiffness(jnp.asarray(OMEGA)))
PORTS = {
    "displacement": lambda law: effects.attached(AT, law),
    "rotation": lambda law: effects.attached(AT, law, motion="rotation"),
    "cut": lambda law: effects.inserted(AT, law),
    "strut": lambda law: effects.strut(AT, TO, law),
    "segment": lambda law: effects.over(MIDDLE, EXTENT, law),
}


@pytest.mark.parametrize(
    "port",
    ["displacement", "cut"] + [pytest.param(n, marks=FURTHER) for n in PORTS if n[0] in "rs"],
)
def test_a_table_acts_as_the_network_that_it_was_made_of(port):
    found, exact = response(PORTS[port](TABLE)), response(PORTS[port](LAW))
    assert deviation(found, exact) < 1e-9
    assert deviation(response(PORTS[port](0.9 * TABLE)), exact) > 1e-4
    np.testing.assert_array_equal(
        response(dataclasses.replace(PORTS[port](TABLE), strength=0.0)), response()
    )


def test_a_table_must_reach_all_lines_of_an_experiment():
    setup = cantilever.experiment()  # from 8 to 900 Hz
    with pytest.raises(InputError, match="a table from 8 to 900 Hz is needed"):
        setup + effects.attached(AT, effects.Tabulated([8.0, 800.0], [1e4, 1e4]))
    assert setup + effects.attached(AT, effects.Tabulated([8.0, 900.0], [1e4, 1e4]))


@pytest.mark.parametrize("ends", ["fixed-pinned", "free-free", "pinned-pinned"])
def test_rotations_also_act_on_other_supports(ends):
    exact = fine_beams.receptance(PLACES, OMEGA, lambda w: 300.0 * outer(slope()), ends)
    seen = response(effects.rotational_spring(AT, 300.0), ends=ends)
    assert deviation(seen, exact) < 5e-6


CUTS = {"rotation": (1, LossySpring(900.0, 0.2)), "displacement": (0, LossySpring(2e5, 0.2))}


@pytest.mark.parametrize(
    ("motion", "ends"),
    [("rotation", "fixed-free"), ("displacement", "fixed-pinned"), ("rotation", "free-free")]
    + [
        pytest.param(*case, marks=FURTHER)
        for case in [
            ("displacement", "fixed-free"),
            ("rotation", "fixed-pinned"),
            ("displacement", "free-free"),
        ]
    ],
)
def test_a_lossy_joint_is_that_of_a_mesh_cut_open(motion, ends):
    freedom, law = CUTS[motion]
    seen = response(effects.inserted(AT, law, motion=motion), ends=ends)
    exact = fine_beams.cut_open(
        PLACES, OMEGA, AT, lambda w: law.stiffness * (1 + 0.2j), freedom, ends
    )
    assert deviation(seen, exact) < 1e-4
    assert deviation(plain(ends), exact) > 0.02


def test_a_joint_of_few_modes_has_the_mass_of_those_left_out():
    law = LossySpring(900.0, 0.2)
    exact = fine_beams.cut_open(PLACES, OMEGA, AT, lambda w: 900.0 * (1 + 0.2j), 1)
    assert deviation(response(effects.inserted(AT, law), modes=12), exact) < 1e-3


@pytest.mark.parametrize(
    ("motion", "end"),
    [("rotation", "left"), ("translation", "right")]
    + [
        pytest.param(*case, marks=FURTHER)
        for case in [("rotation", "right"), ("translation", "left")]
    ],
)
def test_a_cut_at_a_support_is_the_compliant_support(end, motion):
    """One changes the modes, the other closes a port; without damping they are the same."""
    compliance = 1e-3 if motion == "rotation" else 1e-6
    at = 0.0 if end == "left" else LENGTH
    of_cut = "rotation" if motion == "rotation" else "displacement"
    real = effects.compliant_support(compliance, end=end, motion=motion)
    closed = effects.inserted(at, Spring(1 / compliance), motion=of_cut)
    seen, exact = (response(effect, ends="fixed-fixed") for effect in (closed, real))
    assert deviation(seen, exact) < 1e-4


def test_a_hinge_along_a_bar_is_that_of_two_bars():
    bar = beams.bar(240, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    base = Structure(bar, damping=damping.Structural(0.01)) + effects.inserted(
        0.37, Spring(5e6), motion="displacement"
    )
    point = Points(jnp.array([0.6]), np.ones((1, 1)))
    omega = 2 * np.pi * np.array([40.0, 150.0, 420.0])
    seen = jax.jit(lambda w: receptance(base, point, point, w))(jnp.asarray(omega))[0, 0]
    # Waves in both parts, with the same complex modulus in the joint as in the bar.
    modulus = 1 + 0.01j
    wave = omega / np.sqrt(1e9 / 9000.0 * modulus)
    force = 1e6 * modulus * wave
    left = force / np.tan(wave * 0.37)
    joined = 1 / (1 / left + 1 / 5e6)
    tangent = np.tan(wave * 0.23)
    middle = force * (joined + -force * tangent) / (force + joined * tangent)
    np.testing.assert_allclose(seen, 1 / (middle + force / np.tan(wave * 0.4)), rtol=1e-4)


def test_a_beam_on_a_bed_of_springs_has_frequencies_shifted_by_its_modulus():
    per_length = 4e4
    bed = structure(effects.foundation(LENGTH / 2, LENGTH, per_length * LENGTH), modes=40)
    plain_modes = np.asarray(beams.beam(6, **BEAM).angular_frequency())[:5]
    shifted = np.sqrt(plain_modes**2 + per_length / PER_LENGTH)
    np.testing.assert_allclose(resonances(bed, shifted), shifted, rtol=1e-7)


def test_a_tip_inertia_obeys_its_frequency_equation():
    """Blevins, Formulas for Natural Frequency and Mode Shape, table 8-8."""
    ratio = 0.05  # of J over the mass per length times the length cubed
    inertia = effects.rotary_inertia(LENGTH, ratio * PER_LENGTH * LENGTH**3)

    def equation(b):
        waves = np.cosh(b) * np.sin(b) + np.sinh(b) * np.cos(b)
        return 1 + np.cosh(b) * np.cos(b) - ratio * b**3 * waves

    grid = np.linspace(0.5, 8.0, 2000)
    signs = np.flatnonzero(np.diff(np.sign(equation(grid))))
    roots = [scipy.optimize.brentq(equation, grid[i], grid[i + 1]) for i in signs][:3]
    exact = (np.array(roots) / LENGTH) ** 2 * np.sqrt(BENDING / PER_LENGTH)
    np.testing.assert_allclose(resonances(structure(inertia), exact), exact, rtol=1e-6)


def test_a_beam_held_in_the_middle_is_two_spans():
    """A law without end holds its port; both halves are then alike, and pinned there."""
    held = structure(effects.attached(LENGTH / 2, Spring(1e15)), ends="pinned-pinned")
    half = beams.beam(2, **BEAM | {"length": LENGTH / 2}, ends="fixed-pinned")
    exact = np.asarray(half.angular_frequency())[:1]
    np.testing.assert_allclose(resonances(held, exact), exact, rtol=1e-6)


def test_a_bar_with_a_mass_all_over_it_is_heavier():
    bar = beams.bar(60, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    coat = effects.segment_mass(0.5, 1.0, 1.8)
    base = Structure(bar, damping=damping.Modal(1e-13)) + coat
    exact = np.asarray(bar.angular_frequency())[:4] / np.sqrt(1.2)
    np.testing.assert_allclose(resonances(base, exact, 0.43), exact, rtol=2e-5)


def resonances(base, near, place=0.31):
    """Zeros of the inverse of the receptance at a place, without damping."""
    point = Points(jnp.array([place]), np.ones((1, 1)))
    read = jax.jit(lambda w: receptance(base, point, point, w))

    def stiffness(omega):
        return float(1 / read(jnp.array([omega]))[0, 0, 0].real)

    return [scipy.optimize.brentq(stiffness, 0.999 * w, 1.001 * w, xtol=1e-9) for w in near]


REFUSED = {
    "a segment along nothing": (
        lambda: beams.beam(3, **BEAM),
        effects.segment_mass(0.4, 0.1, 1.0, direction=(0.0, 0.0, 0.0)),
        "direction=.* was given; a vector of a length above zero is needed",
    ),
    "a strut across all motions": (
        lambda: beams.beam(3, **BEAM),
        effects.strut(0.2, 0.4, Spring(1.0), direction=(1.0, 0.0, 0.0)),
        "a direction with a component along z is needed",
    ),
    "a bar turns": (
        lambda: beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9e3),
        effects.rotary_inertia(0.4, 1e-4),
        "A rotation of a bar was given, .*has none",
    ),
    "no such motion": (
        lambda: beams.beam(3, **BEAM),
        effects.attached(0.4, Spring(1.0), motion="twist"),
        "motion='twist' was given; 'displacement' or 'rotation' is needed",
    ),
    "two edges on a line": (
        lambda: beams.beam(3, **BEAM),
        effects.segment_mass(0.4, (0.1, 0.1, 0.0), 1.0),
        "an extent of 3 numbers was given; 1 is needed",
    ),
    "a bar opens its cut by turning": (
        lambda: beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9e3),
        effects.inserted(0.4, Spring(1.0)),
        "motion='rotation' was given; 'displacement' is needed",
    ),
    "beyond the end": (
        lambda: beams.beam(3, **BEAM),
        effects.strut(0.4, 0.7, Spring(1.0)),
        'Effect "strut": place 0.7 m lies outside',
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_no_port_can_be_is_refused(case):
    modes, effect, words = REFUSED[case]
    with pytest.raises(InputError, match=words):
        Structure(modes(), damping=damping.Modal(0.01)) + effect


def test_fewer_ports_tell_roughly_the_same():
    """They find out where something acts: a form of the effect that takes less time."""
    laid = effects.segment_mass(MIDDLE, EXTENT, 0.3)
    rough, modes = laid.roughly(), structure().modes
    assert rough.points(modes).count < 0.6 * laid.points(modes).count
    fine, coarse = response(laid), response(rough)
    np.testing.assert_allclose(coarse, fine, rtol=0, atol=1e-3 * np.abs(fine).max())
    assert not np.array_equal(coarse, fine)
    assert repr(rough) == repr(laid)
