"""General laws of receptances hold for every structure with every damping law."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement import Structure, beams, damping
from bayes_placement._shared.compiled import compiled
from bayes_placement.experiment.frf import receptance
from bayes_placement.modes.points import Points

LENGTH = 1.3
BAR = {"length": LENGTH, "area": 1e-3, "youngs_modulus": 1e9, "density": 9000.0}
BEAM = BAR | {"second_moment": 4e-6}
MODES = 6

# No symmetric place, no resonance hit exactly: symmetric targets hide sign bugs.
PLACES = np.array([0.17, 0.61, 1.19])
OTHERS = np.array([0.08, 0.44, 0.90])
OMEGA = 2 * np.pi * np.array([7.0, 90.0, 333.0, 1210.0])

STRUCTURES = {
    "bar free-fixed": lambda: beams.bar(MODES, **BAR, ends="free-fixed"),
    "bar free-free": lambda: beams.bar(MODES, **BAR, ends="free-free"),
    "beam fixed-free": lambda: beams.beam(MODES, **BEAM, ends="fixed-free"),
    "beam free-free": lambda: beams.beam(MODES, **BEAM, ends="free-free"),
    "beam pinned-fixed": lambda: beams.beam(MODES, **BEAM, ends="pinned-fixed"),
}
# A number for each field of a damping law, by its unit.
NUMBERS = {"1": 0.04, "1/s": 3.0, "s": 2e-6}


def example(law):
    """A law of the registry with numbers that are small."""
    if law is damping.Modal:
        return law([0.01, 0.03, 0.02, 0.05])
    return law(*(NUMBERS[field.metadata["unit"]] for field in dataclasses.fields(law)))


LAWS = {law.__name__.lower(): example(law) for law in damping.LAWS}
MIRRORED = {
    "bar free-fixed": "fixed-free",
    "beam fixed-free": "free-fixed",
    "beam pinned-fixed": "fixed-pinned",
}

PLAIN = "beam fixed-free"
"""Every damping law is tried on this one; on the others one, and all in long tests."""


def pairs():
    for shape in STRUCTURES:
        for number, law in enumerate(LAWS):
            marks = [] if shape == PLAIN or number == 0 else [pytest.mark.long]
            yield pytest.param((shape, law), marks=marks, id=f"{shape} {law}")


table = pytest.mark.parametrize("pair", list(pairs()))


def read(structure, sensors, actuators, omega):
    return compiled(read_from)(structure, *map(jnp.asarray, (sensors, actuators, omega)))


def read_from(structure, sensors, actuators, omega):
    return receptance(structure, along(sensors), along(actuators), omega)


def along(places):
    return Points(jnp.asarray(places), np.ones((len(places), 1)))


@functools.cache
def structure(pair):
    return Structure(STRUCTURES[pair[0]](), damping=LAWS[pair[1]])


@functools.cache
def response(pair):
    """Receptance [sensor, actuator, frequency] in all places, then its mirror in frequency."""
    omega = np.concatenate([OMEGA, -OMEGA])
    every = np.concatenate([PLACES, OTHERS])
    return np.asarray(jax.jit(read)(structure(pair), every, every, omega))


STEP = 1e-6


@functools.cache
def neighbours(pair):
    """Receptance and its slopes in both places: there, and a step to either side of each."""

    def pair_response(place, other):
        return read(structure(pair), place[None], other[None], OMEGA)[0, 0]

    slopes = jax.jacfwd(pair_response, argnums=(0, 1))
    every = jax.jit(jax.vmap(lambda s, a: (pair_response(s, a), *slopes(s, a))))
    steps = STEP * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])[:, :, None]
    places, others = PLACES + steps[:, 0], OTHERS + steps[:, 1]
    return [np.asarray(v).reshape(5, 3, -1) for v in every(places.ravel(), others.ravel())]


@table
def test_receptance_is_symmetric(pair):
    receptances = response(pair)
    size = np.abs(receptances).max(axis=(0, 1))
    np.testing.assert_allclose(
        receptances / size, np.swapaxes(receptances, 0, 1) / size, atol=1e-14
    )


@table
def test_negative_frequencies_are_conjugate(pair):
    ahead, behind = np.split(response(pair), 2, axis=-1)
    np.testing.assert_array_equal(behind, np.conj(ahead))


@table
def test_damping_dissipates_at_every_driving_point(pair):
    driving = np.diagonal(response(pair)[..., : OMEGA.size])
    assert np.all(driving.imag < 0)
    # Any set of forces together: the imaginary part is negative semi-definite.
    imaginary = np.moveaxis(response(pair)[..., : OMEGA.size].imag, -1, 0)
    eigenvalues = np.linalg.eigvalsh(imaginary)
    size = np.abs(eigenvalues).max(axis=1)
    assert np.all(eigenvalues.max(axis=1) < 1e-12 * size)


@table
def test_the_order_of_modes_is_of_no_consequence(pair):
    base = structure(pair)
    rigid = base.modes.rigid_body_modes
    order = [*range(rigid), *(rigid + np.random.default_rng(3).permutation(MODES - rigid))]
    changes = {"wave_numbers": tuple(base.modes.wave_numbers[i] for i in order)}
    if isinstance(base.modes, beams.UniformBeam):
        changes["coefficients"] = tuple(base.modes.coefficients[i] for i in order)
    law = base.damping
    if isinstance(law, damping.Modal):
        law = damping.Modal(law.ratios(MODES, rigid)[np.array(order[rigid:])])
    shuffled = Structure(dataclasses.replace(base.modes, **changes), damping=law)
    receptances = read(shuffled, PLACES, OTHERS, OMEGA)
    expected = response(pair)[:3, 3:, : OMEGA.size]
    np.testing.assert_allclose(receptances, expected, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("shape", MIRRORED)
def test_seen_from_the_other_end_nothing_changes(shape, law):
    make = beams.beam if shape.startswith("beam") else beams.bar
    quantities = BEAM if make is beams.beam else BAR
    turned = Structure(make(MODES, **quantities, ends=MIRRORED[shape]), damping=LAWS[law])
    receptances = read(turned, LENGTH - PLACES, LENGTH - OTHERS, OMEGA)
    expected = response((shape, law))[:3, 3:, : OMEGA.size]
    np.testing.assert_allclose(receptances, expected, atol=1e-9 * np.abs(expected).max())


@table
def test_vmap_equals_loop(pair):
    looped = [response(pair)[i, 3 + i, : OMEGA.size] for i in range(3)]
    np.testing.assert_allclose(neighbours(pair)[0][0], looped, rtol=1e-9)


@table
def test_jit_equals_no_jit(pair):
    every = jnp.concatenate([PLACES, OTHERS])
    omega = jnp.concatenate([OMEGA, -OMEGA])
    receptances = read(structure(pair), every, every, omega)
    size = np.abs(response(pair)).max()
    np.testing.assert_allclose(receptances, response(pair), rtol=1e-10, atol=1e-13 * size)


@table
def test_gradients_in_position_are_those_of_finite_differences(pair):
    value, by_sensor, by_actuator = neighbours(pair)
    size = np.abs(value[0])
    for gradient, ahead, behind in [(by_sensor, 1, 2), (by_actuator, 3, 4)]:
        differences = (value[ahead] - value[behind]) / (2 * STEP)
        np.testing.assert_allclose(gradient[0] / size, differences / size, rtol=1e-5, atol=1e-6)
        # C1: the slope itself does not jump over the step.
        np.testing.assert_allclose(
            gradient[ahead], gradient[behind], rtol=1e-2, atol=1e-2 * size.min()
        )


@pytest.mark.parametrize("law", LAWS)
def test_the_static_loss_is_that_of_modes_far_above(law):
    high, omega = jnp.array([1e9]), jnp.asarray(np.concatenate([OMEGA, -OMEGA]))
    expected = np.asarray(LAWS[law].loss(high, omega, 0))[0] / high[0] ** 2
    np.testing.assert_allclose(LAWS[law].static_loss(omega), expected, atol=1e-6)


@pytest.mark.parametrize("shape", STRUCTURES)
def test_hardly_any_damping_is_the_same_by_every_law(shape):
    laws = [damping.Modal(1e-12), damping.Rayleigh(1e-12, 1e-18), damping.Structural(1e-12)]
    modes = structure((shape, "modal")).modes
    undamped, *others = [read(Structure(modes, damping=law), PLACES, OTHERS, OMEGA) for law in laws]
    assert np.all(np.abs(undamped.imag) < 1e-9 * np.abs(undamped).max())
    for other in others:
        np.testing.assert_allclose(other, undamped, atol=1e-9 * np.abs(undamped).max())
