"""groups: unknowns that move different data are moved together, and nothing is lost by it."""

from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest

from bayes_placement.criticism.missing._groups import grouped
from bayes_placement.criticism.missing._problem import Problem
from bayes_placement.effects.instrument_effect import InstrumentEffect
from tests.criticism.small import experiment, measured


def test_unknowns_of_different_data_share_a_group():
    moves = np.array([[1, 1, 1, 1], [1, 0, 0, 0], [0, 1, 1, 0], [0, 0, 1, 1]], dtype=bool)
    groups = grouped(moves)
    np.testing.assert_array_equal(groups.of, [0, 1, 1, 2])
    assert groups.number == 3
    np.testing.assert_array_equal(groups.directions().sum(axis=0), 1)


def test_slopes_along_groups_are_those_along_each_unknown():
    random = np.random.default_rng(0)
    moves = random.random((7, 40)) < 0.2
    slopes = random.standard_normal((3, 7, 40)) * moves
    groups = grouped(moves)
    together = np.einsum("gu,pun->pgn", groups.directions(), slopes)
    assert groups.number < 7
    np.testing.assert_array_equal(groups.slopes(together), slopes)


def test_no_unknown_makes_no_group():
    groups = grouped(np.zeros((0, 5), dtype=bool))
    assert groups.number == 0
    assert groups.directions().shape == (0, 0)


def test_sensors_of_an_experiment_are_moved_together():
    one = experiment()
    problem = Problem(one, one.data(measured()))
    assert problem.groups.number < problem.dimension
    points = np.random.default_rng(2).normal(0, 0.5, (2, problem.dimension))
    _, _, each, _ = problem._differences(points, np.eye(problem.dimension), False)
    np.testing.assert_array_equal(problem.slopes(points)[2], each)


class OneSided(InstrumentEffect):
    """Amplification of the first channel that acts on one side of zero alone."""

    absent: ClassVar[tuple[str, float]] = ("amount", 0.0)
    amount: Any
    side: int
    name: str = "one_sided"

    @classmethod
    def suggest(cls, experiment):
        return []

    def recorded(self, frf, omega, channels):
        return frf.at[0].multiply(1 + jnp.maximum(self.side * self.amount, 0.0))


@pytest.mark.parametrize("side", [-1, 1])
def test_an_unknown_that_moves_nothing_at_some_points_is_not_lost_at_others(side):
    one = experiment() + OneSided(dist.Normal(0.0, 0.2), side)
    problem = Problem(one, one.data(measured()))
    points = np.random.default_rng(2).normal(0, 0.5, (2, problem.dimension))
    points[:, -1] = [-0.7, 0.7]  # on each side
    _, _, each, _ = problem._differences(points, np.eye(problem.dimension), False)
    found = problem.slopes(points)[2]
    np.testing.assert_array_equal(np.any(each[:, -1] != 0, axis=-1), [side < 0, side > 0])
    np.testing.assert_array_equal(found, each)
    assert problem.groups.number < problem.dimension
