"""Jumps at cuts of bars and beams compared with textbooks, elements and quadrature."""

import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement import beams
from bayes_placement._shared.compiled import compiled
from bayes_placement.modes import _cuts
from tests.simulator.hermite_elements import (
    AREA,
    AXIAL,
    BENDING,
    CUT,
    DENSITY,
    LENGTH,
    MASS,
    MOMENT,
    NODES,
    READ,
    STIFFNESS,
    elements,
)

BAR = {"length": LENGTH, "area": AREA, "youngs_modulus": STIFFNESS, "density": DENSITY}
BEAM = BAR | {"second_moment": MOMENT}
PAIRS = ["-".join(p) for p in itertools.product(["fixed", "free", "pinned", "guided"], repeat=2)]
BAR_PAIRS = ["fixed-fixed", "fixed-free", "free-fixed", "free-free"]
CASES = [("bar", ends, 1) for ends in BAR_PAIRS] + [
    # Each kind of end, zero to two rigid-body modes; a jump of slope, then of deflection.
    ("beam", ends, order)
    for ends in ["fixed-free", "free-free", "pinned-fixed", "free-pinned", "guided-free"]
    for order in (2, 3)
]
FURTHER = [pytest.mark.long, pytest.mark.longest]


def is_mirrored(pair):
    """Whether the same two ends come the other way round before."""
    left, right = pair.split("-")
    return PAIRS.index(f"{right}-{left}") < PAIRS.index(pair)


PLACES, CUTS = jnp.asarray(NODES[READ]), jnp.asarray(NODES[CUT])


@functools.cache
def line(kind, ends):
    quantities = BAR if kind == "bar" else BEAM
    return getattr(beams, kind)(8, **quantities, ends=ends)


def cut(member, at, *orders):
    return _cuts.cut(member, [at] * len(orders), orders)


def table(member, order, first=PLACES, second=CUTS, derivative=0):
    """Constraint modes of cuts at the second places, read at the first."""

    return np.asarray(compiled(_table)(member, order, derivative, first, second))


def _table(member, order, derivative, first, second):
    def read(x, at):
        return _cuts.shapes(member, cut(member, at, order), x, derivative)[0]

    return jax.vmap(lambda x: jax.vmap(lambda at: read(x, at))(second))(first)


def jump_value(member, order, quantity, places=CUTS):
    """Stiffness against each jump, or its mass."""
    return np.asarray(compiled(_jump_value)(member, order, quantity, places))


def _jump_value(member, order, quantity, places):
    return jax.vmap(lambda at: quantity(member, cut(member, at, order))[0, 0])(places)


@pytest.mark.parametrize(
    ("ends", "expected"),
    [
        ("fixed-fixed", lambda x, y: (x > y) - x / LENGTH),
        ("fixed-free", lambda x, y: 1.0 * (x > y)),
        ("free-free", lambda x, y: (x > y) - 1 + y / LENGTH),
    ],
)
def test_a_cut_bar_opens_by_one(ends, expected):
    x, y = np.meshgrid(NODES[[1, 7, 11, 17, 20]], NODES[CUT[:-1]], indexing="ij")
    shapes = table(line("bar", ends), 1, jnp.asarray(x[:, 0]), CUTS[:-1])
    np.testing.assert_allclose(shapes, expected(x, y), atol=1e-10)


@pytest.mark.parametrize("ends", [pytest.param(p, marks=FURTHER * is_mirrored(p)) for p in PAIRS])
@pytest.mark.parametrize(("component", "order", "unit"), [(1, 2, LENGTH), (0, 3, 1.0)])
def test_finite_elements_open_a_cut_alike(ends, component, order, unit):
    beam = line("beam", ends)
    expected = [elements(ends).jump(node, component) for node in CUT]
    shapes = table(beam, order)
    if component == 0:
        # A node of the elements moves as what is left of the cut, the support for one at the end.
        shapes = shapes - (READ[:, None] == CUT) * np.where(CUT == 0, 1.0, 0.5)
    nodal = np.stack([jump[0][2 * READ] for jump in expected], axis=1)
    np.testing.assert_allclose(shapes / unit, nodal / unit, atol=1e-7)
    scale = BENDING * unit**2 / LENGTH**3
    stiffnesses = np.array([jump[1] for jump in expected])
    stiffness = jump_value(beam, order, _cuts.stiffness)
    np.testing.assert_allclose(stiffness / scale, stiffnesses / scale, atol=1e-4)
    masses, scale = np.array([jump[2] for jump in expected]), MASS * unit**2
    np.testing.assert_allclose(
        jump_value(beam, order, _cuts.mass) / scale, masses / scale, atol=1e-7
    )


@pytest.mark.parametrize(("kind", "ends", "order"), CASES)
def test_a_jump_is_the_internal_force_of_a_unit_force(kind, ends, order):
    member, inside = line(kind, ends), CUTS[1:]
    sign = -1 if order == 3 else 1
    force = jax.vmap(
        jax.vmap(lambda x, y: sign * member.green(x, y, (0, order)), (None, 0)), (0, None)
    )
    np.testing.assert_allclose(
        table(member, order, PLACES, inside), force(PLACES, inside), atol=1e-10
    )


