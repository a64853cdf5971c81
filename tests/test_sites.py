"""Unknowns are named by their path, sampled in order, and replaced by numbers."""

from collections import OrderedDict

import equinox as eqx
import jax
import numpy as np
import numpyro.distributions as dist
import pytest
from numpyro import handlers

import bayes_placement as bp
from bayes_placement._shared import sites as _sites
from bayes_placement.positions.channel import checked_name


class Leaf(eqx.Module):
    mass: object = eqx.field(metadata=_sites.unit("kg"))
    share: tuple[object, ...] = eqx.field(metadata=_sites.unit("1"))
    label: str = eqx.field(static=True)


class Tree(eqx.Module):
    part: OrderedDict[str, Leaf] = eqx.field(metadata=_sites.owners(_sites.Role.PLACEMENT))
    plain: object
    noise: object = eqx.field(default=0.0, metadata=_sites.owners(_sites.Role.OUTPUT_ERROR))


def tree():
    first = Leaf(mass=dist.Uniform(1.0, 2.0), share=(0.1, dist.Normal(0.0, 1.0)), label="a")
    second = Leaf(mass=3.0, share=(dist.HalfNormal(2.0),), label="b")
    return Tree(part=OrderedDict(s10=first, s2=second), plain=dist.LogNormal(0.0, 1.0))


NUMBER = dist.LogUniform(1.0, 1e3)
LAW = bp.effects.Spring(NUMBER) | bp.effects.Dashpot(NUMBER) | bp.effects.Mass(NUMBER)


def test_names_are_paths_that_count_from_one():
    names = [unknown.name for unknown in _sites.unknowns(tree())]
    assert names == ["part.s10.mass", "part.s10.share.2", "part.s2.share.1", "plain"]


def test_units_are_those_of_the_field_that_holds_them():
    assert [unknown.unit for unknown in _sites.unknowns(tree())] == ["kg", "1", "1", ""]


def test_an_unknown_knows_its_owner_its_role_and_its_place_within():
    first, second, third, plain = _sites.unknowns(tree())
    assert first.owner == second.owner == _sites.Owner("part", "s10")
    assert third.owner == _sites.Owner("part", "s2")
    assert [(unknown.field, unknown.component) for unknown in (first, second)] == [
        ("mass", ""),
        ("share", "2"),
    ]
    assert {unknown.role for unknown in (first, second, third)} == {_sites.Role.PLACEMENT}
    assert (plain.owner, plain.field, plain.role) == (("", ""), "plain", _sites.Role.PARAMETER)
    assert [unknown.is_placement for unknown in (first, plain)] == [True, False]


def test_an_owner_within_an_owner_is_the_nearer_one():
    outer = Tree(part=OrderedDict(), plain=0.0, noise=tree())
    mass, *_, plain = _sites.unknowns(outer)
    assert (mass.name, mass.owner) == ("noise.part.s10.mass", ("part", "s10"))
    assert (plain.owner, plain.field, plain.role) == (
        ("noise", ""),
        "plain",
        _sites.Role.OUTPUT_ERROR,
    )
    alone = _sites.unknowns(Tree(OrderedDict(), 0.0, dist.Normal(0.0, 1.0)))
    assert (alone[0].owner, alone[0].field) == (("noise", ""), "")


def test_names_can_be_a_word_of_a_name():
    assert checked_name("Sensor", "s1+x") == "s1+x"
    with pytest.raises(ValueError, match=r'Sensor \'s.1\' was given.*dot.*"s_1"'):
        checked_name("Sensor", "s.1")
    with pytest.raises(ValueError, match="Sensor '' was given; a name"):
        checked_name("Sensor", "")


def test_realise_samples_each_unknown_once_in_order():
    with handlers.trace() as sites, handlers.seed(rng_seed=3):
        real = _sites.realise(tree())
    assert list(sites) == [unknown.name for unknown in _sites.unknowns(tree())]
    assert not _sites.unknowns(real)
    assert real.part["s10"].mass == sites["part.s10.mass"]["value"]
    assert real.part["s10"].share == (0.1, sites["part.s10.share.2"]["value"])
    assert real.part["s2"].mass == 3.0
    assert real.plain == sites["plain"]["value"]


def test_realise_leaves_what_it_is_not_asked_for():
    with handlers.trace() as sites, handlers.seed(rng_seed=3):
        real = _sites.realise(tree(), where=lambda unknown: unknown.owner.name == "s2")
    assert list(sites) == ["part.s2.share.1"]
    remaining = [unsampled.name for unsampled in _sites.unknowns(real)]
    assert remaining == ["part.s10.mass", "part.s10.share.2", "plain"]


def test_substitute_puts_numbers_in_place():
    fixed = _sites.substitute(tree(), {"part.s10.share.2": -0.7, "plain": 2.0})
    assert fixed.part["s10"].share == (0.1, -0.7)
    assert fixed.plain == 2.0
    assert [unknown.name for unknown in _sites.unknowns(fixed)] == [
        "part.s10.mass",
        "part.s2.share.1",
    ]


def test_substitute_serves_inside_jit_and_grad():
    def total(mass):
        fixed = _sites.substitute(tree(), {"part.s10.mass": mass})
        return fixed.part["s10"].mass ** 2

    np.testing.assert_allclose(jax.jit(jax.grad(total))(1.5), 3.0)


def test_substitute_refuses_a_name_that_is_no_unknown():
    with pytest.raises(ValueError, match=r"There is no unknown 'part.s2.mass'.*part.s10.mass,"):
        _sites.substitute(tree(), {"part.s2.mass": 1.0})
    with pytest.raises(ValueError, match=r"There is no unknown 'x'.*The unknowns are none"):
        _sites.substitute(1.0, {"x": 1.0})


def test_a_tree_without_unknowns_is_left_alone():
    leaf = Leaf(mass=1.0, share=(2.0,), label="a")
    assert _sites.unknowns(leaf) == []
    assert _sites.realise(leaf) == leaf


class Incomparable:
    """What cannot be compared, as arrays cannot."""

    def __eq__(self, other):
        raise ValueError("ambiguous")

    def __hash__(self):
        return 0


class Marked(eqx.Module):
    mass: object = eqx.field(metadata=_sites.unit("kg"))
    mark: Incomparable = eqx.field(static=True)


def test_trees_with_fixed_fields_that_cannot_be_compared_have_their_unknowns():
    for _ in range(2):
        (unknown,) = _sites.unknowns(Marked(dist.Normal(), Incomparable()))
        assert (unknown.name, unknown.unit) == ("mass", "kg")


@pytest.mark.parametrize(
    ("effect", "units"),
    [
        (bp.effects.attached(0.3, LAW), ["N/m", "N s/m", "kg"]),
        (bp.effects.attached(0.3, LAW, motion="rotation"), ["N m/rad", "N m s/rad", "kg m2"]),
        (bp.effects.inserted(0.3, LAW), ["N m/rad", "N m s/rad", "kg m2"]),
        (bp.effects.inserted(0.3, LAW, motion="displacement"), ["N/m", "N s/m", "kg"]),
    ],
    ids=["displacement", "rotation", "hinge", "sleeve"],
)
def test_numbers_of_a_law_on_a_rotation_have_its_units(effect, units):
    assert [unknown.unit for unknown in _sites.unknowns({"effects": effect})] == units
