"""Natural frequencies with attachments, against equations of frequency from textbooks."""

import numpy as np
import pytest
from scipy.optimize import brentq

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement.experiment.natural_modes import natural_modes

LENGTH, AREA, MODULUS, DENSITY = 1.0, 1e-3, 1e9, 9000.0
SPEED = np.sqrt(MODULUS / DENSITY)
AT = 0.37
POINTS = np.linspace(0.0, LENGTH, 41)


def bar(count=60):
    modes = bp.beams.bar(count, length=LENGTH, area=AREA, youngs_modulus=MODULUS, density=DENSITY)
    return bp.Structure(modes, damping=bp.damping.Modal(0.02))


def roots(equation, up_to):
    """Angular frequencies at which an equation without poles is zero."""
    grid = np.linspace(1.0, 2 * np.pi * up_to, 4000)
    values = equation(grid)
    steps = np.flatnonzero(values[:-1] * values[1:] < 0)
    return np.array([brentq(equation, grid[step], grid[step + 1]) for step in steps])


def with_stiffness(stiffness):
    """EA k sin(kL) + Z sin(ka) sin(k(L - a)) = 0 of a fixed bar with a dynamic stiffness Z at a."""

    def equation(omega):
        k = omega / SPEED
        free = MODULUS * AREA * k * np.sin(k * LENGTH)
        return free + stiffness(omega) * np.sin(k * AT) * np.sin(k * (LENGTH - AT))

    return equation


def test_a_mass_on_a_bar_has_the_frequencies_of_its_equation():
    exact = roots(with_stiffness(lambda omega: -0.5 * omega**2), 900.0) / (2 * np.pi)
    modes = natural_modes(bar() + effects.point_mass(AT, 0.5), POINTS, 900.0, 20)
    assert len(exact) == 5
    assert np.allclose(modes.frequency, exact, rtol=1e-6)


def test_a_spring_on_a_bar_has_the_frequencies_of_its_equation():
    exact = roots(with_stiffness(lambda omega: 3e6 + 0 * omega), 900.0) / (2 * np.pi)
    modes = natural_modes(bar() + effects.ground_spring(AT, 3e6), POINTS, 900.0, 20)
    assert np.allclose(modes.frequency, exact, rtol=1e-6)


def test_an_absorber_adds_a_mode_and_no_mode_at_its_own_frequency():
    tuned, mass = 2 * np.pi * 250.0, 0.3
    absorber = effects.tuned_absorber(AT, mass, 250.0, 0.0)

    def stiffness(omega):
        return -mass * omega**2 * tuned**2

    def equation(omega):
        # Multiplied by own^2 - omega^2, so that it has no pole.
        k = omega / SPEED
        free = MODULUS * AREA * k * np.sin(k * LENGTH) * (tuned**2 - omega**2)
        return free + stiffness(omega) * np.sin(k * AT) * np.sin(k * (LENGTH - AT))

    exact = roots(equation, 900.0) / (2 * np.pi)
    modes = natural_modes(bar() + absorber, POINTS, 900.0, 20)
    assert len(modes.frequency) == 6
    assert np.allclose(modes.frequency, exact, rtol=1e-6)


def test_shapes_are_those_of_the_bar_on_both_sides_of_the_mass():
    modes = natural_modes(bar(6) + effects.point_mass(AT, 0.5), POINTS, 500.0, 20)
    assert len(modes.frequency) == 3  # of which six modes alone would be 2 % off at the mass
    for frequency, shape in zip(modes.frequency, modes.shape, strict=True):
        k = 2 * np.pi * frequency / SPEED
        left = np.sin(k * POINTS) * np.sin(k * (LENGTH - AT))
        right = np.sin(k * (LENGTH - POINTS)) * np.sin(k * AT)
        exact = np.where(POINTS < AT, left, right)
        exact /= np.abs(exact).max()
        sign = np.sign(shape[:, 0] @ exact)
        assert np.abs(sign * shape[:, 0] - exact).max() < 4e-3
        assert not shape[:, 1:].any()


def test_without_attachments_they_are_those_of_the_structure():
    structure = bar()
    modes = natural_modes(structure, POINTS, 600.0, 20)
    exact = np.asarray(structure.modes.natural_frequency)[:3]
    assert np.allclose(modes.frequency, exact, rtol=1e-8)


def test_no_mode_below_the_first_is_no_error():
    modes = natural_modes(bar(), POINTS, 10.0, 20)
    assert modes.frequency.shape == (0,)
    assert modes.shape.shape == (0, len(POINTS), 3)


@pytest.mark.parametrize("count", [4, 60])
def test_modes_left_out_are_made_up_for_by_their_flexibility(count):
    exact = roots(with_stiffness(lambda omega: -0.5 * omega**2), 300.0) / (2 * np.pi)
    modes = natural_modes(bar(count) + effects.point_mass(AT, 0.5), POINTS, 300.0, 20)
    assert np.allclose(modes.frequency, exact, rtol=1e-3)


def test_the_lowest_modes_are_kept_where_fewer_are_asked_for():
    structure = bar() + effects.point_mass(AT, 0.5)
    few, all_modes = (natural_modes(structure, POINTS, 900.0, most) for most in (2, 20))
    assert np.array_equal(few.frequency, all_modes.frequency[:2])
    assert np.array_equal(few.shape, all_modes.shape[:2])
