"""Effects compared with closed forms: frequency equations, fixed points, exact waves."""

import dataclasses
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.optimize

from bayes_placement import Structure, beams, damping, effects
from bayes_placement.effects.axial_preload import buckling_load
from bayes_placement.experiment.frf import receptance
from bayes_placement.modes.points import Points

LENGTH, AREA, MOMENT, STIFFNESS, DENSITY = 0.8, 2e-4, 6e-10, 7e10, 2700.0
BEAM = {
    "length": LENGTH,
    "area": AREA,
    "second_moment": MOMENT,
    "youngs_modulus": STIFFNESS,
    "density": DENSITY,
}
BENDING, MASS = STIFFNESS * MOMENT, DENSITY * AREA * LENGTH
SPEED = np.sqrt(BENDING / (DENSITY * AREA))
MODES = 30
UNDAMPED = 1e-12


def structure(*additions, ends="fixed-free", modes=MODES, **quantities):
    line = Structure(
        beams.beam(modes, **BEAM | quantities, ends=ends), damping=damping.Modal(UNDAMPED)
    )
    for effect in additions:
        line = line + effect
    return line


def natural(base):
    """Natural angular frequencies of the structure proper, hinges and preload included."""
    return np.asarray(jax.jit(lambda: base.proper_modes().angular_frequency())())


def between(base, position, other, omega):
    sides = [Points(jnp.array([x]), np.ones((1, 1))) for x in (position, other)]
    return np.asarray(jax.jit(lambda w: receptance(base, *sides, w))(jnp.atleast_1d(omega)))[0, 0]


def root(equation, near):
    return scipy.optimize.brentq(equation, 0.97 * near, 1.03 * near, xtol=1e-13)


def ratio_wave(b):
    return np.cos(b) * np.sinh(b) - np.sin(b) * np.cosh(b)


def test_another_modulus_is_that_of_another_material():
    omega = np.array([0.3, 0.9, 2.1]) * natural(structure())[1]
    changed, other = (
        between(base, 0.3, 0.7 * LENGTH, omega)
        for base in (
            structure(effects.modulus_change(-0.02)),
            structure(youngs_modulus=0.98 * STIFFNESS),
        )
    )
    np.testing.assert_allclose(changed, other, rtol=1e-9)


@pytest.mark.parametrize("near", [1.24792, 4.03114, 7.13413])
def test_a_mass_at_the_tip_obeys_its_frequency_equation(near):
    b = root(lambda b: 1 + np.cos(b) * np.cosh(b) + b * ratio_wave(b), near)
    exact = (b / LENGTH) ** 2 * SPEED
    loaded = structure(effects.point_mass(LENGTH, MASS))
    # Undamped, the inverse of the receptance passes through zero at the resonance.
    around = exact * np.array([1 - 1e-6, 1 + 1e-6])
    inverse = 1 / between(loaded, 0.5, 0.5, around).real
    assert inverse[0] > 0 > inverse[1]


@pytest.mark.parametrize("damping_ratio", [0.0, 0.1, 0.5])
def test_an_absorber_goes_through_the_fixed_points_of_den_hartog(damping_ratio):
    ratio, spring = 0.2, 1.0
    rigid = structure(
        effects.ground_spring(LENGTH / 2, spring),
        effects.tuned_absorber(
            LENGTH / 2,
            mass=ratio * MASS,
            frequency=np.sqrt(spring / MASS) / (1 + ratio) / (2 * np.pi),
            damping_ratio=damping_ratio,
        ),
        ends="free-free",
    )
    tuning = 1 / (1 + ratio)
    squares = np.roots([2 + ratio, -2 * (1 + tuning**2 * (1 + ratio)), 2 * tuning**2]).real
    fixed = np.sqrt(squares * spring / MASS)
    amplitude = np.abs(between(rigid, LENGTH / 2, LENGTH / 2, fixed)) * spring
    np.testing.assert_allclose(amplitude, np.sqrt(1 + 2 / ratio), rtol=1e-3)


@pytest.mark.parametrize("softness", [0.01, 0.3, 30.0])
def test_a_cantilever_on_a_soft_clamp_obeys_its_frequency_equation(softness):
    """Chun, J. Appl. Mech. 39 (1972) 1154: between clamped-free and pinned-free."""

    def equation(b):
        return 1 + np.cos(b) * np.cosh(b) + softness * b * ratio_wave(b)

    frequencies = natural(structure(effects.compliant_support(softness * LENGTH / BENDING)))
    for omega in frequencies[:4]:
        b = np.sqrt(omega / SPEED) * LENGTH
        np.testing.assert_allclose(b, root(equation, b), rtol=3e-5)


@pytest.mark.parametrize("softness", [0.001, 0.05])
def test_a_cantilever_on_a_soft_seat_obeys_its_frequency_equation(softness):
    """The root keeps its slope at zero and moves by force times compliance."""

    def equation(b):
        stiff = 1 + np.cos(b) * np.cosh(b)
        return stiff - softness * b**3 * (np.cos(b) * np.sinh(b) + np.sin(b) * np.cosh(b))

    soft = effects.compliant_support(softness * LENGTH**3 / BENDING, motion="translation")
    frequencies = natural(structure(soft))
    for omega in frequencies[:4]:
        b = np.sqrt(omega / SPEED) * LENGTH
        np.testing.assert_allclose(b, root(equation, b), rtol=1e-4)


def test_a_very_soft_clamp_is_a_pin():
    soft = natural(structure(effects.compliant_support(1e6 * LENGTH / BENDING)))
    pinned = natural(structure(ends="pinned-free"))
    np.testing.assert_allclose(soft[1:5], pinned[1:5], rtol=1e-4)
    assert soft[0] < 1e-2 * soft[1]


