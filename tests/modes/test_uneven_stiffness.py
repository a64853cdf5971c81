"""Uneven stiffness: shares of strain energy, modes beside finite elements, a closed form."""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.modes.uneven_stiffness import energy_shares, with_uneven_stiffness
from tests.benchmarks.imperfect_experiments import plate_modes
from tests.in_space import Linear
from tests.simulator.imperfect_scenes import Sizes, drawn, elastic

PIECES = 12
ONLY_STIFFNESS = Sizes(stiffness=0.04, mass=0.0, damping=0.0, gain=0.0)


def line(kind, ends, modes=24):
    section = {"beam": {"radius_of_gyration": 0.01}}.get(kind, {})
    values = {"length": 0.8, "area": 1e-4, "youngs_modulus": 70e9, "density": 2700.0}
    return getattr(bp.beams, kind)(**values, **section, ends=ends, modes=modes)


@functools.cache
def scene(form):
    """A structure whose stiffness alone is uneven, and its model of the same material."""
    flawed = drawn((5, 0), form, ONLY_STIFFNESS)
    material = {name: getattr(flawed.true, name) for name in ("youngs_modulus", "density")}
    return flawed.true, replace(flawed.nominal, **material)


@functools.cache
def modes(form):
    """Modes of the model."""
    _, even = scene(form)
    if form == "plate":
        return plate_modes(even)
    values = {name: getattr(even, name) for name in ("length", "area", "youngs_modulus", "density")}
    section = {} if form == "bar" else {"second_moment": even.second_moment}
    return getattr(bp.beams, form)(**values, **section, ends=even.ends, modes=30)


def uneven(even, factors):
    shares = energy_shares(even, len(factors))
    return with_uneven_stiffness(even, jnp.tensordot(jnp.array(factors) - 1, shares, 1))


@pytest.mark.parametrize("form", ["bar", "beam", "plate"])
def test_shares_of_all_pieces_are_the_entire_strain_energy(form):
    even = modes(form)
    rigid = even.rigid_body_modes
    total = energy_shares(even, PIECES).sum(axis=0)
    np.testing.assert_allclose(total[rigid:, rigid:], np.eye(30 - rigid), atol=1e-9)
    np.testing.assert_array_equal(total[:rigid], 0.0)


@pytest.mark.parametrize("kind, ends", [("bar", "free-free"), ("beam", "fixed-pinned")], ids=str)
def test_few_pieces_of_many_half_waves_are_integrated_exactly(kind, ends):
    even = line(kind, ends, modes=40)
    rigid = even.rigid_body_modes
    total = energy_shares(even, 2).sum(axis=0)[rigid:, rigid:]
    np.testing.assert_allclose(total, np.eye(len(total)), atol=1e-9)


@pytest.mark.parametrize("form", ["bar", "beam", "plate"])
def test_natural_frequencies_are_those_of_finite_elements(form):
    """The span of the kept modes is stiffer than the structure, by little."""
    true, even = scene(form)
    rigid = modes(form).rigid_body_modes
    count = 10
    before = np.asarray(modes(form).natural_frequency)[rigid : rigid + count]
    after = np.asarray(uneven(modes(form), true.pieces).natural_frequency)[rigid : rigid + count]
    expected = elastic(true)[:count] / elastic(even)[:count]
    excess = after / before - expected
    assert np.ptp(expected) > 1e-3
    assert np.all(excess > -1e-5) and np.all(excess < 3e-4)


def test_static_flexibility_is_the_sum_of_the_pieces_in_series():
    """A fixed bar pulled at its end stretches by the sum of L / (N E A) over its pieces."""
    even = line("bar", "fixed-free", modes=60)
    factors = np.exp(0.04 * np.random.default_rng(2).standard_normal(6))
    changed = uneven(even, factors)
    end = jnp.asarray(0.8)
    expected = np.mean(1 / factors) * 0.8 / (70e9 * 1e-4)
    np.testing.assert_allclose(changed.static_flexibility(end, end)[0, 0], expected, rtol=2e-4)


def test_without_excess_nothing_changes_by_a_bit():
    even = line("bar", "fixed-free")
    same = with_uneven_stiffness(even, jnp.zeros((24, 24)))
    at = jnp.asarray(0.3)
    np.testing.assert_array_equal(same.shapes(at), even.shapes(at))
    np.testing.assert_allclose(same.natural_frequency, even.natural_frequency, rtol=1e-15)


def test_one_factor_everywhere_scales_every_eigenvalue():
    """Also of a structure that a crack, which is no piece, has softened a little."""
    crack = bp.effects.local_stiffness_loss(0.3, extent=0.02, loss=0.2)
    structure = bp.Structure(line("beam", "free-free"), damping=bp.damping.Modal(0.01))
    cracked = (structure + crack).proper_modes()
    both = uneven(cracked, [1.01] * PIECES)
    growth = (both.natural_frequency / cracked.natural_frequency)[2:8] - 1
    # What the crack adds to the span of the modes is left out: 2 % of the change at most here.
    np.testing.assert_allclose(growth, np.sqrt(1.01) - 1, rtol=0.02)
    assert not np.allclose(cracked.natural_frequency[2:8], structure.modes.natural_frequency[2:8])


def test_pieces_of_shapes_alone_are_unknown():
    assert energy_shares(Linear(), PIECES) is None


def test_slopes_in_the_excess_are_those_of_differences():
    even = line("bar", "fixed-free")
    shares = jnp.asarray(energy_shares(even, 4))

    def frequency(excess):
        return with_uneven_stiffness(even, jnp.tensordot(excess, shares, 1)).natural_frequency[2]

    at = jnp.array([0.03, -0.02, 0.01, 0.04])
    slope = jax.grad(frequency)(at)
    steps = 1e-5 * jnp.eye(4)
    differences = [(frequency(at + step) - frequency(at - step)) / 2e-5 for step in steps]
    np.testing.assert_allclose(slope, differences, rtol=1e-6)
