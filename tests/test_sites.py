"""sites: unknowns are named by their path, sampled in order, and replaced by numbers."""

from collections import OrderedDict

import equinox as eqx
import jax
import numpy as np
import numpyro.distributions as dist
import pytest
from numpyro import handlers

from bayes_placement import _sites


class Leaf(eqx.Module):
    mass: object = eqx.field(metadata=_sites.unit("kg"))
    share: tuple[object, ...] = eqx.field(metadata=_sites.unit("1"))
    label: str = eqx.field(static=True)


class Tree(eqx.Module):
    part: OrderedDict[str, Leaf]
    plain: object


def tree():
    first = Leaf(mass=dist.Uniform(1.0, 2.0), share=(0.1, dist.Normal(0.0, 1.0)), label="a")
    second = Leaf(mass=3.0, share=(dist.HalfNormal(2.0),), label="b")
    return Tree(part=OrderedDict(s10=first, s2=second), plain=dist.LogNormal(0.0, 1.0))


def test_names_are_paths_that_count_from_one():
    names = [one.name for one in _sites.unknowns(tree())]
    assert names == ["part.s10.mass", "part.s10.share.2", "part.s2.share.1", "plain"]


def test_units_are_those_of_the_field_that_holds_them():
    assert [one.unit for one in _sites.unknowns(tree())] == ["kg", "1", "1", ""]


def test_realise_samples_each_unknown_once_in_order():
    with handlers.trace() as sites, handlers.seed(rng_seed=3):
        real = _sites.realise(tree())
    assert list(sites) == [one.name for one in _sites.unknowns(tree())]
    assert not _sites.unknowns(real)
    assert real.part["s10"].mass == sites["part.s10.mass"]["value"]
    assert real.part["s10"].share == (0.1, sites["part.s10.share.2"]["value"])
    assert real.part["s2"].mass == 3.0
    assert real.plain == sites["plain"]["value"]


def test_realise_leaves_what_it_is_not_asked_for():
    with handlers.trace() as sites, handlers.seed(rng_seed=3):
        real = _sites.realise(tree(), where=lambda name: name.startswith("part.s2"))
    assert list(sites) == ["part.s2.share.1"]
    left = [one.name for one in _sites.unknowns(real)]
    assert left == ["part.s10.mass", "part.s10.share.2", "plain"]


def test_substitute_puts_numbers_in_place():
    fixed = _sites.substitute(tree(), {"part.s10.share.2": -0.7, "plain": 2.0})
    assert fixed.part["s10"].share == (0.1, -0.7)
    assert fixed.plain == 2.0
    assert [one.name for one in _sites.unknowns(fixed)] == ["part.s10.mass", "part.s2.share.1"]


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
