"""Fits with a model error that begin where modes identified from the FRFs are."""

from dataclasses import replace

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.missing import _errors_as_identified as begin
from bayes_placement.criticism.missing._hypotheses import (
    null_hypothesis,
    problem_with_errors,
    with_errors,
)
from bayes_placement.criticism.missing._model_error_choice import _with_fewer_from_best
from bayes_placement.criticism.missing._posterior_odds import Comparison
from bayes_placement.inference.engines.empirical_bayes import SETTLED
from tests.benchmarks.imperfect_experiments import given
from tests.criticism import small
from tests.simulator.crude_draws import draw

OFF = {"frequency": [0.06, -0.05, 0.04, -0.06], "damping": [0.4, -0.5, 0.3, -0.2]}
"""Logarithms of the true natural frequencies and damping over those of the model as given."""

SIZES = {"frequency": 0.05, "damping": 0.4}
GAIN = dist.Normal(0.0, 0.2)
RIVALS = {"shape": None, "gain": None, "stiffness_and_mass": None, "runs": None}


@pytest.fixture(scope="module")
def fitted():
    """The exact model, fitted to a bar of which each mode is off by itself."""
    errors = bp.model_error.Embedded(**SIZES, **RIVALS, modes=4)
    true = small.experiment().with_model_error(errors).fix(small.TRUTH)
    standard = {
        name: np.resize(np.array(OFF[word]) / SIZES[word], unknown.distribution.shape())
        for name, unknown in true.unknown.items()
        for word in OFF
        if word in name
    }
    setup = small.experiment()
    measured = small.recorded(true.fix(standard), seed=3, averages=1000)
    return null_hypothesis(setup, setup.data(measured)), setup


def test_errors_begin_where_the_modes_are(fitted):
    exact, setup = fitted
    errors = setup.with_model_error(bp.model_error.Embedded(**RIVALS)).model_error
    start = begin._as_identified(exact, problem_with_errors(exact, errors))
    (values,) = (
        start.point[place] * start.problem.sizes["model_error.frequency.size"]
        for name, place in start.problem.coordinates.places.items()
        if name == "model_error.frequency.standard"
    )
    modulus = exact.problem.coordinates.named(exact.fit.point[None])[
        "structure.modes.youngs_modulus"
    ]
    given = 0.5 * np.log(small.TRUTH["structure.modes.youngs_modulus"] / float(modulus[0]))
    np.testing.assert_allclose(values[:4] - given, OFF["frequency"], atol=0.005)


def test_the_fit_is_that_of_the_greater_evidence(fitted):
    exact, setup = fitted
    errors = setup.with_model_error(bp.model_error.Embedded(**RIVALS)).model_error
    found, from_zero = begin.given_with_errors(exact, errors), with_errors(exact, errors)
    assert found.fit.log_evidence > from_zero.fit.log_evidence - SETTLED
    assert found.chi2_per_datum < 1.2 < 10 < exact.chi2_per_datum
    assert found.chi2_when_exact == exact.chi2_per_datum


def test_without_an_effect_errors_begin_at_those_of_the_best_with_one_as_well(fitted):
    exact, setup = fitted
    errors = setup.with_model_error(bp.model_error.Embedded(**RIVALS)).model_error
    given, gain = begin.given_with_errors(exact, errors), bp.effects.gain_error("s1", GAIN)
    problem = given.problem.with_effect(gain).at_sizes(given.problem.sizes)
    evidence = given.fit.log_evidence
    at_the_best = given.fit._replace(point=given.point_in(problem), log_evidence=evidence + 20)
    best = replace(given, effects=(gain,), problem=problem, fit=at_the_best)
    stuck = given.fit._replace(point=0 * given.fit.point, log_evidence=evidence - 500)
    comparison = Comparison([replace(given, fit=stuck), best], {"gain_error": 1})
    found, beside = _with_fewer_from_best(comparison).hypotheses
    assert beside is best and found.effects == ()
    assert found.fit.log_evidence > evidence - SETTLED


@pytest.mark.parametrize(
    ("number", "logs", "begins"),
    [
        ([5, 6], [[0.1, 0.1], [0.2, 0.2]], {}),
        ([1, 2], [[0.1, 0.3], [np.nan, -np.inf]], {"frequency": [0.1, 0.3]}),
        ([2, 9], [[0.1, 0.3], [np.nan, 0.2]], {"frequency": [0.0, 0.1]}),
    ],
    ids=["above those with errors", "without damping", "one of two"],
)
def test_what_is_not_known_of_a_mode_begins_at_zero(fitted, monkeypatch, number, logs, begins):
    exact, setup = fitted
    off = begin._Off(np.array(number), np.array(logs))
    monkeypatch.setattr(begin, "_modes_off", lambda exact: off)
    modal = bp.model_error.Embedded(**RIVALS, modes=4)
    problem = problem_with_errors(exact, setup.with_model_error(modal).model_error)
    start = begin._as_identified(exact, problem)
    for word in OFF:
        values = start.point[problem.coordinates.places[f"model_error.{word}.standard"]]
        values = values * start.problem.sizes[f"model_error.{word}.size"]
        np.testing.assert_allclose(values[:2], begins.get(word, [0.0, 0.0]), atol=1e-12)
    assert np.isfinite([*start.problem.sizes.values()]).all()


@pytest.mark.long
def test_a_plate_of_a_coarse_mesh_is_explained_by_a_model_error():
    """Of two close modes one is off by 5 %: from errors of zero the other one takes its place."""
    study = given(draw(11, is_changed=False))
    errors = study.experiment.with_model_error(bp.model_error.Embedded()).model_error
    exact = null_hypothesis(study.experiment, study.experiment.data(study.measured))
    found = begin.given_with_errors(exact, errors)
    assert found.chi2_per_datum < 1.1 < 1000 < exact.chi2_per_datum
    assert (
        not found.as_rival.evidence < -700
    )  # -94,500 from zero; -694 with a mass that is not there
