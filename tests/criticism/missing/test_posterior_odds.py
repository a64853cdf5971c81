"""odds: prior and posterior probabilities of made-up fits, by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from bayes_placement import effects
from bayes_placement.criticism.missing._hypotheses import Hypothesis
from bayes_placement.criticism.missing._posterior_odds import (
    NONE,
    NOTHING,
    PRIOR_OF_NONE,
    Comparison,
    p_value,
    steps_to,
)
from bayes_placement.inference.engines.laplace import laplace
from bayes_placement.inference.engines.levenberg_marquardt import Fit

COUNT = 1000


EFFECTS = {
    "point_mass": effects.point_mass(0.3, 0.1),
    "gain_error": effects.gain_error("s1", 0.1),
    "local_stiffness_loss": effects.local_stiffness_loss(0.3, 0.1, 0.1),
}


def made(kinds, evidence, squares=COUNT, dimension=4):
    """A hypothesis without an experiment: odds need nothing of it."""
    certain = laplace(np.zeros(dimension), 1e12 * np.eye(dimension))
    fit = Fit(np.zeros(dimension), 0.0, float(squares), certain, float(evidence), 1)
    problem = SimpleNamespace(count=COUNT, dimension=dimension)
    return Hypothesis(tuple(EFFECTS[kind] for kind in kinds), problem, fit)


def pool(*hypotheses, **variants):
    return Comparison(list(hypotheses), variants or {"point_mass": 1, "gain_error": 3})


def test_each_effect_halves_the_prior_and_shares_it_among_kinds_and_variants():
    nothing, mass, gain = made([], 0.0), made(["point_mass"], 0.0), made(["gain_error"], 0.0)
    one = pool(nothing, mass, gain)
    assert one.log_prior(nothing) == pytest.approx(np.log(1 / 2))
    assert one.log_prior(mass) == pytest.approx(np.log(1 / 4 / 2))
    assert one.log_prior(gain) == pytest.approx(np.log(1 / 4 / 2 / 3))


def test_probabilities_are_odds_that_sum_to_one():
    nothing, mass = made([], 0.0), made(["point_mass"], np.log(30.0))
    found = pool(nothing, mass).probabilities()
    assert found["point_mass"] / found[NOTHING] == pytest.approx(30 / 4)
    assert sum(found.values()) == pytest.approx(1.0)
    assert found["gain_error"] == 0


def test_an_effect_without_strong_evidence_is_not_claimed():
    nothing = made([], 0.0)
    weak, strong = made(["point_mass"], np.log(4 * 19.0)), made(["point_mass"], np.log(4 * 21.0))
    assert pool(nothing, weak).best().kinds == ()
    assert pool(nothing, strong).best().kinds == ("point_mass",)


def test_a_second_effect_must_pay_for_itself():
    single = made(["point_mass"], 500.0)
    pair = made(["point_mass", "gain_error"], 500.0 + np.log(2 * 2 * 3 * 19.0))
    assert pool(made([], 0.0), single, pair).best().kinds == ("point_mass",)


def test_data_that_no_candidate_explains_belong_to_none_of_these():
    bad = made(["point_mass"], 0.0, squares=6 * COUNT)
    found = pool(made([], -3000.0, squares=12 * COUNT), bad).probabilities()
    assert found[NONE] > 0.999


def test_data_that_are_explained_leave_little_for_none_of_these():
    good = made(["point_mass"], 0.0, squares=1.02 * COUNT)
    found = pool(made([], -3000.0, squares=7 * COUNT), good).probabilities()
    assert found[NONE] < PRIOR_OF_NONE
    assert found["point_mass"] > 0.95


def test_what_explains_the_data_down_to_the_noise_is_named_as_confounded():
    best = made(["point_mass"], 500.0)
    alike = made(["gain_error"], 480.0, COUNT + 8)
    other = made(["local_stiffness_loss"], 480.0, 1.3 * COUNT)
    found = pool(
        made([], 0.0), best, alike, other, point_mass=1, gain_error=1, local_stiffness_loss=1
    ).confounded()
    assert found == [("point_mass", "gain_error")]


def test_what_the_evidence_hardly_prefers_is_confounded_though_neither_explains_all():
    best = made(["point_mass"], 500.0, 1.5 * COUNT)
    other = made(["gain_error"], 499.0, 1.5 * COUNT)
    found = pool(made([], 0.0), best, other, point_mass=1, gain_error=1).confounded()
    assert found == [("point_mass", "gain_error")]


def test_p_value_falls_with_the_squares():
    assert p_value(made([], 0.0, COUNT)) == pytest.approx(0.46, abs=0.05)  # four are fitted
    assert p_value(made([], 0.0, 1.2 * COUNT)) < 1e-4


def test_the_way_goes_through_the_better_single_effect():
    mass, gain = made(["point_mass"], 100.0), made(["gain_error"], 200.0)
    both = made(["point_mass", "gain_error"], 900.0)
    assert steps_to(pool(made([], 0.0), mass, gain, both), both) == [
        (),
        ("gain_error",),
        ("gain_error", "point_mass"),
    ]


def test_the_way_leaps_where_nothing_was_fitted_between():
    both = made(["local_stiffness_loss", "gain_error"], 900.0)
    found = steps_to(pool(made([], 0.0), both), both)
    assert found == [(), ("gain_error", "local_stiffness_loss")]
