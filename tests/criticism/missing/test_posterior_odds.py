"""Prior and posterior probabilities of hypotheses against odds by hand."""

from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from scipy.integrate import trapezoid

from bayes_placement import effects
from bayes_placement.criticism.missing import _rows
from bayes_placement.criticism.missing._hypotheses import Hypothesis
from bayes_placement.criticism.missing._outliers import Mixture
from bayes_placement.criticism.missing._posterior_odds import (
    Comparison,
    greatest_odds_expected,
    may_explain,
    p_value,
)
from bayes_placement.criticism.missing._weighed import NONE, NOTHING
from bayes_placement.criticism.missing.table import Policy
from bayes_placement.inference.engines.levenberg_marquardt import Fit, laplace
from bayes_placement.inference.residuals import Problem

COUNT = 1000


EFFECTS = {
    "point_mass": effects.point_mass(0.3, 0.1),
    "gain_error": effects.gain_error("s1", 0.1),
    "local_stiffness_loss": effects.local_stiffness_loss(0.3, 0.1, 0.1),
    "shear_and_rotary_inertia": effects.shear_and_rotary_inertia(),
}


def hypothesis(kinds, evidence, squares=COUNT, dimension=4):
    """A hypothesis without an experiment: odds need nothing of it."""
    certain = laplace(np.zeros(dimension), 1e12 * np.eye(dimension))
    fit = Fit(np.zeros(dimension), 0.0, float(squares), certain, float(evidence), 1)
    noise = SimpleNamespace(deviation=lambda data: 1.0)
    experiment = SimpleNamespace(noise=noise)
    problem = Mock(
        spec=Problem,
        count=COUNT,
        dimension=dimension,
        experiment=experiment,
        data=None,
        baseline=None,
    )
    return Hypothesis(tuple(EFFECTS[kind] for kind in kinds), problem, fit)


def comparison(*hypotheses, **variants):
    return Comparison(list(hypotheses), variants or {"point_mass": 1, "gain_error": 3})


def steps_to(pool, last):
    """Kinds from none to those of a hypothesis."""
    steps = pool.weighed.steps_to(pool.hypotheses.index(last))
    return [pool.hypotheses[number].kinds for number in steps]


def probabilities_of(*hypotheses, **variants):
    return comparison(*hypotheses, **variants).weighed.probabilities()


def confounded(*hypotheses, **variants):
    return comparison(*hypotheses, **variants).weighed.confounded()


def test_each_effect_halves_the_prior_and_shares_it_among_kinds_and_variants():
    nothing, mass, gain = (
        hypothesis([], 0.0),
        hypothesis(["point_mass"], 0.0),
        hypothesis(["gain_error"], 0.0),
    )
    pool = comparison(nothing, mass, gain)
    assert pool.log_prior(nothing) == pytest.approx(np.log(1 / 2))
    assert pool.log_prior(mass) == pytest.approx(np.log(1 / 4 / 2))
    assert pool.log_prior(gain) == pytest.approx(np.log(1 / 4 / 2 / 3))


def test_what_every_structure_has_shares_its_prior_with_no_other_kind():
    shear, both = (
        hypothesis(kinds, 0.0)
        for kinds in (["shear_and_rotary_inertia"], ["shear_and_rotary_inertia", "point_mass"])
    )
    kinds = dict.fromkeys(EFFECTS, 1)
    pool = comparison(shear, both, **kinds)
    assert pool.log_prior(shear) == pytest.approx(np.log(1 / 4))
    assert pool.log_prior(both) == pytest.approx(np.log(1 / 8 / len(kinds)))


def test_probabilities_are_odds_that_sum_to_one():
    nothing, mass = hypothesis([], 0.0), hypothesis(["point_mass"], np.log(30.0))
    probabilities = probabilities_of(nothing, mass)
    assert probabilities["point_mass"] / probabilities[NOTHING] == pytest.approx(30 / 4)
    assert sum(probabilities.values()) == pytest.approx(1.0)
    assert probabilities["gain_error"] == 0


def test_an_effect_without_strong_evidence_is_not_claimed():
    nothing = hypothesis([], 0.0)
    weak, strong = (
        hypothesis(["point_mass"], np.log(4 * 19.0)),
        hypothesis(["point_mass"], np.log(4 * 21.0)),
    )
    assert comparison(nothing, weak).best().kinds == ()
    assert comparison(nothing, strong).best().kinds == ("point_mass",)


def test_a_second_effect_must_pay_for_itself():
    single = hypothesis(["point_mass"], 500.0)
    pair = hypothesis(["point_mass", "gain_error"], 500.0 + np.log(2 * 2 * 3 * 19.0))
    assert comparison(hypothesis([], 0.0), single, pair).best().kinds == ("point_mass",)


def test_data_that_no_candidate_explains_belong_to_none_of_these():
    bad = hypothesis(["point_mass"], 0.0, squares=6 * COUNT)
    probabilities = comparison(
        hypothesis([], -3000.0, squares=12 * COUNT), bad
    ).weighed.probabilities()
    assert probabilities[NONE] > 0.999


def test_data_that_are_explained_leave_little_for_none_of_these():
    good = hypothesis(["point_mass"], 0.0, squares=1.02 * COUNT)
    probabilities = comparison(
        hypothesis([], -3000.0, squares=7 * COUNT), good
    ).weighed.probabilities()
    assert probabilities[NONE] < Policy().prior_of_none
    assert probabilities["point_mass"] > 0.95


