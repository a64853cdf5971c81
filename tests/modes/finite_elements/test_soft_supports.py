"""Beams and plates on springs in closed form, patterns of edges, and refusals."""

import jax
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.optimize import brentq

import bayes_placement as bp
from bayes_placement import effects, finite_elements
from bayes_placement.modes.finite_elements import interpolation, soft_supports
from tests.simulator import space_frames
from tests.small_models import POISSON, Plate

BAR, LENGTH, ELEMENTS = space_frames.RoundBar(), 0.7, 10
SKEW = np.array([2.0, -1.0, 2.0]) / 3
SIDES = (0.4, 0.3)


@pytest.fixture(scope="module")
def cantilever():
    """Along no axis, clamped at its first node."""
    position, elements = space_frames.line(np.zeros(3), LENGTH * SKEW, ELEMENTS)
    model = space_frames.matrices(position, elements, BAR)
    return bp.finite_elements.Matrices(**model, fixed=np.arange(6)), elements


@pytest.fixture(scope="module")
def plate():
    return bp.finite_elements.Matrices(**Plate((8, 6), SIDES).model())


def natural(modes, effect, count):
    base = bp.Structure(modes, damping=bp.damping.Modal(0.01)) + effect
    return np.asarray(jax.jit(lambda: base.proper_modes().natural_frequency)()[:count])


@pytest.mark.parametrize("softness", [0.1, 3.0])
def test_a_clamped_beam_on_a_rotational_spring(cantilever, softness):
    matrices, elements = cantilever
    foot = soft_supports.rotations(matrices, 1, along=SKEW)
    modes = finite_elements.modes(
        matrices, interpolation.frame(matrices, elements), up_to=3000.0, soft={"root": foot}
    )
    rigidity = BAR.youngs_modulus * BAR.moment
    frequencies = natural(modes, effects.soft_support("root", softness * LENGTH / rigidity), 4)
    waves = np.array([root_of_beam(softness, low) for low in (0.1, np.pi)])
    speed = np.sqrt(rigidity / (BAR.density * BAR.area)) / (2 * np.pi * LENGTH**2)
    # Two planes of bending, both of them alike.
    np.testing.assert_allclose(frequencies, np.repeat(waves**2 * speed, 2), rtol=2e-4)


def root_of_beam(softness, low):
    """Wave number times length; softness is compliance times rigidity over length."""

    def characteristic(x):
        bending = np.sin(x) * np.cosh(x) - np.cos(x) * np.sinh(x)
        return 1 + np.cos(x) * np.cosh(x) - softness * x * bending

    return brentq(characteristic, low, low + np.pi - 0.2)


@pytest.mark.parametrize("compliance", [1e-6, 1e-5])
def test_a_plate_with_one_edge_on_a_line_spring(plate, compliance):
    edge = soft_supports.edge(plate, (SIDES[0], 0.0, 0.0), (SIDES[0], SIDES[1], 0.0))
    small = Plate((8, 6), SIDES)
    modes = finite_elements.modes(
        plate,
        interpolation.plate(plate, small.mesh.t.T.astype(int)),
        up_to=3000.0,
        soft={"far": edge},
    )
    frequency = natural(modes, effects.soft_support("far", compliance), 1)[0]
    np.testing.assert_allclose(frequency, levy(small, compliance), rtol=1e-3)
    assert frequency < 0.97 * small.navier(1)[0]


def levy(small, compliance):
    """First natural frequency [Hz] with a half wave between the two held edges.

    Leissa, Vibration of Plates, NASA SP-160, section 4.2; the far edge carries the effective shear.
    """
    wave, a = np.pi / small.size[1], small.size[0]

    def characteristic(frequency):
        square = 2 * np.pi * frequency * np.sqrt(small.area_mass / small.rigidity)
        rows = []
        for number in (np.sqrt(square + wave**2 + 0j), 1j * np.sqrt(square - wave**2 + 0j)):
            value, slope = np.sinh(number * a) / number, np.cosh(number * a)
            moment = (number**2 - POISSON * wave**2) * value
            shear = (number**2 - (2 - POISSON) * wave**2) * slope
            rows.append([moment, small.rigidity * shear - value / compliance])
        return np.linalg.det(np.array(rows)).real

    trial = np.linspace(20.0, small.navier(1)[0], 400)
    values = np.array([characteristic(value) for value in trial])
    first = np.flatnonzero(np.diff(np.sign(values)))[0]
    return brentq(characteristic, *trial[first : first + 2])


