"""Canonical forms, counts of networks, and classes that no measurement tells apart."""

import itertools
import json

import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement._shared.errors import InputError
from bayes_placement.effects import Dashpot, Mass, Spring, Springpot
from bayes_placement.laws import canonical, classes, law_of, networks
from bayes_placement.laws.catalogue import S, invariant, is_grounded, leaves, response, same_family

FORMS = [
    ("k", "k"),
    (["|", "k", "k"], "k"),
    (["-", "m", "k"], ["-", "k", "m"]),
    (["|", "m", ["|", "k", "m"]], ["|", "k", "m"]),
    (["|", ["-", "c", "c"], "c"], "c"),
    (["-", "k", ["|", ["-", "k", "c"], ["-", "c", "k"]]], None),
    (["|", ["-", "k", ["|", "m", "m"]], "c"], ["|", "c", ["-", "k", "m"]]),
    (["|", ["-", ["|", "k", "c"]], "k"], ["|", "c", "k"]),
    (["-", "p", "p"], ["-", "p", "p"]),
    (["|", "h", "h", "p"], ["|", "h", "p"]),
]


@pytest.mark.parametrize(("tree", "form"), FORMS)
def test_a_form_is_reached_and_kept(tree, form):
    reached = canonical(tree)
    assert form is None or reached == form
    assert canonical(reached) == reached


def same_form(law, other):
    return canonical(law.tree()) == canonical(other.tree())


def test_order_and_grouping_make_no_other_form():
    spring, dashpot, mass = Spring(1.0), Dashpot(2.0), Mass(3.0)
    assert same_form(spring | (dashpot | mass), (mass | spring) | dashpot | spring)
    assert same_form(2.0 * (spring - mass), mass - spring)
    assert not same_form(spring | dashpot, spring - dashpot)
    assert not same_form(Springpot(1.0, 0.5) | Springpot(1.0, 0.2), Springpot(1.0, 0.5))


COUNTS = [("kc", 3, 8), ("kcm", 1, 3), ("kcm", 2, 9), ("kcm", 3, 29), ("kcmp", 3, 90)]


@pytest.mark.parametrize(("letters", "elements", "count"), [*COUNTS, ("kcmp", 4, 548)])
def test_as_many_networks_as_counted_by_hand(letters, elements, count):
    trees = networks(letters, elements)
    assert len({json.dumps(tree) for tree in trees}) == len(trees) == count
    assert all(canonical(tree) == tree and len(leaves(tree)) <= elements for tree in trees)


def all_trees(letters, size):
    """Every tree of two parts a group, with no regard to what is one."""
    if size == 1:
        yield from letters
    for first in range(1, size):
        parts = itertools.product(all_trees(letters, first), all_trees(letters, size - first))
        for (one, other), sign in itertools.product(parts, "|-"):
            yield [sign, one, other]


@pytest.mark.parametrize(("letters", "elements"), [("kcm", 3), ("kp", 4)])
def test_the_catalogue_holds_every_form_once(letters, elements):
    forms = {
        json.dumps(canonical(tree))
        for size in range(1, elements + 1)
        for tree in all_trees(letters, size)
    }
    assert forms == {json.dumps(tree) for tree in networks(letters, elements)}


def test_two_of_the_29_have_a_mass_between_others():
    floating = [tree for tree in networks("kcm", 3) if not is_grounded(tree)]
    assert floating == [["-", "m", ["|", "k", "m"]], ["-", "m", ["|", "c", "m"]]]
    grounded = [any(map(is_grounded, members)) for members in classes(networks("kcm", 3))]
    assert all(grounded)


@pytest.mark.parametrize("tree", networks("kcmp", 3), ids=json.dumps)
def test_a_law_of_a_tree_is_that_network(tree):
    numbers = np.random.default_rng(3).normal(size=2 * len(leaves(tree)))
    letters = iter(numbers)
    logs, values = [], []
    for leaf in leaves(tree):
        logs.append(next(letters))
        values.append(float(np.exp(logs[-1])))
        if leaf == "p":
            # Springpots have a reference of 1 Hz, families one of s = 1.
            logs.append(next(letters))
            values.append(float(1 / (1 + np.exp(-logs[-1]))))
            values[-2] *= (2 * np.pi) ** values[-1]
    law = law_of(tree, values)
    assert law.tree() == tree
    stiffness = law.dynamic_stiffness(jnp.asarray(-1j * S))
    np.testing.assert_allclose(stiffness, np.exp(response(tree, logs)[0]), rtol=1e-10)


def test_slopes_are_those_of_finite_differences():
    tree = ["|", "m", ["-", "p", ["|", "c", "k"]]]
    numbers, step = np.array([0.2, -0.4, 0.3, 0.7, -0.1]), 1e-6
    slopes = [
        (response(tree, numbers + ahead)[0] - response(tree, numbers - ahead)[0]) / (2 * step)
        for ahead in step * np.eye(len(numbers))
    ]
    np.testing.assert_allclose(response(tree, numbers)[1], slopes, atol=1e-8)


def test_29_networks_are_23_classes():
    found = classes(networks("kcm", 3))
    assert sum(map(len, found)) == 29
    assert len(found) == 23
    pairs = {json.dumps(members) for members in found if len(members) > 1}
    expected = {
        json.dumps([["|", a, canonical(["-", a, b])], ["-", a, canonical(["|", a, b])]])
        for a, b in itertools.permutations("kcm", 2)
    }
    assert pairs == expected


def test_a_spring_too_many_makes_no_other_family():
    lean, rich = ["|", "k", ["-", "c", "k"]], ["|", "k", ["-", "k", ["|", "c", "k"]]]
    assert invariant(lean) == invariant(rich)
    assert same_family(lean, rich)


def test_springpots_that_share_a_part_are_one_family():
    assert same_family(["|", "k", ["-", "k", "p"]], ["-", "k", ["|", "k", "p"]])
    assert not same_family(["|", "k", "p"], ["|", "c", "p"])


def test_what_is_no_network_is_refused():
    with pytest.raises(InputError, match="some of k, c, m, p, h are needed"):
        networks("kx", 2)
    with pytest.raises(InputError, match="3 are needed"):
        law_of(["|", "k", "p"], [1.0, 2.0])
    with pytest.raises(InputError, match="some of k, c, m, p are needed"):
        classes(["h"])