@pytest.mark.parametrize(("determined", "factor"), [(10, 1.5), (100, 1.2), (100, 1.5), (160, 1.5)])
def test_the_gain_of_a_larger_error_is_that_of_its_integral(determined, factor):
    """Data of a linear model: the integral over the log-uniform factor, by the trapezoidal rule."""
    count = 240
    squares = factor**2 * (count - determined)
    candidate = hypothesis([], 0.0, squares, dimension=determined)
    candidate.problem.count = count
    log_factor = np.linspace(0.0, np.log(1e3), 20001)
    exponent = -0.5 * squares * np.expm1(-2 * log_factor) - (count - determined) * log_factor
    exact = np.log(trapezoid(np.exp(exponent), log_factor) / np.log(1e3))
    shares = probabilities_of(candidate)
    gain = np.log(shares[NONE] / shares[NOTHING]) - np.log(
        Policy().prior_of_none / (1 - Policy().prior_of_none)
    )
    assert gain == pytest.approx(exact, abs=0.3)


def test_only_what_has_odds_close_to_the_best_is_confounded_with_it():
    best = hypothesis(["point_mass"], 500.0)
    rival = hypothesis(["gain_error"], 495.0, COUNT + 8)
    other = hypothesis(["local_stiffness_loss"], 480.0, COUNT + 8)
    pairs = confounded(
        hypothesis([], 0.0), best, rival, other, point_mass=1, gain_error=1, local_stiffness_loss=1
    )
    assert pairs == [("point_mass", "gain_error")]


def test_what_the_evidence_hardly_prefers_is_confounded_though_neither_explains_all():
    best = hypothesis(["point_mass"], 500.0, 1.5 * COUNT)
    other = hypothesis(["gain_error"], 499.0, 1.5 * COUNT)
    pairs = comparison(
        hypothesis([], 0.0), best, other, point_mass=1, gain_error=1
    ).weighed.confounded()
    assert pairs == [("point_mass", "gain_error")]
    worse = hypothesis(["gain_error"], 495.0, 1.5 * COUNT)
    assert not confounded(hypothesis([], 0.0), best, worse, gain_error=1)


def test_p_value_falls_with_the_squares():
    assert p_value(hypothesis([], 0.0, COUNT)) == pytest.approx(0.46, abs=0.05)  # four are fitted
    assert p_value(hypothesis([], 0.0, 1.2 * COUNT)) < 1e-4


def test_the_way_goes_through_the_better_single_effect():
    mass, gain = hypothesis(["point_mass"], 100.0), hypothesis(["gain_error"], 200.0)
    pair = hypothesis(["point_mass", "gain_error"], 900.0)
    assert steps_to(comparison(hypothesis([], 0.0), mass, gain, pair), pair) == [
        (),
        ("gain_error",),
        ("gain_error", "point_mass"),
    ]


def test_the_way_leaps_where_nothing_was_fitted_between():
    pair = hypothesis(["local_stiffness_loss", "gain_error"], 900.0)
    steps = steps_to(comparison(hypothesis([], 0.0), pair), pair)
    assert steps == [(), ("gain_error", "local_stiffness_loss")]


def test_further_effects_are_expected_to_gain_no_more_than_the_one_before():
    single, other = hypothesis(["point_mass"], -700.0), hypothesis(["gain_error"], -900.0)
    pool = comparison(hypothesis([], -1000.0), single, other)
    gain = pool.log_odds(single) - pool.log_odds(pool.hypotheses[0])
    expected = pool.log_odds(single) + 2 * gain
    assert greatest_odds_expected(pool, 1, 2) == pytest.approx(expected)
    assert 290 < gain < 300  # the prior halves and shares what the evidence gains
    worse = comparison(hypothesis([], -1000.0), hypothesis(["point_mass"], -1010.0))
    assert greatest_odds_expected(worse, 1, 2) == worse.log_odds(worse.hypotheses[1])


@pytest.mark.parametrize(
    ("share", "left"), [(np.inf, 0.0), (1.0, 0.0), (0.6, 0.0), (0.1, 0.8), (0.0, 1.0)]
)
def test_where_the_noise_is_unknown_the_mean_square_is_expected_to_fall(monkeypatch, share, left):
    """By a share of what is left, which two more effects take away again."""
    gain = 0.5 * COUNT * min(np.log1p(share), 1e6)
    pool = comparison(hypothesis([], -1000.0), hypothesis(["point_mass"], -1000.0 + gain))
    for each in pool.hypotheses:
        monkeypatch.setattr(each.problem.experiment.noise, "deviation", lambda data: None)
    monkeypatch.setattr(_rows, "neumann_of", lambda each: (1.0, 1.0))
    monkeypatch.setattr(Hypothesis, "with_outliers", Mixture(0.0, np.zeros(1)))
    monkeypatch.setattr(Comparison, "_log_prior_of_kinds", lambda self, each: 0.0)
    expected = greatest_odds_expected(pool, 1, 2)
    single = pool.log_odds(pool.hypotheses[1])
    if left == 0.0:
        assert expected == np.inf
    else:
        # Half of the prior goes to each further effect.
        assert expected - single == pytest.approx(-0.5 * COUNT * np.log(left), abs=2)


@pytest.mark.parametrize(
    ("of_single", "of_pair", "expected"),
    [(60.0, 20.0, True), (5.0, 3.0, True), (60.0, 50.0, False), (60.0, 60.0, False)],
)
def test_a_third_effect_is_tried_where_it_may_leave_nothing_but_noise(of_single, of_pair, expected):
    pool = comparison(
        hypothesis([], -5e4, 100 * COUNT),
        hypothesis(["point_mass"], -4e4, of_single * COUNT),
        hypothesis(["gain_error"], -4.5e4, 90 * COUNT),
        hypothesis(["point_mass", "gain_error"], -3e4, of_pair * COUNT),
    )
    assert may_explain(pool, 2, 1, 0.01) == expected
    assert may_explain(pool, 1, 2, 0.01)  # two effects can hide each other
