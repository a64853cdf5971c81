"""A number of the structure beyond its prior: what it takes the place of, and which are tried."""

import equinox as eqx
import jax
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._shared.errors import InputError
from tests.criticism.small import TRUTH, experiment

MODULUS, RATIO = "structure.modes.youngs_modulus", "structure.damping.ratio"
VALUE = "structure.effects.beyond_prior.value"
SIGNED = dist.Uniform(-3e3, 5e3)


def suggested(asked):
    candidates = effects.library(asked, ["beyond_prior"]).effects
    return {(each.unknown, each.end): (each.value.low, each.value.high) for each in candidates}


def frf(known):
    """FRFs of an experiment, the numbers of its structure being inputs of the program."""
    return np.asarray(eqx.filter_jit(lambda given: given.frf())(jax.tree.map(np.asarray, known)))


@pytest.mark.parametrize(("unknown", "end"), [(MODULUS, 1.05e9), (RATIO, 0.06)])
def test_at_the_end_of_the_prior_it_is_the_identity_bit_for_bit(unknown, end):
    prior = dist.LogUniform(end, 2 * end)
    beyond = experiment() + effects.beyond_prior(unknown, prior, end=end)
    others = {name: value for name, value in TRUTH.items() if name != unknown}
    at_end = beyond.fix(others | {VALUE: end})
    np.testing.assert_array_equal(frf(at_end), frf(experiment().fix(others | {unknown: end})))
    farther = beyond.fix(others | {VALUE: 1.2 * end})
    assert np.abs(frf(farther) / frf(at_end) - 1).max() > 0.1


def test_it_takes_the_place_of_the_unknown_with_its_unit_and_range():
    given = experiment()
    beyond = given + effects.beyond_prior(MODULUS, dist.Uniform(1.05e9, 2e9), end=1.05e9)
    assert {*beyond.unknown} == {*given.unknown} - {MODULUS} | {VALUE}
    assert beyond.unknown[VALUE].unit == "Pa"
    with pytest.raises(InputError, match=r"value=-1 was given; it must be above zero \[Pa\]"):
        beyond.fix({VALUE: -1.0})
    assert beyond.without("beyond_prior").unknown.keys() == given.unknown.keys()


@pytest.mark.parametrize("ways", ["sum", "mapping"])
def test_a_known_value_is_that_of_the_structure(ways):
    effect = effects.beyond_prior(MODULUS, 1.2e9, end=1.05e9)
    base = experiment().structure
    made = bp.Structure(base.modes, damping=base.damping, effects={effect.name: effect})
    changed = base + effect if ways == "sum" else made
    assert changed.modes.youngs_modulus == 1.2e9
    assert changed.damping == base.damping


def test_two_cannot_stand_for_one_unknown():
    once = experiment() + effects.beyond_prior(RATIO, dist.Uniform(0.06, 0.1), end=0.06)
    twice = effects.beyond_prior(RATIO, dist.Uniform(0.06, 0.1), end=0.06, name="again")
    with pytest.raises(InputError, match=f"stands for '{RATIO}'.*each once"):
        once + twice


def test_each_number_of_the_structure_is_tried_beyond_each_end_within_its_range():
    given = experiment()
    given = eqx.tree_at(
        lambda tree: tree.structure.damping.ratio,
        given,
        dist.Uniform(0.0, 0.5),
        is_leaf=lambda leaf: isinstance(leaf, dist.Distribution),
    )
    mount = effects.ground_spring(dist.Uniform(0.2, 0.4), SIGNED, name="mount")
    heavy = effects.point_mass(0.3, dist.Normal(0.4, 0.1))
    ranges = suggested(given + mount + heavy)
    stiffness = "structure.effects.mount.stiffness"
    expected = {
        (MODULUS, 0.95e9): (0.95e9 / 3, 0.95e9),
        (MODULUS, 1.05e9): (1.05e9, 3.15e9),
        (RATIO, 0.5): (0.5, 1.0),  # a ratio of critical damping is no more
        (stiffness, -3e3): (-19e3, -3e3),
        (stiffness, 5e3): (5e3, 21e3),
    }
    assert [*ranges] == [*expected]
    np.testing.assert_allclose([*ranges.values()], [*expected.values()])
