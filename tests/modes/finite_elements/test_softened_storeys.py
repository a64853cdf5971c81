"""Chains of storey masses one storey of which is softer, compared with a dense eigenproblem."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import eigh

import bayes_placement as bp
from bayes_placement import finite_elements

EXACT = 1e-9
STOREYS = 8
ONE, ALL = [2], list(range(STOREYS))
FURTHER = [pytest.mark.long, pytest.mark.longest]


def storeys(count, of, massless=False):
    """Stiffness and mass of a chain, the stiffness of some storeys, and its natural frequencies."""
    random = np.random.default_rng(7)
    stiffness, mass = 4e6 * (1 + random.random(count)), 1000 * (1 + random.random(count))
    if massless:  # every second floor
        mass[::2] = 0.0
    steps = np.eye(count) - np.eye(count, k=-1)
    whole = steps.T @ (stiffness[:, None] * steps)
    chosen = np.isin(np.arange(count), of)
    return whole, np.diag(mass), steps.T @ ((stiffness * chosen)[:, None] * steps)


def frequencies(stiffness, mass):
    """Natural frequencies [Hz]; without mass there is none: 1 / omega^2 are the eigenvalues."""
    flexibility, shape = eigh(mass, stiffness)
    finite = flexibility > 1e-12 * flexibility[-1]
    natural = 1 / np.sqrt(flexibility[finite][::-1]) / (2 * np.pi)
    return natural, shape[:, finite][:, ::-1] / np.sqrt(flexibility[finite][::-1])


def structure(stiffness, mass, region, kept):
    """A chain along z that moves along x, of which the lowest modes are kept."""
    count = len(mass)
    floor = np.arange(1, count + 1)
    matrices = finite_elements.Matrices(
        stiffness,
        mass,
        position=np.column_stack([0 * floor, 0 * floor, 3.0 * floor]),
        dof=np.column_stack([floor, 0 * floor + 1]),
        regions={"storey": region},
    )
    modes = finite_elements.modes(
        matrices,
        finite_elements.interpolation.nearest(matrices),
        up_to=frequencies(stiffness, mass)[0][kept - 1] * (1 + 1e-6),
    )
    return bp.Structure(modes, damping=bp.damping.Modal(0.02))


def softened(plain, loss):
    return (plain + bp.effects.region_stiffness_loss("storey", loss)).proper_modes()


def hertz(modes):
    return np.asarray(modes.angular_frequency()) / (2 * np.pi)


@pytest.mark.parametrize(
    ("kept", "of"),
    [(5, ONE), (8, ALL)]
    + [pytest.param(*case, marks=pytest.mark.long) for case in [(2, ALL), (7, ONE)]]
    + [pytest.param(*case, marks=FURTHER) for case in [(2, ONE), (5, ALL), (7, ALL), (8, ONE)]],
)
def test_no_mode_appears_that_the_structure_does_not_have(kept, of):
    """A kept mode approaches its own from above, whatever is lost; where all are kept it is it."""
    stiffness, mass, region = storeys(STOREYS, of)
    plain = structure(stiffness, mass, region, kept)
    for loss in (0.0, 0.2, 0.6):
        natural = hertz(softened(plain, loss))
        expected = frequencies(stiffness - loss * region, mass)[0][:kept]
        highest = EXACT if kept >= STOREYS - 1 or loss == 0 else 0.01
        assert len(natural) == kept
        assert (natural > (1 - EXACT) * expected).all()
        np.testing.assert_allclose(natural, expected, rtol=highest)
        np.testing.assert_allclose(natural[: kept // 2], expected[: kept // 2], rtol=1e-3)


@pytest.mark.parametrize(
    ("kept", "of"),
    [(40, ONE), pytest.param(39, list(range(39)), marks=pytest.mark.long)]
    + [pytest.param(*case, marks=FURTHER) for case in [(39, ONE), (40, list(range(39)))]],
)
def test_a_tall_frame_too(kept, of):
    """More strains than patterns, for which the modes themselves have to do."""
    stiffness, mass, region = storeys(40, of)
    plain = structure(stiffness, mass, region, kept)
    natural = hertz(softened(plain, 0.6))
    expected = frequencies(stiffness - 0.6 * region, mass)[0][:kept]
    assert (natural > (1 - EXACT) * expected).all()
    if kept == 40 or of == [2]:
        np.testing.assert_allclose(natural, expected, rtol=EXACT)
    np.testing.assert_allclose(natural[:10], expected[:10], rtol=1e-6)


@pytest.mark.parametrize("count", [8, pytest.param(40, marks=FURTHER)])
def test_rows_without_mass_bring_no_mode(count):
    """Modes that are all there are do not span motions without mass; static shapes do."""
    stiffness, mass, region = storeys(count, [2], massless=True)
    plain = structure(stiffness, mass, region, count // 2)
    for loss in (0.0, 0.6):
        expected = frequencies(stiffness - loss * region, mass)[0]
        np.testing.assert_allclose(hertz(softened(plain, loss)), expected, rtol=EXACT)


def test_the_shapes_are_those_of_the_softened_frame():
    stiffness, mass, region = storeys(STOREYS, [2])
    modes = softened(structure(stiffness, mass, region, STOREYS), 0.6)
    places = np.column_stack([np.zeros((STOREYS, 2)), 3.0 * np.arange(1, STOREYS + 1)])
    shapes = np.array([np.asarray(modes.shapes(place))[0] for place in jnp.asarray(places)])
    expected = frequencies(stiffness - 0.6 * region, mass)[1]
    np.testing.assert_allclose(np.abs(shapes), np.abs(expected), atol=1e-7)