@pytest.mark.parametrize(("kind", "ends", "order"), CASES)
def test_seen_from_the_other_end_a_cut_opens_the_other_way(kind, ends, order):
    turned = line(kind, "-".join(reversed(ends.split("-"))))
    sign = 1 if order == 2 else -1
    behind = table(turned, order, LENGTH - PLACES, LENGTH - CUTS)
    np.testing.assert_allclose(behind, sign * table(line(kind, ends), order), atol=1e-10 * LENGTH)


@pytest.mark.parametrize(
    ("kind", "ends", "order", "expected"),
    [
        ("bar", "fixed-fixed", 1, AXIAL / LENGTH),
        ("beam", "fixed-fixed", 2, 4 * BENDING / LENGTH),
        ("beam", "fixed-pinned", 2, 3 * BENDING / LENGTH),
        ("beam", "fixed-guided", 2, BENDING / LENGTH),
        ("beam", "fixed-fixed", 3, 12 * BENDING / LENGTH**3),
        ("beam", "fixed-pinned", 3, 3 * BENDING / LENGTH**3),
    ],
)
def test_the_stiffness_against_a_moved_support_is_that_of_textbooks(kind, ends, order, expected):
    stiffness = jump_value(line(kind, ends), order, _cuts.stiffness, jnp.zeros(1))
    np.testing.assert_allclose(stiffness, expected, rtol=1e-10)


def test_turning_a_clamp_also_takes_a_shear_force():
    # Slope-deflection equations: 6 E I / L^2 between the two.
    beam = line("beam", "fixed-fixed")
    stiffness = jax.jit(lambda: _cuts.stiffness(beam, cut(beam, 0.0, 2, 3)))()
    np.testing.assert_allclose(np.abs(stiffness[0, 1]), 6 * BENDING / LENGTH**2, rtol=1e-9)
    np.testing.assert_allclose(stiffness[1, 0], stiffness[0, 1], rtol=1e-9)


@pytest.mark.parametrize(
    "ends", ["fixed-free", "free-free", "pinned-pinned", "pinned-free", "guided-free"]
)
def test_what_is_statically_determinate_has_no_self_stress(ends):
    for order in (2, 3):
        stiffness = jump_value(line("beam", ends), order, _cuts.stiffness)
        np.testing.assert_allclose(np.abs(stiffness), 0.0, atol=1e-9 * BENDING)


def test_a_moved_support_moves_the_beam():
    cantilever = line("beam", "fixed-free")
    everywhere, root = jnp.linspace(0.0, LENGTH, 5), jnp.zeros(1)
    np.testing.assert_allclose(table(cantilever, 3, everywhere, root), 1.0, atol=1e-12)
    turned = table(cantilever, 2, everywhere, root)[:, 0]
    np.testing.assert_allclose(turned, everywhere, atol=1e-11)
    slope = table(cantilever, 2, everywhere, root, derivative=1)
    np.testing.assert_allclose(slope, 1.0, atol=1e-11)
    end = jnp.array([LENGTH])
    np.testing.assert_allclose(table(line("beam", "free-fixed"), 3, end, end), -1.0, atol=1e-12)


@pytest.mark.parametrize(
    ("kind", "ends", "orders"),
    [
        ("bar", "fixed-free", (1, 1)),
        ("bar", "free-free", (1, 1)),
        ("beam", "fixed-free", (2, 3)),
        ("beam", "free-free", (2, 2)),
        ("beam", "free-pinned", (2, 3)),
    ],
)
def test_masses_and_participations_are_products_of_shapes(kind, ends, orders):
    member, places = line(kind, ends), [0.37 * LENGTH, 0.81 * LENGTH]
    cuts = _cuts.cut(member, places, orders)
    node, weight = np.polynomial.legendre.leggauss(40)
    bounds = np.array([0.0, *places, LENGTH])  # every side of the cuts by its own rule
    sizes = np.diff(bounds)[:, None]
    x = jnp.asarray((bounds[:-1, None] + sizes * (node + 1) / 2).ravel())
    w = (sizes * weight / 2).ravel() * DENSITY * AREA
    read = jax.vmap(lambda x: (member.shapes(x)[0], _cuts.shapes(member, cuts, x)))
    phi, jumps = map(np.asarray, jax.jit(lambda: read(x))())
    rigid = member.rigid_body_modes
    participation, mass = jax.jit(
        lambda: (_cuts.participation(member, member, cuts), _cuts.mass(member, cuts))
    )()
    np.testing.assert_allclose(participation, (phi.T * w @ jumps)[rigid:], atol=1e-10)
    np.testing.assert_allclose(mass, jumps.T * w @ jumps, rtol=1e-9, atol=1e-12)
    # Openings move the structure without moving it as a rigid body.
    np.testing.assert_allclose((phi.T * w @ jumps)[:rigid], 0.0, atol=1e-10)