def test_an_edge_stores_the_energy_of_its_deflection(plate):
    # An edge between two others of the same support stays at both ends: w = x (a - x) (1 + x).
    edge = soft_supports.edge(plate, (0.0, 0.0, 0.0), (SIDES[0], 0.0, 0.0))
    w = np.polynomial.Polynomial([0.0, SIDES[0], SIDES[0] - 1, -1.0])
    expected = (w**2).integ()(SIDES[0])
    np.testing.assert_allclose(energy(plate, edge, w), expected, rtol=1e-12)


def energy(matrices, edge, w):
    """Twice the strain energy of a line spring of 1 N/m per metre."""
    number, direction = matrices.dof[edge.rows].T
    x = matrices.position[np.searchsorted(matrices.node, number), 0]
    # Along x the slope of the deflection turns against y.
    moved = np.where(direction == 3, w(x), -w.deriv()(x))
    ways = np.linalg.solve(edge.motion, moved)
    return ways @ edge.pattern @ ways


def test_an_edge_held_by_itself_moves_at_its_ends_too():
    small = Plate((8, 6), SIDES)
    fixed_rows = small.fixed[np.isin(small.dof[small.fixed, 1], [3, 5])]
    number = small.dof[fixed_rows, 0]
    matrices = bp.finite_elements.Matrices(
        **{**small.model(), "fixed": fixed_rows[np.isclose(small.position[number - 1, 1], 0.0)]}
    )
    edge = soft_supports.edge(matrices, (0.0, 0.0, 0.0), (SIDES[0], 0.0, 0.0))
    w = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0])
    expected = (w**2).integ()(SIDES[0])
    np.testing.assert_allclose(energy(matrices, edge, w), expected, rtol=1e-12)


def test_a_foot_does_not_twist(cantilever):
    foot = soft_supports.rotations(cantilever[0], 1, along=SKEW)
    assert foot.motion.shape == (3, 2)
    np.testing.assert_allclose(foot.motion.T @ SKEW, 0.0, atol=1e-12)
    np.testing.assert_allclose(foot.motion.T @ foot.motion, np.eye(2), atol=1e-12)


def test_what_nothing_holds_cannot_give_way(cantilever, plate):
    matrices = cantilever[0]
    with pytest.raises(ValueError, match=r"row 8, which is free.*rows of matrices.fixed"):
        soft_supports.springs(matrices, [0, 8])
    with pytest.raises(ValueError, match=r"node 3, at which no rotation is held"):
        soft_supports.rotations(matrices, 3)
    with pytest.raises(ValueError, match=r"0 nodes are held in direction 3; at least two"):
        soft_supports.edge(plate, (0.05, 0.01, 0.0), (0.3, 0.01, 0.0))


def test_a_support_whose_name_cannot_be_printed_is_refused(cantilever):
    matrices, elements = cantilever
    foot = {"ro\not": soft_supports.rotations(matrices, 1, along=SKEW)}
    reading = interpolation.frame(matrices, elements)
    with pytest.raises(ValueError, match=r"A support of the name 'ro.*t' was given; a name"):
        finite_elements.modes(matrices, reading, up_to=3000.0, soft=foot)


def test_the_prior_of_a_clamp_that_a_cantilever_follows_without_strain(cantilever):
    """Its inertia resists: a rotation by 1 at the first natural frequency of a clamped beam."""
    matrices, elements = cantilever
    foot = soft_supports.rotations(matrices, 1, along=SKEW)
    modes = finite_elements.modes(
        matrices,
        interpolation.frame(matrices, elements),
        up_to=3000.0,
        soft={"root": foot},
        youngs_modulus=dist.Uniform(0.9, 1.1),
    )
    experiment = bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.01)),
        sensors=[bp.Sensor("s1", at=tuple(LENGTH * SKEW), directions=(1,))],
        actuators=[bp.Actuator("a1", at=tuple(0.5 * LENGTH * SKEW), directions=(1,))],
        frequency=np.linspace(10.0, 500.0, 10),
        observe=bp.observe.Complex("acceleration"),
        noise=None,
    )
    (suggested,) = effects.soft_support.suggest(bp.effects.Scales(experiment))
    rigidity = BAR.youngs_modulus * BAR.moment
    stiffness = 1.875104**4 / 3 * rigidity / LENGTH
    np.testing.assert_allclose(suggested.compliance.high, 10 / stiffness, rtol=0.05)
    np.testing.assert_allclose(suggested.compliance.low, 1e-6 / stiffness, rtol=0.05)
