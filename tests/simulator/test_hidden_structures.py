"""The simulator of hidden effects: against closed forms, exact waves and its own matrices."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

from tests.simulator import fine_elements, hidden_draws, hidden_scenes, hidden_structures
from tests.simulator.fine_elements import NOTHING, Line, effect, plant
from tests.simulator.hidden_structures import Instrument, accelerance, deviation, record

BAR = Line("bar", "fixed-fixed", 1.0, 1e-3, 1e9, 9000.0, 0.0)
BEAM = Line("beam", "fixed-free", 0.6, 1.8e-4, 70e9, 2700.0, 0.0, 5.4e-10)
PINNED = replace(BEAM, ends="pinned-pinned")
TIGHT = dict(rtol=2e-6)


def sensor(place, name="s1"):
    return Instrument(name, place, 0.01, 1, place)


def receptance(line, read, driven, frequency, hidden=NOTHING, **settings):
    """Receptance between one place and another."""
    sides = [sensor(read)], [sensor(driven, "a1")]
    frf = accelerance(line, *sides, frequency, hidden, **settings)[0, 0]
    return frf / -((2 * np.pi * frequency) ** 2)


def angular(line, hidden, place, guess):
    """Resonance [rad/s] within 1 % of a guess: the zero of 1 / H of the undamped structure."""

    def stiffness(omega):
        return 1 / receptance(line, place, place, np.array([omega / (2 * np.pi)]), hidden)[0].real

    return scipy.optimize.brentq(stiffness, 0.99 * guess, 1.01 * guess, xtol=1e-10 * guess)


def root(equation, near):
    return scipy.optimize.brentq(equation, 0.97 * near, 1.03 * near, xtol=1e-13)


def bending_speed(line):
    return np.sqrt(line.rigidity / (line.density * line.area))


@pytest.mark.parametrize("module", [fine_elements, hidden_structures, hidden_scenes, hidden_draws])
def test_the_simulator_knows_nothing_of_the_package(module):
    nodes = [*ast.walk(ast.parse(Path(module.__file__).read_text()))]
    modules = {node.module for node in nodes if isinstance(node, ast.ImportFrom)}
    imports = [node for node in nodes if isinstance(node, ast.Import)]
    modules |= {alias.name for node in imports for alias in node.names}
    known = {"collections", "dataclasses", "functools", "numpy", "scipy", "tests"}
    assert {name.split(".")[0] for name in modules} <= known


# ------------------------------------------------------------------------------ closed forms


@pytest.mark.parametrize("near", [1.24792, 4.03114])
def test_a_mass_at_the_tip_obeys_its_frequency_equation(near):
    def equation(b):
        wave = np.cos(b) * np.sinh(b) - np.sin(b) * np.cosh(b)
        return 1 + np.cos(b) * np.cosh(b) + b * wave  # tip mass equal to the beam's

    exact = (root(equation, near) / BEAM.length) ** 2 * bending_speed(BEAM)
    hidden = effect("point_mass", at=BEAM.length, mass=BEAM.mass)
    assert np.isclose(angular(BEAM, hidden, 0.4, exact), exact, **TIGHT)


def test_a_bar_on_a_ground_spring_obeys_its_frequency_equation():
    stiffness, place = 3e6, 0.3

    def equation(k):
        walls = 1 / np.tan(k * place) + 1 / np.tan(k * (1 - place))
        return stiffness + BAR.rigidity * k * walls

    exact = root(equation, 3.6) * np.sqrt(1e9 / 9000.0)
    hidden = effect("ground_spring", at=place, stiffness=stiffness)
    assert np.isclose(angular(BAR, hidden, 0.55, exact), exact, **TIGHT)


def test_a_dashpot_at_the_end_of_a_bar_absorbs_the_wave():
    rod = replace(BAR, ends="fixed-free")
    matched = rod.area * np.sqrt(rod.youngs_modulus * rod.density)
    hidden = effect("ground_dashpot", at=1.0, viscosity=matched)
    frequency = np.linspace(50.0, 900.0, 7)
    k = 2 * np.pi * frequency * np.sqrt(9000.0 / 1e9)
    exact = (
        np.sin(0.2 * k) * np.exp(-1j * k * 0.7) / (rod.rigidity * k)
    )  # a standing and a leaving wave
    response = receptance(rod, 0.2, 0.7, frequency, hidden)
    np.testing.assert_allclose(response, exact, rtol=1e-4)


@pytest.mark.parametrize("damping_ratio", [0.0, 0.1, 0.5])
def test_an_absorber_goes_through_the_fixed_points_of_den_hartog(damping_ratio):
    ratio, spring = 0.2, 10.0
    rigid = replace(BAR, ends="free-free", suspension=((0.5, spring),))
    natural = np.sqrt(spring / rigid.mass)
    tuning = 1 / (1 + ratio)
    fixed = np.sqrt(
        np.roots([2 + ratio, -2 * (1 + tuning**2 + ratio * tuning**2), 2 * tuning**2]).real
    )
    hidden = effect(
        "tuned_absorber",
        at=0.5,
        mass=ratio * rigid.mass,
        frequency=tuning * natural / (2 * np.pi),
        damping_ratio=damping_ratio,
    )
    response = receptance(rigid, 0.5, 0.5, fixed * natural / (2 * np.pi), hidden)
    assert np.allclose(np.abs(response) * spring, np.sqrt(1 + 2 / ratio), rtol=1e-4)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_shear_and_rotary_inertia_of_a_pinned_beam(order):
    deep = replace(PINNED, area=0.03 * 0.06, second_moment=0.03 * 0.06**3 / 12)
    hidden = effect("shear_and_rotary_inertia", shear_correction=0.85, poisson_ratio=0.3)
    shear_modulus = 0.85 * deep.youngs_modulus / 2.6
    k = order * np.pi / deep.length
    inertia = deep.density * deep.second_moment
    per_length = deep.density * deep.area
    rotary = inertia * k**2 * (1 + deep.youngs_modulus / shear_modulus)
    squares = np.roots(
        [inertia * deep.density / shear_modulus, -(per_length + rotary), deep.rigidity * k**4]
    )
    assert np.isclose(plant(deep, hidden).natural[order - 1], np.sqrt(squares.min()), rtol=2e-5)


@pytest.mark.parametrize("order", [1, 2, 5])
def test_a_tensioned_pinned_beam(order):
    tension, k = 200.0, order * np.pi / PINNED.length
    square = (PINNED.rigidity * k**4 + tension * k**2) / (PINNED.density * PINNED.area)
    natural = plant(PINNED, effect("axial_preload", tension=tension)).natural[order - 1]
    assert np.isclose(natural, np.sqrt(square), **TIGHT)


@pytest.mark.parametrize(
    ("hidden", "modulus"),
    [
        (effect("hysteretic_damping", loss_factor=0.1), lambda w: 1 + 0.1j),
        (
            effect("viscoelastic_modulus", relaxing=0.3, relaxation_time=5e-4),
            lambda w: 1 + 0.3 * (5e-4j * w) / (1 + 5e-4j * w),
        ),
    ],
)
def test_a_rod_of_complex_modulus(hidden, modulus):
    rod = replace(BAR, ends="fixed-free")
    frequency = np.linspace(20.0, 700.0, 40)
    omega = 2 * np.pi * frequency
    stiffness = 1e9 * modulus(omega)
    k = omega * np.sqrt(9000.0 / stiffness)
    exact = np.sin(0.4 * k) / (stiffness * 1e-3 * k * np.cos(k))  # driven at the tip
    np.testing.assert_allclose(receptance(rod, 0.4, 1.0, frequency, hidden), exact, rtol=1e-4)


def waves(line, omega, sections, left):
    """Determinant of a beam free at its right end, by exact transfer from its left end.

    Each section is (length, rigidity); states are deflection, slope, moment and shear force, and
    the columns of `left` are the two that the left end allows.
    """
    state = left
    for size, rigidity in sections:
        slopes = np.zeros((4, 4))
        slopes[0, 1], slopes[1, 2], slopes[2, 3] = 1.0, 1 / rigidity, 1.0
        slopes[3, 0] = line.density * line.area * omega**2
        state = scipy.linalg.expm(slopes * size) @ state
    return np.linalg.det(state[2:])


@pytest.mark.parametrize("order", [0, 1, 3])
def test_a_weak_segment_of_a_beam_is_the_exact_one(order):
    hidden = effect("local_stiffness_loss", at=0.2, extent=0.03, share=0.7)
    weak = 0.3 * BEAM.rigidity
    sections = [(0.185, BEAM.rigidity), (0.03, weak), (0.385, BEAM.rigidity)]
    natural = plant(BEAM, hidden).natural[order]
    exact = root(lambda w: waves(BEAM, w, sections, np.eye(4)[:, 2:]), natural)
    assert np.isclose(natural, exact, **TIGHT)


def test_a_segment_without_stiffness_is_a_hinge():
    hidden = effect("local_stiffness_loss", at=0.2, extent=2e-4, share=1 - 1e-6)
    clamped, free = np.eye(4)[:, 2:], BEAM.rigidity

    def hinged(omega):
        # At the hinge the moment vanishes and the slope is free: three unknowns.
        slopes = np.zeros((4, 4))
        slopes[0, 1], slopes[1, 2], slopes[2, 3] = 1.0, 1 / free, 1.0
        slopes[3, 0] = BEAM.density * BEAM.area * omega**2
        near, far = scipy.linalg.expm(slopes * 0.2) @ clamped, scipy.linalg.expm(slopes * 0.4)
        end = far @ np.column_stack([near, [0, 1, 0, 0]])
        return np.linalg.det(np.vstack([np.append(near[2], 0.0), end[2:]]))

    natural = plant(BEAM, hidden).natural[1]
    assert np.isclose(natural, root(hinged, natural), rtol=1e-3)


def test_a_compliant_root_of_a_beam_is_the_exact_one():
    compliance = 0.1 * BEAM.length / BEAM.rigidity
    hidden = effect("compliant_support", end="left", compliance=compliance)
    left = np.array([[0.0, 0.0], [compliance, 0.0], [1.0, 0.0], [0.0, 1.0]])
    for natural in plant(BEAM, hidden).natural[:3]:
        section = [(BEAM.length, BEAM.rigidity)]
        exact = root(lambda w, section=section: waves(BEAM, w, section, left), natural)
        assert np.isclose(natural, exact, **TIGHT)


def test_a_compliant_end_of_a_bar_obeys_its_frequency_equation():
    compliance = 0.2 / BAR.rigidity
    hidden = effect("compliant_support", end="right", compliance=compliance)
    exact = root(lambda k: np.tan(k) + BAR.rigidity * compliance * k, 2.65)
    assert np.isclose(plant(BAR, hidden).natural[0], exact * np.sqrt(1e9 / 9000.0), **TIGHT)


def test_only_a_held_end_can_be_compliant():
    with pytest.raises(KeyError):
        plant(PINNED, effect("compliant_support", end="left", compliance=1.0))


# ------------------------------------------------------------------------------ cubic springs

CUBIC = effect("cubic_stiffness", at=0.6, stiffness=3e8)


def test_the_peak_of_a_cubic_spring_lies_on_the_backbone():
    line = replace(BEAM, damping_ratio=0.003)
    linear = 1.8751**2 / (2 * np.pi * line.length**2) * bending_speed(line)
    frequency = linear * np.linspace(0.9, 1.6, 2001)
    moved = 0.006 * np.abs(receptance(line, 0.6, 0.6, frequency, CUBIC, force_level=0.006))
    top = np.argmax(moved)
    spring = 0.75 * 3e8 * moved[top] ** 2 * line.length**3 / line.rigidity

    def sprung(b):  # frequency equation of a cantilever with a spring at its tip
        wave = np.sin(b) * np.cosh(b) - np.cos(b) * np.sinh(b)
        return b**3 * (1 + np.cos(b) * np.cosh(b)) + spring * wave

    backbone = (1.8751 * np.sqrt(frequency[top] / linear) / line.length) ** 2
    exact = (root(sprung, backbone**0.5 * line.length) / line.length) ** 2
    assert 1.2 * linear < frequency[top] < 1.5 * linear
    assert np.isclose(backbone, exact, rtol=1e-3)


def test_the_motion_on_a_cubic_spring_balances_its_first_harmonic():
    line = replace(BEAM, damping_ratio=0.02)
    frequency = np.linspace(5.0, 300.0, 50)
    at_spring, force = receptance(line, 0.6, 0.3, frequency, CUBIC, force_level=0.5), 0.5
    reaction = 0.75 * 3e8 * np.abs(force * at_spring) ** 2 * at_spring
    alone = receptance(line, 0.6, 0.3, frequency)
    driving_point = receptance(line, 0.6, 0.6, frequency)
    np.testing.assert_allclose(at_spring, alone - driving_point * reaction, rtol=1e-8)
    elsewhere = receptance(line, 0.45, 0.3, frequency, CUBIC, force_level=0.5)
    passed = receptance(line, 0.45, 0.6, frequency)
    alone = receptance(line, 0.45, 0.3, frequency)
    np.testing.assert_allclose(elsewhere, alone - passed * reaction, rtol=1e-8)
    assert np.max(np.abs(at_spring / receptance(line, 0.6, 0.3, frequency) - 1)) > 0.3


# ------------------------------------------------------------------------- matrices and meshes


def test_the_sum_over_all_modes_is_the_direct_solution():
    line = replace(BEAM, damping_ratio=0.03)
    hidden = effect("point_mass", at=0.37, mass=0.1)
    mesh = fine_elements.mesh_of(line, NOTHING, 30, ())
    stiffness, mass = (matrix[2:, 2:] for matrix in fine_elements.matrices(line, NOTHING, mesh))
    squares, shapes = scipy.linalg.eigh(stiffness, mass)
    losses = mass @ shapes * (0.06 * np.sqrt(squares)) @ shapes.T @ mass
    seat, read, driven = mesh.rows([0.37, 0.13, 0.55])[:, 2:]
    frequency = np.array([7.0, 90.0, 1000.0])
    for hertz, value in zip(
        frequency, receptance(line, 0.13, 0.55, frequency, hidden, elements=30), strict=True
    ):
        omega = 2 * np.pi * hertz
        loaded = mass + 0.1 * np.outer(seat, seat)
        dynamic = stiffness + 1j * omega * losses - omega**2 * loaded
        assert np.isclose(value, read @ np.linalg.solve(dynamic, driven), rtol=1e-7)


@pytest.mark.long
@pytest.mark.parametrize("line", [BAR, BEAM], ids=["bar", "beam"])
def test_natural_frequencies_converge_with_the_fourth_power_of_the_mesh(line):
    fine = plant(line, elements=200).natural[4]
    errors = [plant(line, elements=count).natural[4] - fine for count in (8, 16)]
    assert 3.7 < np.log2(errors[0] / errors[1]) < 4.3


@pytest.mark.parametrize("kind", ["bar", "beam"])
def test_responses_have_converged(kind):
    line = replace(BAR if kind == "bar" else BEAM, damping_ratio=0.01)
    top = plant(line).natural[8] / (2 * np.pi)
    frequency = np.linspace(0.02, 1.0, 60) * top
    hidden = effect("point_mass", at=0.3 * line.length, mass=0.1 * line.mass)
    places = 0.3 * line.length, 0.71 * line.length
    coarse, fine = (
        receptance(line, *places, frequency, hidden, elements=n)
        for n in (fine_elements.ELEMENTS, 240)
    )
    assert np.mean(np.abs(coarse - fine) ** 2 / deviation(fine) ** 2) < 0.02


# ---------------------------------------------------------------------------- measuring chain

SENSORS = (sensor(0.2), replace(sensor(0.5, "s2"), direction=-1), sensor(0.83, "s3"))
ACTUATORS = (sensor(0.31, "a1"), sensor(0.77, "a2"))
LOSSY = replace(BAR, damping_ratio=0.03)
FREQUENCY = np.linspace(30.0, 900.0, 25)


def chained(name, **parameters):
    hidden = effect(name, **parameters) if name else NOTHING
    return accelerance(LOSSY, SENSORS, ACTUATORS, FREQUENCY, hidden)


@pytest.fixture(scope="module")
def plain():
    return chained(None)


def test_a_channel_recorded_the_other_way_has_the_other_sign(plain):
    turned = accelerance(
        LOSSY, [replace(instrument, direction=1) for instrument in SENSORS], ACTUATORS, FREQUENCY
    )
    np.testing.assert_allclose(plain, turned * np.array([1, -1, 1])[:, None, None])


def test_a_delay_turns_every_channel(plain):
    turned = plain * np.exp(-2j * np.pi * FREQUENCY * 1e-4)
    np.testing.assert_allclose(chained("time_delay", delay=1e-4), turned)


def test_a_gain_scales_one_channel(plain):
    scaled = plain * np.array([1, 1.1, 1])[:, None, None]
    np.testing.assert_allclose(chained("gain_error", sensor="s2", error=0.1), scaled)


def test_a_soft_mount_is_an_oscillator_driven_at_its_foot(plain):
    response = chained("mount_resonance", sensor="s3", frequency=700.0, damping_ratio=0.05) / plain
    turn = FREQUENCY / 700.0
    transmissibility = (1 + (0.1 * turn) ** 2) / ((1 - turn**2) ** 2 + (0.1 * turn) ** 2)
    np.testing.assert_allclose(np.abs(response[2, 0]) ** 2, transmissibility)
    assert np.all(response[2, 0].imag < 0)  # it lags
    np.testing.assert_allclose(response[:2], 1.0)


def test_a_misplaced_sensor_reads_elsewhere(plain):
    response = chained("misplaced_sensor", sensor="s1", position=0.4)
    moved = accelerance(LOSSY, [sensor(0.4)], ACTUATORS, FREQUENCY)
    np.testing.assert_allclose(response[:1], moved)
    np.testing.assert_allclose(response[1:], plain[1:])


def test_sensors_weigh_where_they_sit():
    fixed = chained("sensor_mass", mass=0.2, roving=False)
    roving = chained("sensor_mass", mass=0.2, roving=True)
    for row, instrument in enumerate(SENSORS):
        alone = effect("point_mass", at=instrument.true, mass=0.2)
        expected = accelerance(LOSSY, [instrument], ACTUATORS, FREQUENCY, alone)
        np.testing.assert_allclose(roving[row], expected[0], rtol=1e-3)
    assert np.max(np.abs(fixed / roving - 1)) > 0.1
    # All three at once: one by one as point masses, by the dense matrices of a mesh.
    mesh = fine_elements.mesh_of(LOSSY, NOTHING, 120, (0.2, 0.31, 0.5, 0.77, 0.83))
    stiffness, mass = (
        matrix[1:-1, 1:-1] for matrix in fine_elements.matrices(LOSSY, NOTHING, mesh)
    )
    squares, shapes = scipy.linalg.eigh(stiffness, mass)
    losses = mass @ shapes * (0.06 * np.sqrt(squares)) @ shapes.T @ mass
    seats, driven = (
        mesh.rows([instrument.true for instrument in side])[:, 1:-1]
        for side in (SENSORS, ACTUATORS)
    )
    omega = 2 * np.pi * FREQUENCY[7]
    loaded = mass + 0.2 * seats.T @ seats
    dynamic = stiffness + 1j * omega * losses - omega**2 * loaded
    direct = -(omega**2) * seats @ np.linalg.solve(dynamic, driven.T)
    np.testing.assert_allclose(fixed[:, :, 7], direct * [[1], [-1], [1]], rtol=1e-7)


def test_the_noise_is_the_one_that_the_coherence_tells(plain):
    data = record(plain, FREQUENCY, np.random.default_rng(0), averages=32)
    np.testing.assert_allclose(data.variance(), deviation(plain) ** 2, rtol=1e-9)
    chi2 = np.abs(data.frf - plain) ** 2 / data.variance()
    assert abs(chi2.mean() - 1) < 5 / np.sqrt(chi2.size)
    assert np.all((data.coherence > 0) & (data.coherence < 1))
