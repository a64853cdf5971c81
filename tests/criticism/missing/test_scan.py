"""An effect scanned through its prior, in parts."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.missing import _scan, _scanned_candidates
from bayes_placement.inference.residuals import Problem, point_in_problem
from tests.criticism.small import experiment, measured

COUNTS = {"structure.effects.point_mass.at": 9, "structure.effects.point_mass.mass": 5}


@pytest.fixture(scope="module")
def problems():
    """Without and with a mass that is there."""
    data = experiment().data(measured(bp.effects.point_mass(0.7, 0.1), seed=1))
    mass = bp.effects.point_mass(dist.Uniform(0.1, 0.9), dist.Uniform(0.0, 0.5))
    return Problem(experiment(), data), Problem(experiment() + mass, data)


def scanned(problems, most=1000):
    without, with_mass = problems
    slopes = without.squares.jacobian(np.zeros((1, without.dimension)), True).slopes[0]
    return _scan.scan(with_mass, COUNTS, np.zeros(with_mass.dimension), slopes, most)


def test_a_scan_in_parts_keeps_the_points_of_least_cost_of_all(problems, monkeypatch):
    monkeypatch.setattr(_scan, "KEPT", 20)
    together = scanned(problems)
    monkeypatch.setattr(_scan, "TOGETHER", 7)
    for part, expected in zip(scanned(problems), together, strict=True):
        np.testing.assert_allclose(part, expected, rtol=1e-6)
    monkeypatch.setattr(_scan, "KEPT", 45)
    assert np.all(np.diff(together.predicted_cost) >= 0)
    costs = scanned(problems).predicted_cost[20:]
    assert len(costs) == 25 and together.predicted_cost[-1] <= costs.min()


def test_the_best_place_of_a_scan_is_near_the_mass(problems):
    _, with_mass = problems
    values = with_mass.coordinates.named(_scan.best_places(scanned(problems))[:1])
    assert abs(values["structure.effects.point_mass.at"][0] - 0.7) < 0.05
    assert abs(values["structure.effects.point_mass.mass"][0] - 0.1) < 0.1


def test_a_point_is_transferred_by_names():
    """Of two attachments the new one may come first, as what they add to a model error does."""
    spring = bp.effects.ground_spring(dist.Uniform(0.1, 0.9), dist.LogUniform(1e3, 1e6))
    mass = bp.effects.point_mass(dist.Uniform(0.1, 0.9), dist.Uniform(0.0, 0.5))
    imperfect = experiment().with_model_error(bp.model_error.Modal())
    data = imperfect.data(measured())
    for first, second in ((spring, mass), (mass, spring)):
        before = Problem(imperfect + first, data)
        problem = before.with_effect(second)
        point = np.random.default_rng(0).normal(size=before.dimension)
        transferred = problem.coordinates.named(point_in_problem(before, point, problem)[None])
        for name, values in before.coordinates.named(point[None]).items():
            np.testing.assert_allclose(transferred[name], values, rtol=1e-9)


@pytest.mark.parametrize(("kind", "count"), [("point_mass", 8), ("tuned_absorber", 32)])
def test_of_an_effect_of_more_unknowns_more_places_are_followed(kind, count):
    setup = experiment()
    effect = bp.effects.library(setup, [kind]).effects[0]
    problem = Problem(setup, setup.data(measured())).with_effect(effect)
    assert _scanned_candidates._followed(effect, problem) == count
