"""Uneven pieces: shares of energy, modes beside finite elements, a closed form."""

import functools
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.linalg

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.errors import InputError
from bayes_placement.modes.finite_elements._part_factors import (
    NamedMatrices,
    _cells,
    checked_cell_masses,
)
from bayes_placement.modes.uneven_pieces import Excess, piece_shares, with_uneven_pieces
from tests.in_space import Linear
from tests.meshed_plates import CELLS, plate_modes
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


def uneven(even, stiffness=1.0, mass=1.0, pieces=PIECES, count=60):
    shares = piece_shares(even, pieces, count)
    pairs = zip((stiffness, mass), shares, strict=True)
    sums = (np.tensordot(np.broadcast_to(f, len(share)) - 1, share, 1) for f, share in pairs)
    return compiled(with_uneven_pieces)(even, Excess(*map(jnp.asarray, sums)))


@pytest.mark.parametrize("form", ["bar", "beam", "plate"])
def test_shares_of_all_pieces_are_the_entire_energy(form):
    even = modes(form)
    rigid = even.rigid_body_modes
    stiffness, mass = (share.sum(axis=0) for share in piece_shares(even, PIECES, 30))
    np.testing.assert_allclose(stiffness[rigid:, rigid:], np.eye(30 - rigid), atol=1e-9)
    np.testing.assert_array_equal(stiffness[:rigid], 0.0)
    np.testing.assert_allclose(mass, np.eye(30), atol=1e-9)


@pytest.mark.parametrize("kind, ends", [("bar", "free-free"), ("beam", "fixed-pinned")], ids=str)
def test_few_pieces_of_many_half_waves_are_integrated_exactly(kind, ends):
    even = line(kind, ends, modes=40)
    rigid = even.rigid_body_modes
    stiffness, mass = (share.sum(axis=0) for share in piece_shares(even, 2, 40))
    np.testing.assert_allclose(stiffness[rigid:, rigid:], np.eye(40 - rigid), atol=1e-9)
    np.testing.assert_allclose(mass, np.eye(40), atol=1e-9)


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


def test_modes_above_those_that_mix_stay_as_they_are():
    even = modes("bar")
    few, all_mixed = (uneven(even, scene("bar")[0].pieces, count=count) for count in (20, 60))
    after, expected = few.natural_frequency, all_mixed.natural_frequency
    np.testing.assert_array_equal(after[20:], uneven(even, count=20).natural_frequency[20:])
    change = np.abs(expected[:10] / even.natural_frequency[:10] - 1)
    assert np.all(np.abs(after[:10] / expected[:10] - 1) < 0.05 * np.max(change))
    at = jnp.asarray(0.3)
    np.testing.assert_array_equal(few.shapes(at)[:, 20:], even.shapes(at)[:, 20:])


def test_static_flexibility_is_the_sum_of_the_pieces_in_series():
    """A fixed bar pulled at its end stretches by the sum of L / (N E A) over its pieces."""
    even = line("bar", "fixed-free", modes=60)
    factors = np.exp(0.04 * np.random.default_rng(2).standard_normal(6))
    changed = uneven(even, factors, pieces=6)
    end = jnp.asarray(0.8)
    expected = np.mean(1 / factors) * 0.8 / (70e9 * 1e-4)
    np.testing.assert_allclose(changed.static_flexibility(end, end)[0, 0], expected, rtol=2e-4)


def test_without_excess_nothing_changes_by_a_bit():
    even = line("bar", "fixed-free")
    same = uneven(even)
    at = jnp.asarray(0.3)
    np.testing.assert_array_equal(same.shapes(at), even.shapes(at))
    np.testing.assert_allclose(same.natural_frequency, even.natural_frequency, rtol=1e-15)


@pytest.mark.long
def test_one_factor_everywhere_scales_every_eigenvalue():
    """Also of a structure that a crack, which is no piece, has softened a little."""
    crack = bp.effects.local_stiffness_loss(0.3, extent=0.02, loss=0.2)
    structure = bp.Structure(line("beam", "free-free"), damping=bp.damping.Modal(0.01))
    cracked = (structure + crack).proper_modes()
    changed = (cracked, uneven(cracked, stiffness=1.01), uneven(cracked, mass=1.01))
    frequencies = jax.jit(lambda: [modes.natural_frequency[2:8] for modes in changed])()
    # What the crack adds to the span of the modes is left out: 2 % of the change at most here.
    for frequency, expected in zip(
        frequencies[1:], (np.sqrt(1.01), np.sqrt(1 / 1.01)), strict=True
    ):
        np.testing.assert_allclose(frequency / frequencies[0] - 1, expected - 1, rtol=0.02)
    assert not np.allclose(frequencies[0], structure.modes.natural_frequency[2:8])


