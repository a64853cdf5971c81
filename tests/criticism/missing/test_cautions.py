"""Cautions of a search: priors that exclude the truth, and fits reached from one start."""

import re
from dataclasses import replace

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.check._edges import sentences
from bayes_placement.criticism.missing._cautions import cautions
from bayes_placement.criticism.missing._hypotheses import null_hypothesis, problem_with_errors
from bayes_placement.criticism.missing.fitted_model import not_sampled
from bayes_placement.inference.engines.about_mode import SampledPosterior
from tests.criticism.small import LINES, MASS, TRUTH, experiment, measured, recorded

RATIO = "structure.damping.ratio"


@pytest.fixture(scope="module")
def fitted():
    """The bar of which all is known but the damping, whose prior is a good one."""
    known = experiment().fix({name: value for name, value in TRUTH.items() if name != RATIO})
    return null_hypothesis(known, known.data(measured()))


def drawn_about(middle, deviation):
    """A posterior of one unknown, in coordinates in which its prior is a standard normal one."""
    draws = np.random.default_rng(0).normal(middle, deviation, (500, 1))
    return SampledPosterior(draws, 0.0, 0.0)


def test_a_good_prior_and_a_fit_that_several_starts_reach_leave_no_doubt(fitted):
    assert cautions(fitted, None) == ()


def test_a_prior_that_excludes_the_truth_is_named_with_its_edge(fitted):
    (sentence,) = cautions(fitted, drawn_about(2.9, 0.4))
    assert sentence.startswith(f"{RATIO} is piled up at the upper edge of its prior")


def test_a_value_within_the_edge_of_a_prior_that_keeps_clear_of_its_bound_is_no_doubt(fitted):
    # Of a prior log-uniform from 0.01 % to 15 % on either side, the outermost 2.5 % begin at
    # 10.4 %, and 13.5 % ± 0.6 % has a share in the outermost 0.25 %.
    assert cautions(fitted, drawn_about(2.3, 0.05)) == ()
    assert cautions(fitted, drawn_about(2.43, 0.2)) == ()


def test_many_edges_are_one_sentence():
    few = [(f"unknown {number}", "lower", 0.5, 0.025) for number in range(3)]
    assert len(sentences(few)) == 3
    (together,) = sentences([*few, ("last", "upper", 0.4, 0.025)])
    assert together.startswith("4 unknowns are piled up") and "last (upper)" in together


def test_intervals_of_a_gaussian_are_told_where_the_posterior_was_to_be_sampled(fitted):
    (sentence,) = not_sampled(fitted, {})
    assert sentence.startswith("Intervals are those of a Gaussian")
    drawn = SampledPosterior(np.zeros((1, 1)), 0.0, 0.0)
    assert not_sampled(fitted, {id(fitted): drawn}) == ()
    assert not_sampled(replace(fitted, has_errors=True), {}) == ()


def test_a_fit_that_a_single_start_reached_is_doubted(fitted):
    alone = replace(fitted, fit=fitted.fit._replace(reached=1), near=np.zeros((3, 1)))
    (sentence,) = cautions(alone, None)
    assert sentence.startswith("Only one of 3 starts")
    assert cautions(replace(alone, has_errors=True), None) == ()


def test_a_model_error_as_large_as_its_prior_allows_is_doubted(fitted):
    known = fitted.problem.experiment.with_model_error(bp.model_error.Embedded())
    problem = problem_with_errors(fitted, known.model_error)
    sampled = SampledPosterior(np.zeros((1, problem.dimension)), 0.0, 0.0)
    at_median = replace(fitted, problem=problem, has_errors=True)
    assert cautions(at_median, sampled) == ()
    largest = problem.at_sizes(problem.sizes | {"model_error.damping.size": 0.999})
    (sentence,) = cautions(replace(at_median, problem=largest), sampled)
    assert "the model is wrong by more than it allows" in sentence
    assert sentence.startswith(
        "The model error ended at the upper edge of its prior (model_error.damping.size 0.999): "
    )


@pytest.mark.parametrize(("extent", "is_told"), [(0.85, True), (0.3, False)])
def test_a_law_nearly_everywhere_is_told_as_that(extent, is_told):
    known = experiment().fix({name: value for name, value in TRUTH.items() if name != RATIO})
    bed = bp.effects.foundation(0.5, extent, dist.LogUniform(1e5, 1e9))
    data = (known + bed).data(measured(bp.effects.foundation(0.5, extent, 1e7)))
    null = null_hypothesis(known + bed, data)
    told = cautions(replace(null, effects=(bed,)), None)
    assert [words.startswith("foundation acts on 85 % of the structure: ") for words in told] == (
        [True] * is_told
    )


def test_a_mirror_image_that_fits_as_well_is_named():
    """A mass on a bar that is driven and read in its middle."""
    known = experiment().fix(TRUTH)
    middle = bp.Experiment(
        known.structure,
        sensors=[bp.Sensor("s1", at=0.5)],
        actuators=[bp.Actuator("a1", at=0.5)],
        frequency=LINES,
        observe=known.observe,
        noise=known.noise,
    )
    mass = bp.effects.point_mass(dist.Uniform(0.0, 1.0), dist.Uniform(0.1, 0.5))
    data = middle.data(recorded(middle + MASS, seed=2))
    (doubt,) = cautions(null_hypothesis(middle + mass, data), None)
    places = re.match(r"The data fit as well with (.*) = ([\d.]+) in the place of ([\d.]+):", doubt)
    assert places[1] == "structure.effects.point_mass.at"
    np.testing.assert_allclose(sorted(map(float, places.groups()[1:])), [0.313, 0.687], atol=2e-3)
