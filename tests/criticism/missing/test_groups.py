"""groups: unknowns that move different data are moved together, and nothing is lost by it."""

import numpy as np

from bayes_placement.criticism.missing._groups import grouped
from bayes_placement.criticism.missing._problem import Problem
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