@pytest.mark.parametrize("tension", [400.0, -100.0])
def test_a_tensioned_pinned_beam(tension):
    k = np.arange(1, 8) * np.pi / LENGTH
    exact = np.sqrt((BENDING * k**4 + tension * k**2) / (DENSITY * AREA))
    frequencies = natural(structure(effects.axial_preload(tension), ends="pinned-pinned"))
    np.testing.assert_allclose(frequencies[:7], exact, rtol=1e-10)


@pytest.mark.parametrize("ends", ["pinned-pinned", "fixed-free", "fixed-fixed"])
def test_the_buckling_load_is_that_of_euler(ends):
    effective = {"pinned-pinned": 1.0, "fixed-free": 2.0, "fixed-fixed": 0.5}[ends]
    exact = np.pi**2 * BENDING / (effective * LENGTH) ** 2
    beam = structure(ends=ends).modes
    np.testing.assert_allclose(buckling_load(beam), exact, rtol=1e-3)
    unstable = natural(structure(effects.axial_preload(-1.01 * exact), ends=ends))
    assert np.isnan(unstable[0])


@pytest.mark.parametrize("height", [0.01, 0.02, 0.04])
def test_shear_and_rotary_inertia_of_a_pinned_beam(height):
    ratio, gyration = 3.12, height / np.sqrt(12)
    deep = structure(
        effects.shear_and_rotary_inertia(ratio),
        ends="pinned-pinned",
        second_moment=AREA * gyration**2,
    )
    k = np.arange(1, 5) * np.pi / LENGTH
    slender = (k * gyration) ** 2
    # Timoshenko's equation, g x^2 y^2 - (1 + x (1 + g)) y + 1 = 0 with y = (omega / omega_0)^2.
    equations = [[ratio * x**2, -(1 + x * (1 + ratio)), 1.0] for x in slender]
    exact = [np.sqrt(np.roots(coefficients).min()) for coefficients in equations]
    plain = k**2 * gyration * np.sqrt(STIFFNESS / DENSITY)
    reduction = natural(deep)[:4] / plain
    assert np.all(np.abs(reduction - exact) < 20 * slender**3 + 1e-9)
    assert np.all(np.abs(reduction - exact) < 0.1 * (1 - np.array(exact)))


def test_no_tension_and_no_shear_leave_free_bodies_free():
    free = structure(effects.axial_preload(300.0), ends="free-free")
    frequencies = natural(free)
    assert frequencies[0] == 0.0  # a dead load holds the slope, not the deflection
    assert 0 < frequencies[1] < frequencies[2]


def test_a_cubic_spring_stiffens_by_three_quarters_of_the_amplitude_squared():
    stiffness, force = 1e8, 20.0
    sprung = structure(effects.cubic_stiffness(0.5, stiffness))
    sprung = dataclasses.replace(sprung, damping=damping.Modal(0.02))
    linear = dataclasses.replace(structure(), damping=damping.Modal(0.02))
    omega = jnp.asarray(natural(structure())[0] * np.array([0.5, 0.9, 1.2, 2.0]))
    place = Points(jnp.array([0.5]), np.ones((1, 1)))
    every = jnp.full(4, force)
    loaded = jax.jit(lambda: receptance(sprung, place, place, omega, force=every))()[0, 0]
    plain = between(linear, 0.5, 0.5, omega)
    amplitude = np.abs(loaded) * force
    balance = 1 / (1 / plain + 0.75 * stiffness * amplitude**2)
    np.testing.assert_allclose(loaded, balance, rtol=1e-9)
    assert np.abs(loaded / plain - 1).max() > 0.1


def bar_of_three_parts(ends, modulus, position, force, omega):
    """Displacement of a fixed bar under a unit force, its middle part of another modulus."""
    places = sorted({0.0, LENGTH, *ends, position, force})
    stiffness = np.zeros((len(places),) * 2, complex)
    for n, (low, high) in enumerate(itertools.pairwise(places)):
        here = STIFFNESS * (modulus if ends[0] <= low and high <= ends[1] else 1.0)
        wave = omega * np.sqrt(DENSITY / here)
        angle = wave * (high - low)
        part = np.array([[np.cos(angle), -1.0], [-1.0, np.cos(angle)]]) / np.sin(angle)
        stiffness[n : n + 2, n : n + 2] += here * AREA * wave * part
    forces = np.array([float(place == force) for place in places[1:-1]])
    return np.linalg.solve(stiffness[1:-1, 1:-1], forces)[places.index(position) - 1]


@pytest.mark.parametrize(
    ("position", "close"), [(0.31, 5e-5), pytest.param(0.64, 1e-5, marks=pytest.mark.long)]
)
def test_a_layer_over_instruments_on_a_bar_is_that_of_exact_waves(position, close):
    """However its ends lie: what it cuts would jump where an instrument passes a node.

    Where both instruments are upon it, a small part of it is finer than its polynomials.
    """
    modes = beams.bar(40, length=LENGTH, area=AREA, youngs_modulus=STIFFNESS, density=DENSITY)
    omega = 2 * np.pi * np.linspace(500.0, 9000.0, 12)
    for middle in np.linspace(0.330, 0.332, 5):
        layer = effects.damping_layer(middle, 0.16, 0.3, 0.4)
        bar = Structure(modes, damping=damping.Modal(UNDAMPED)) + layer
        ends, modulus = (middle - 0.08, middle + 0.08), 1 + 0.3 * (0.4 + 1j)
        exact = [bar_of_three_parts(ends, modulus, position, 0.37, line) for line in omega]
        error = np.abs(between(bar, position, 0.37, omega) - exact)
        assert np.max(error) < close * np.max(np.abs(exact))
