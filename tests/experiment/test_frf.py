"""The modal sum converges to exact solutions by travelling waves."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement import Structure, beams, damping
from bayes_placement.experiment.frf import receptance
from bayes_placement.modes.points import Points

LENGTH, AREA, STIFFNESS, DENSITY, LOSS = 1.3, 1e-3, 1e9, 9000.0, 0.03
BAR = {"length": LENGTH, "area": AREA, "youngs_modulus": STIFFNESS, "density": DENSITY}
SENSORS, ACTUATORS = np.array([0.17, 0.90]), np.array([0.52, 0.61, 1.30])
FREQUENCY = np.array([20.0, 130.0, 333.0, 700.0])
OMEGA = 2 * np.pi * FREQUENCY
INNER = slice(0, 2)  # the last actuator sits at the end, where a sine series vanishes


def axial(places):
    return Points(jnp.asarray(places), np.ones((len(places), 1)))


@jax.jit
def between(structure, sensors, actuators, omega):
    return receptance(structure, axial(sensors), axial(actuators), omega)


def bar_by_waves(ends, omega):
    """Receptance of a bar with a complex modulus, from the solution of its wave equation."""
    modulus = STIFFNESS * (1 + 1j * LOSS)
    k = omega * np.sqrt(DENSITY / modulus)
    lower = np.minimum(SENSORS[:, None, None], ACTUATORS[None, :, None])
    upper = LENGTH - np.maximum(SENSORS[:, None, None], ACTUATORS[None, :, None])
    left = np.sin(k * lower) if ends.startswith("fixed") else np.cos(k * lower)
    right = np.sin(k * upper) if ends.endswith("fixed") else np.cos(k * upper)
    characteristic = {
        "fixed-fixed": np.sin(k * LENGTH),
        "fixed-free": np.cos(k * LENGTH),
        "free-fixed": np.cos(k * LENGTH),
        "free-free": -np.sin(k * LENGTH),
    }[ends]
    return left * right / (AREA * modulus * k * characteristic)


def error(ends, modes, static_correction=False):
    bar = beams.bar(modes, **BAR, ends=ends, static_correction=static_correction)
    structure = Structure(bar, damping=damping.Structural(LOSS))
    modal = np.asarray(between(structure, SENSORS, ACTUATORS, OMEGA))
    exact = bar_by_waves(ends, OMEGA)
    return np.max(np.abs(modal - exact)[:, INNER] / np.abs(exact)[:, INNER].max())


@pytest.mark.parametrize("ends", ["fixed-fixed", "fixed-free", "free-fixed", "free-free"])
def test_a_bar_converges_to_its_wave_solution(ends):
    coarse, fine = error(ends, 40), error(ends, 2000)
    assert fine < 2e-5
    assert fine < coarse / 20
    # The static flexibility of the modes left out does what two thousand modes do.
    assert error(ends, 40, static_correction=True) < 2e-5


def test_a_pinned_beam_converges_to_its_wave_solution():
    moment = 4e-6
    bending = STIFFNESS * (1 + 1j * LOSS) * moment
    k = (OMEGA**2 * DENSITY * AREA / bending) ** 0.25
    lower = np.minimum(SENSORS[:, None, None], ACTUATORS[None, :, None])
    upper = LENGTH - np.maximum(SENSORS[:, None, None], ACTUATORS[None, :, None])
    waves = np.sin(k * lower) * np.sin(k * upper) / np.sin(k * LENGTH)
    decaying = np.sinh(k * lower) * np.sinh(k * upper) / np.sinh(k * LENGTH)
    exact = ((waves - decaying) / (2 * bending * k**3))[:, INNER]

    def worst(modes, static_correction=False):
        beam = beams.beam(
            modes,
            **BAR,
            second_moment=moment,
            ends="pinned-pinned",
            static_correction=static_correction,
        )
        structure = Structure(beam, damping=damping.Structural(LOSS))
        modal = between(structure, SENSORS, ACTUATORS, OMEGA)[:, INNER]
        return np.max(np.abs(modal - exact) / np.abs(exact).max(axis=(0, 1)))

    fine = worst(60)
    assert fine < 2e-4
    assert fine < worst(15) / 20
    assert worst(15, static_correction=True) < 1e-4


@pytest.mark.parametrize("modes", [2, 2000])
def test_the_static_receptance_is_the_flexibility(modes):
    bar = beams.bar(modes, **BAR, ends="fixed-fixed", static_correction=modes == 2)
    structure = Structure(bar, damping=damping.Modal(0.02))
    modal = between(structure, SENSORS, ACTUATORS, jnp.zeros(1))[..., 0]
    lower = np.minimum(SENSORS[:, None], ACTUATORS)
    upper = LENGTH - np.maximum(SENSORS[:, None], ACTUATORS)
    expected = lower * upper / (LENGTH * STIFFNESS * AREA)
    tolerance = 1e-4 if modes == 2000 else 1e-14
    np.testing.assert_allclose(modal, expected, atol=tolerance * expected.max())


def test_a_free_bar_accelerates_as_its_mass():
    bar = beams.bar(60, **BAR, ends="free-free")
    structure = Structure(bar, damping=damping.Modal(0.02))
    omega = jnp.array([2 * np.pi * 0.5])
    accelerance = -(omega**2) * between(structure, SENSORS, ACTUATORS, omega)
    mass = DENSITY * AREA * LENGTH
    np.testing.assert_allclose(accelerance, 1 / mass, rtol=1e-4)


def test_one_mode_is_one_oscillator():
    bar = beams.bar(1, **BAR, ends="fixed-fixed", static_correction=False)
    structure = Structure(bar, damping=damping.Modal([0.05]))
    natural = np.pi / LENGTH * np.sqrt(STIFFNESS / DENSITY)
    modal = between(structure, SENSORS, ACTUATORS, jnp.array([natural, 0.3 * natural]))
    residue = np.outer(np.sin(np.pi * SENSORS / LENGTH), np.sin(np.pi * ACTUATORS / LENGTH))
    residue *= 2 / (DENSITY * AREA * LENGTH)
    at_resonance, below = 1 / (2j * 0.05), 1 / (1 - 0.09 + 2j * 0.05 * 0.3)
    expected = residue[..., None] / natural**2 * np.array([at_resonance, below])
    np.testing.assert_allclose(modal, expected, rtol=1e-10, atol=1e-20)


def test_the_amplitude_at_half_power_gives_the_damping_ratio():
    ratio = 0.02
    modes = beams.bar(1, **BAR, static_correction=False)
    structure = Structure(modes, damping=damping.Modal([ratio]))
    natural = np.pi / LENGTH * np.sqrt(STIFFNESS / DENSITY)
    omega = jnp.linspace(0.9, 1.1, 4001) * natural
    power = np.abs(between(structure, SENSORS[:1], SENSORS[:1], omega)[0, 0]) ** 2
    above = np.asarray(omega)[power > power.max() / 2]
    np.testing.assert_allclose((above[-1] - above[0]) / natural, 2 * ratio, rtol=5e-3)
