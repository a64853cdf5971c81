"""Effects of a hypothesis that are looked for once more beside the others."""

import dataclasses

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.missing import _more_effects
from bayes_placement.criticism.missing._fitted_candidates import relocated
from bayes_placement.criticism.missing._hypotheses import Hypothesis, null_hypothesis
from bayes_placement.criticism.missing._posterior_odds import Comparison
from bayes_placement.inference.engines.levenberg_marquardt import best_fit, minimise
from tests.criticism.small import GAIN, MASS, experiment, measured

PLACE = "structure.effects.point_mass.at"
TRUE_PLACE = 0.313  # of MASS
CANDIDATES = (
    bp.effects.point_mass(dist.Uniform(0.05, 0.95), dist.LogUniform(1e-3, 1.0)),
    bp.effects.gain_error("s2", dist.Uniform(-0.5, 0.5)),
)


@pytest.fixture(scope="module")
def null():
    return null_hypothesis(experiment(), experiment().data(measured(MASS, GAIN, seed=2)))


@pytest.fixture(scope="module")
def stuck(null):
    """Both effects, the mass where a descent from the mirror image of its place ends."""
    problem = null.problem
    for effect in CANDIDATES:
        problem = problem.with_effect(effect)
    start = null.point_in(problem)
    start[problem.coordinates.places[PLACE]] = 0.4  # 0.64 of the length
    descents = minimise(problem.squares.objective(), start[None], steps=40)
    return Hypothesis(CANDIDATES, problem, best_fit(*descents, problem.count))


def place_of_mass(hypothesis):
    values = hypothesis.problem.coordinates.named(hypothesis.fit.point[None])
    return float(values[PLACE][0])


def test_a_mass_at_the_mirror_image_of_its_place_is_moved(null, stuck):
    assert abs(place_of_mass(stuck) - TRUE_PLACE) > 0.2
    ticks = []
    (moved,) = relocated([stuck], null, lambda: ticks.append(1))
    assert abs(place_of_mass(moved) - TRUE_PLACE) < 0.01
    assert moved.fit.log_evidence > stuck.fit.log_evidence + 20
    assert moved.chi2_per_datum < 1.2
    assert moved.kinds == stuck.kinds and len(ticks) == len(CANDIDATES)


def test_what_is_in_its_place_stays_as_it_is(null, stuck):
    (moved,) = relocated([stuck], null, lambda: None)
    (again,) = relocated([moved], null, lambda: None)
    assert again.fit.log_evidence >= moved.fit.log_evidence
    assert again.fit.log_evidence == pytest.approx(moved.fit.log_evidence, abs=0.01)


def test_several_are_moved_at_once_each_to_its_own_place(null, stuck):
    (alone,) = relocated([stuck], null, lambda: None)
    ticks = []
    first, second = relocated([stuck, alone], null, lambda: ticks.append(1))
    (again,) = relocated([alone], null, lambda: None)
    np.testing.assert_array_equal(first.fit.point, alone.fit.point)
    np.testing.assert_array_equal(second.fit.point, again.fit.point)
    assert len(ticks) == 2 * len(CANDIDATES)


def test_the_search_counts_a_moved_hypothesis_once(null, stuck, monkeypatch):
    """Two fits of one mode would have twice the probability."""
    single = dataclasses.replace(null, effects=CANDIDATES[1:], problem=stuck.problem)
    comparison = Comparison([null, single], {"point_mass": 1, "gain_error": 1})
    fitted = [stuck]
    monkeypatch.setattr(_more_effects, "extended", lambda *_: [fitted.pop()] if fitted else [])
    monkeypatch.setattr(_more_effects, "_pairs", lambda *asked: [])
    deeper = _more_effects.one_more_effect(comparison, 1, lambda: None)
    (pair,) = [hypothesis for hypothesis in deeper.hypotheses if len(hypothesis.effects) == 2]
    assert abs(place_of_mass(pair) - TRUE_PLACE) < 0.01
    assert np.isfinite(deeper.log_odds(pair))