def test_without_regions_cells_mix_modes_much_as_patches_of_stiffness_do():
    """Cells leave at most 15 % of what uneven patches of a plate do between its lowest modes."""
    given = modes("plate")
    whole = eqx.tree_at(lambda plate: plate.regions, given, NamedMatrices.of({}, 30))
    lowest = np.triu_indices(8)
    patches, cells = (
        piece_shares(plate, PIECES, 8).stiffness[:, *lowest].T for plate in (given, whole)
    )
    mixed = patches @ np.random.default_rng(6).standard_normal((PIECES, 50))
    left = mixed - cells @ np.linalg.lstsq(cells, mixed, rcond=1e-6)[0]
    assert np.linalg.norm(left) < 0.15 * np.linalg.norm(mixed)
    np.testing.assert_allclose(cells.sum(axis=1), np.eye(8)[lowest], atol=1e-9)


def test_pieces_of_shapes_alone_are_unknown():
    assert piece_shares(Linear(), PIECES, 3) is None


def linear_elements(factors, count=600):
    """First natural frequencies [Hz] of a fixed-free bar of 0.8 m, in linear elements."""
    size, density = 0.8 / count, 2700.0 * np.repeat(factors, count // len(factors))
    tied = np.array([[1.0, -1.0], [-1.0, 1.0]]) / size * 70e9
    moving = np.array([[2.0, 1.0], [1.0, 2.0]]) * size / 6
    stiffness, mass = np.zeros((2, count + 1, count + 1))
    for element in range(count):
        ends = np.ix_([element, element + 1], [element, element + 1])
        stiffness[ends] += tied
        mass[ends] += density[element] * moving
    squares = scipy.linalg.eigh(
        stiffness[1:, 1:], mass[1:, 1:], eigvals_only=True, subset_by_index=[0, 7]
    )
    return np.sqrt(squares) / (2 * np.pi)


def test_uneven_mass_is_that_of_finite_elements():
    factors = np.exp(0.04 * np.random.default_rng(3).standard_normal(6))
    even = line("bar", "fixed-free", modes=40)
    expected = linear_elements(factors) / linear_elements(np.ones(6))
    after = uneven(even, mass=factors, pieces=6).natural_frequency[:8]
    np.testing.assert_allclose(after / even.natural_frequency[:8], expected, atol=1e-5)
    assert np.ptp(expected) > 5e-3


def test_a_cell_has_the_mass_about_its_nodes():
    """Of the first mode of a plate, by the nearest node of each of many places."""
    _, even = scene("plate")
    shares = piece_shares(modes("plate"), PIECES, 30).mass
    sides = zip((even.length, even.width), CELLS, strict=True)
    x, y = (np.linspace(0.0, size, count + 1) for size, count in sides)
    nodes = np.stack([axis.ravel() for axis in np.meshgrid(x, y, indexing="ij")], axis=1)
    cell = _cells(np.pad(nodes, [(0, 0), (0, 1)]))
    at = (np.arange(800) + 0.5) / 800
    density = np.outer(*(2 * np.sin(np.pi * at) ** 2 for _ in range(2))) / 800**2
    nearest = [np.rint(at * count).astype(int) for count in CELLS]
    cell_at = cell.reshape(x.size, y.size)[np.ix_(*nearest)]
    expected = [np.sum(density[cell_at == number]) for number in range(36)]
    # Elements share out their mass by what their nodes move, not by what is nearest.
    np.testing.assert_allclose(shares[:, 0, 0], expected, atol=0.003)
    assert np.max(expected) < 0.15


def test_cells_are_as_long_where_a_mesh_is_fine_as_elsewhere():
    along = np.concatenate([np.linspace(0.0, 0.5, 1000), np.linspace(0.5, 1.0, 100)[1:]])
    nodes = along[:, None] * [1.0, 0.2, 0.0]
    cell = _cells(nodes)
    lengths = [np.ptp(along[cell == number]) for number in range(36)]
    assert cell.max() == 35 and max(lengths) < 0.04 and min(lengths) > 0.005
    assert len(np.unique(_cells(np.repeat(nodes[:5], 3, axis=0)))) == 5


@pytest.mark.parametrize("wrong", [np.eye(3), np.zeros((4, 3, 3)), np.zeros((0, 5, 5))])
def test_masses_of_cells_are_over_the_modes(wrong):
    np.testing.assert_array_equal(checked_cell_masses(None, 5), np.eye(5)[None])
    with pytest.raises(InputError, match=r"\[cell, 5, 5\] is needed"):
        checked_cell_masses(wrong, 5)


@pytest.mark.long
def test_slopes_in_the_excess_are_those_of_differences():
    even = line("bar", "fixed-free")
    shares = piece_shares(even, 4, 24)

    def frequency(excess):
        sums = (jnp.tensordot(excess, share, 1) for share in (shares.stiffness, shares.mass[::-1]))
        return with_uneven_pieces(even, Excess(*sums)).natural_frequency[2]

    at = jnp.array([0.03, -0.02, 0.01, 0.04])
    slope = jax.jit(jax.grad(frequency))(at)
    steps = 1e-5 * jnp.eye(4)
    above, below = jax.jit(jax.vmap(frequency))(
        jnp.stack([at + steps, at - steps]).reshape(8, 4)
    ).reshape(2, 4)
    differences = (above - below) / 2e-5
    np.testing.assert_allclose(slope, differences, rtol=1e-6)
