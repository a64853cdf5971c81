"""Closed forms of static deflections compared with textbooks and finite elements."""

import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement import beams
from tests.simulator.hermite_elements import (
    AREA,
    AXIAL,
    BENDING,
    CUT,
    DENSITY,
    LENGTH,
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
CASES = [("bar", ends) for ends in BAR_PAIRS] + [
    # Each kind of end, zero to two rigid-body modes; finite elements tie the others to these.
    ("beam", ends)
    for ends in ["fixed-free", "free-free", "pinned-fixed", "free-pinned", "guided-free"]
]
PLACES, CUTS = jnp.asarray(NODES[READ]), jnp.asarray(NODES[CUT])


@functools.cache
def line(kind, ends):
    quantities = BAR if kind == "bar" else BEAM
    return getattr(beams, kind)(8, **quantities, ends=ends)


def flexibility(member, derivative=0):
    """Displacement (or slope) at a position under a unit force at another."""
    return lambda x, y: member.green(x, y, (derivative, 0)) / member.stiffness


def table(function, first=PLACES, second=CUTS):
    return np.asarray(jax.vmap(lambda x: jax.vmap(lambda y: function(x, y))(second))(first))


def close(result, expected, tolerance=1e-10):
    np.testing.assert_allclose(result, expected, atol=tolerance * np.abs(expected).max(), rtol=0)


# Deflections that textbooks print.


@pytest.mark.parametrize(
    ("ends", "position", "expected"),
    [
        ("fixed-free", LENGTH, LENGTH**3 / 3 / BENDING),
        ("free-fixed", 0.0, LENGTH**3 / 3 / BENDING),
        ("fixed-fixed", LENGTH / 2, LENGTH**3 / 192 / BENDING),
        ("pinned-pinned", LENGTH / 2, LENGTH**3 / 48 / BENDING),
        ("fixed-pinned", LENGTH / 2, 7 * LENGTH**3 / 768 / BENDING),
        ("fixed-guided", LENGTH, LENGTH**3 / 12 / BENDING),
        ("free-free", 0.0, LENGTH**3 / 105 / BENDING),  # inertia relief, end on end
    ],
)
def test_beams_bend_as_in_textbooks(ends, position, expected):
    at = jnp.asarray(position)
    deflection = line("beam", ends).static_flexibility(at, at)[0, 0]
    np.testing.assert_allclose(deflection, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("ends", "expected"),
    [
        ("fixed-free", lambda x, y: np.minimum(x, y)),
        ("free-fixed", lambda x, y: LENGTH - np.maximum(x, y)),
        ("fixed-fixed", lambda x, y: np.minimum(x, y) * (1 - np.maximum(x, y) / LENGTH)),
        (
            "free-free",
            lambda x, y: (x**2 + y**2) / (2 * LENGTH) - np.maximum(x, y) + LENGTH / 3,
        ),
    ],
)
def test_bars_stretch_as_in_textbooks(ends, expected):
    x, y = np.meshgrid(PLACES, CUTS, indexing="ij")
    close(table(flexibility(line("bar", ends))), expected(x, y) / AXIAL)


@pytest.mark.parametrize("ends", PAIRS)
def test_finite_elements_bend_alike(ends):
    nodal, beam = elements(ends).flexibility[:, 2 * CUT], line("beam", ends)
    # Exact but for what inertia relief leaves between nodes.
    close(table(flexibility(beam)), nodal[2 * READ], 1e-5)
    close(table(flexibility(beam, 1)), nodal[2 * READ + 1], 1e-5)


# What holds between the static quantities themselves.


@pytest.mark.parametrize(("kind", "ends"), CASES)
def test_flexibility_is_symmetric(kind, ends):
    deflections = table(flexibility(line(kind, ends)), PLACES, PLACES)
    close(deflections, deflections.T, 1e-13)


@pytest.mark.parametrize(("kind", "ends"), CASES)
def test_seen_from_the_other_end_statics_are_the_same(kind, ends):
    turned = line(kind, "-".join(reversed(ends.split("-"))))
    ahead = table(flexibility(line(kind, ends)))
    behind = table(flexibility(turned), LENGTH - PLACES, LENGTH - CUTS)
    close(ahead, behind, 1e-12)
