"""Unknowns that change different data share a column of finite differences."""

from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest

from bayes_placement.effects.instrument_effect import InstrumentEffect
from bayes_placement.inference.engines._column_groups import Changed, changed_data, column_groups
from bayes_placement.inference.residuals import Problem
from tests.criticism.small import experiment, measured


def test_unknowns_of_different_data_share_a_group():
    changes = np.array([[1, 1, 1, 1], [1, 0, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1]], dtype=bool)
    groups = column_groups(changes)
    np.testing.assert_array_equal(groups.group, [0, 1, 1, 2])
    assert groups.number == 3
    np.testing.assert_array_equal(groups.directions().sum(axis=0), 1)


def test_slopes_along_groups_are_those_along_each_unknown():
    random = np.random.default_rng(0)
    changes = random.random((7, 40)) < 0.2
    slopes = random.standard_normal((3, 7, 40)) * changes
    groups = column_groups(changes)
    along_groups = np.einsum("gu,pun->pgn", groups.directions(), slopes)
    assert groups.number < 7
    np.testing.assert_array_equal(groups.slopes(along_groups), slopes)


def test_products_of_slopes_are_those_without_groups():
    random = np.random.default_rng(0)
    patterns = random.random((7, 6)) < 0.3
    patterns[:, 0] = False  # what no unknown changes
    changes = patterns[:, [1, 1, 1, 2, 3, 3, 0, 2, 4, 5, 5]]
    slopes = random.standard_normal((3, 7, 11)) * changes
    residual = random.standard_normal((3, 11))
    groups = column_groups(changes)
    along_groups = np.einsum("gu,pun->pgn", groups.directions(), slopes)
    squares, pulls = groups.products(along_groups, residual)
    np.testing.assert_allclose(squares, slopes @ slopes.transpose(0, 2, 1), atol=1e-14)
    np.testing.assert_allclose(pulls, np.einsum("pun,pn->pu", slopes, residual), atol=1e-14)
    assert any(isinstance(block.data, slice) for block in groups.blocks)
    assert not all(isinstance(block.data, slice) for block in groups.blocks)


def test_blocks_of_many_data_hold_each_datum_once():
    patterns = np.random.default_rng(0).random((200, 12)) < 0.3
    changes = patterns[:, np.random.default_rng(1).integers(0, 12, 30_000)]
    groups = column_groups(changes)
    data_of_unknowns = {
        tuple(block.unknowns): np.arange(30_000)[block.data] for block in groups.blocks
    }
    assert len(data_of_unknowns) == 12
    for unknowns, data in data_of_unknowns.items():
        for datum in data[:3]:
            np.testing.assert_array_equal(np.flatnonzero(changes[:, datum]), unknowns)
    assert sum(map(len, data_of_unknowns.values())) == 30_000


def test_no_unknown_makes_no_group():
    groups = column_groups(np.zeros((0, 5), dtype=bool))
    assert groups.number == 0
    assert groups.directions().shape == (0, 0)


def test_sensors_of_an_experiment_share_a_group():
    setup = experiment()
    problem = Problem(setup, setup.data(measured()))
    assert problem.squares.column_groups.number < problem.dimension
    points = np.random.default_rng(2).normal(0, 0.5, (2, problem.dimension))
    one_by_one = problem.squares._differences(points, np.eye(problem.dimension), False)
    np.testing.assert_array_equal(problem.squares.jacobian(points).slopes, one_by_one.slopes)


class OneSided(InstrumentEffect):
    """Amplification of the first channel that acts on one side of zero alone."""

    absent: ClassVar[tuple[str, float]] = ("amount", 0.0)
    amount: Any
    side: int
    name: str = "one_sided"

    @classmethod
    def suggest(cls, scales):
        return []

    def recorded(self, frf, omega, channels):
        return frf.at[0].multiply(1 + jnp.maximum(self.side * self.amount, 0.0))


@pytest.mark.parametrize("side", [-1, 1])
def test_an_unknown_that_changes_nothing_at_some_points_is_not_lost_at_others(side):
    one_sided = experiment() + OneSided(dist.Normal(0.0, 0.2), side)
    problem = Problem(one_sided, one_sided.data(measured()))
    points = np.random.default_rng(2).normal(0, 0.5, (2, problem.dimension))
    points[:, -1] = [-0.7, 0.7]  # on each side
    one_by_one = problem.squares._differences(points, np.eye(problem.dimension), False).slopes
    slopes = problem.squares.jacobian(points).slopes
    np.testing.assert_array_equal(np.any(one_by_one[:, -1] != 0, axis=-1), [side < 0, side > 0])
    np.testing.assert_array_equal(slopes, one_by_one)
    assert problem.squares.column_groups.number < problem.dimension


@pytest.mark.parametrize("shared", [False, True])
def test_few_evaluations_tell_what_each_of_many_alike_changes(shared):
    """Nine of eleven unknowns are alike; where two change one datum, each is asked alone."""
    changes = np.zeros((11, 30), dtype=bool)
    changes[:2] = True
    changes[2:] = np.eye(9, 30, 3, dtype=bool) | np.eye(9, 30, 15, dtype=bool)
    changes[4, 3] = shared
    asked = []

    def probe(sets):
        asked.append(len(sets))
        return Changed(sets.astype(float) @ changes > 0, sets[:, 0])

    found = changed_data(probe, np.array([0, 1, *[2] * 9]))
    np.testing.assert_array_equal(found.data, changes)
    np.testing.assert_array_equal(np.flatnonzero(found.noise), [0])
    assert asked == [8, 11 if shared else 2]
