"""An effect scanned through its prior, in parts."""

import numpy as np
import numpyro.distributions as dist
import pandas as pd
import pytest

import bayes_placement as bp
from bayes_placement.criticism.kept_fits import FIT_LAYOUT
from bayes_placement.criticism.missing import _scan, _scanned_candidates
from bayes_placement.criticism.missing._at_channels import at_lines_of_scans
from bayes_placement.criticism.missing._hypotheses import Hypothesis, linear_logarithmic
from bayes_placement.criticism.missing._suspicion import scores
from bayes_placement.inference.residuals import Problem, point_in_problem
from tests.criticism.small import experiment, measured

COUNTS = {"structure.effects.point_mass.at": 9, "structure.effects.point_mass.mass": 5}


MASS = bp.effects.point_mass(dist.Uniform(0.1, 0.9), dist.Uniform(0.0, 0.5))


@pytest.fixture(scope="module")
def without():
    """A model without a mass that is there, at the middle of its priors."""
    data = experiment().data(measured(bp.effects.point_mass(0.7, 0.1), seed=1))
    problem = Problem(experiment(), data)
    return Hypothesis((), problem, FIT_LAYOUT._replace(point=np.zeros(problem.dimension)))


def scanned(without, most=1000):
    part = at_lines_of_scans(without, MASS)
    return _scan.scan(part, COUNTS, most, linear_logarithmic(without))


def test_a_scan_in_parts_keeps_the_points_of_least_cost_of_all(without, monkeypatch):
    monkeypatch.setattr(_scan, "KEPT", 20)
    together = scanned(without)
    monkeypatch.setattr(_scan, "TOGETHER", 7)
    for part, expected in zip(scanned(without), together, strict=True):
        np.testing.assert_allclose(part, expected, rtol=1e-6)
    monkeypatch.setattr(_scan, "KEPT", 45)
    assert np.all(np.diff(together.predicted_cost) >= 0)
    costs = scanned(without).predicted_cost[20:]
    assert len(costs) == 25 and together.predicted_cost[-1] <= costs.min()


def test_the_best_place_of_a_scan_is_near_the_mass(without):
    candidate = _scanned_candidates.ScannedCandidate(without, MASS, scanned(without))
    values = candidate.problem.coordinates.named(candidate.best_places(1))
    assert abs(values["structure.effects.point_mass.at"][0] - 0.7) < 0.05
    assert abs(values["structure.effects.point_mass.mass"][0] - 0.1) < 0.1


@pytest.mark.parametrize("kind", ["gain_error", "misplaced_sensor", "swapped_sensors"])
def test_at_the_channels_of_an_effect_a_scan_is_that_at_all(without, kind, monkeypatch):
    effect = bp.effects.library(experiment(), [kind]).effects[-1]
    (few,) = _scanned_candidates.scanned([(without, effect)], lambda: None)
    monkeypatch.setattr(type(effect), "alone", lambda effect, instruments: None)
    (of_all,) = _scanned_candidates.scanned([(without, effect)], lambda: None)
    assert few.scan.data.size > 0 and of_all.scan.data.size == 0
    for values, expected in zip(few.scan[::2], of_all.scan[::2], strict=False):
        np.testing.assert_allclose(values, expected, rtol=1e-9)
    np.testing.assert_allclose(few.scan.residual, of_all.scan.residual[:, few.scan.data], rtol=1e-6)
    (row,), (row_of_all,) = (scores(without, [each]) for each in (few, of_all))
    pd.testing.assert_frame_equal(row, row_of_all, rtol=1e-6)


def test_a_point_is_transferred_by_names():
    """Of two attachments the new one may come first, as what they add to a model error does."""
    spring = bp.effects.ground_spring(dist.Uniform(0.1, 0.9), dist.LogUniform(1e3, 1e6))
    mass = bp.effects.point_mass(dist.Uniform(0.1, 0.9), dist.Uniform(0.0, 0.5))
    imperfect = experiment().with_model_error(bp.model_error.Embedded())
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
