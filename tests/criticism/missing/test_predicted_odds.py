"""Which effects are worth a fit together with a model error."""

import dataclasses

import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement.criticism.missing._candidates import candidates_of
from bayes_placement.criticism.missing._hypotheses import null_hypothesis, with_errors
from bayes_placement.criticism.missing._more_effects import single_effects, with_channels
from bayes_placement.criticism.missing._posterior_odds import passes
from bayes_placement.criticism.missing._predicted_odds import ALWAYS, _ErroneousModel, worth_fitting
from bayes_placement.inference.chi2 import LEVEL
from bayes_placement.inference.engines.levenberg_marquardt import minimise
from tests.criticism.missing.test_before_and_after import imperfect, measured
from tests.criticism.small import experiment

SIZES = {"frequency": 0.01, "damping": 0.2, "shape": 0.05, "gain": 0.01, "stiffness_and_mass": 0.01}


def screened(*hidden, seed=1):
    """The fit with model error, and all single effects, of a bar that is not as its model."""
    errors = experiment().with_model_error(bp.model_error.Embedded(**SIZES)).model_error
    data = experiment().data(measured(imperfect(seed, *hidden), seed + 1))
    library = effects.library(experiment(), ["point_mass", "gain_error", "time_delay"])
    candidates = candidates_of(experiment(), library).effects
    singles = single_effects(null_hypothesis(experiment(), data), candidates, lambda: None)
    exact = with_channels(singles, LEVEL, needs_all=True)
    return with_errors(exact.hypotheses[0], errors), exact


@pytest.fixture(scope="module")
def with_gain():
    return screened(effects.gain_error("s2", -0.08))


def test_the_effect_that_is_missing_is_the_most_promising(with_gain):
    null, exact = with_gain
    assert passes(null, LEVEL)  # the errors take up what is missing
    first, *_ = worth_fitting(null, exact, exact.hypotheses[1:])
    assert first.kinds == ("gain_error",)
    assert first.problem.experiment.instrument_effects["gain_error"].transducer == 1


def test_what_a_fit_gains_is_what_is_predicted(with_gain):
    """At the sizes without the effect: one strength, no place, residuals nearly linear in it."""
    null, exact = with_gain
    (hypothesis, *_) = worth_fitting(null, exact, exact.hypotheses[1:])
    model = _ErroneousModel(null)
    problem = model.problem(hypothesis)
    points = model._points(hypothesis, problem)
    objective = problem.squares.objective()
    _, normal = minimise(objective, points[:1], steps=60)
    gained = null.problem.squares.objective().cost(null.fit.point[None]) - normal.cost
    # The strength itself has a prior, whose cost is at most some units.
    predicted = model.log_evidence_gained(hypothesis, problem)
    assert predicted == pytest.approx(float(gained[0]), rel=0.1, abs=2)


def test_what_falls_far_short_of_a_fitted_effect_is_not_worth_a_fit(with_gain):
    null, exact = with_gain
    by_evidence = sorted(exact.hypotheses[1:], key=lambda h: -h.fit.log_evidence)
    without_rival = worth_fitting(null, exact, by_evidence)
    far = dataclasses.replace(by_evidence[0], fit=null.fit._replace(log_evidence=1e9))
    assert {id(h) for h in worth_fitting(null, exact, by_evidence, [far])} == {
        id(h) for h in by_evidence[:ALWAYS]
    }
    close = dataclasses.replace(by_evidence[0], fit=null.fit)
    assert worth_fitting(null, exact, by_evidence, [close]) == without_rival


def test_where_nothing_is_missing_few_are_worth_a_fit():
    null, exact = screened(seed=7)
    by_evidence = sorted(exact.hypotheses[1:], key=lambda h: -h.fit.log_evidence)
    promising = worth_fitting(null, exact, by_evidence)
    assert {id(hypothesis) for hypothesis in by_evidence[:ALWAYS]} <= {id(h) for h in promising}
    assert len(promising) < len(by_evidence)
