"""Two effects of one kind: which may be, how they count, and how they are found and told."""

import dataclasses
import re
from unittest.mock import Mock

import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.integrate import trapezoid

from bayes_placement import effects, plots
from bayes_placement.criticism.missing import _change_between_states, _more_effects
from bayes_placement.criticism.missing._before_and_after import _next_best
from bayes_placement.criticism.missing._candidates import numbered, renamed
from bayes_placement.criticism.missing._change_between_states import NEW, UNCHANGED, FoundEffect
from bayes_placement.criticism.missing._hypotheses import Hypothesis, null_hypothesis
from bayes_placement.criticism.missing._repeated import (
    may_be_added,
    named_alike,
    with_swapped_names,
)
from bayes_placement.criticism.missing._scanned_candidates import scanned
from bayes_placement.criticism.missing.improve import improve
from bayes_placement.criticism.missing.ledger import confounded_sentence
from bayes_placement.effects.library import kind_of
from bayes_placement.inference.engines.levenberg_marquardt import Fit, laplace
from bayes_placement.inference.residuals import Problem
from tests.criticism.missing.test_posterior_odds import comparison, hypothesis, steps_to
from tests.criticism.small import MASS, experiment, measured

OTHER = effects.point_mass(0.72, 0.25, name="other")
PLACES = "structure.effects.{}.at"
MASSES = effects.library(experiment(), ["point_mass"]).effects[:1]


def test_the_evidence_of_two_of_a_kind_is_the_integral_over_both():
    """Data y = (a + b, a² + b²) with noise, a and b standard normal, and Laplace's method."""
    measured_values, deviation = np.array([0.9, 1.7]), 0.02
    a, b = axes = np.meshgrid(*[np.linspace(-1, 2, 1501)] * 2, indexing="ij")
    residual = [(a + b - measured_values[0]), (a**2 + b**2 - measured_values[1])]
    log_density = -0.5 * sum(np.square(part / deviation) for part in residual)
    log_density -= 0.5 * (a**2 + b**2) + np.log(2 * np.pi) + np.log(2 * np.pi * deviation**2)
    integral = trapezoid(trapezoid(np.exp(log_density), dx=0.002), dx=0.002)
    number = np.argmax(np.where(a < b, log_density, -np.inf))
    mode = np.array([axis.ravel()[number] for axis in axes])
    slopes = np.array([[1.0, 1.0], 2 * mode]) / deviation
    gaussian = laplace(mode, slopes.T @ slopes + np.eye(2))
    log_evidence = log_density.max() + gaussian.log_volume
    fit = Fit(mode, 0.0, 0.0, gaussian, float(log_evidence), 1)
    pair = dataclasses.replace(hypothesis(["point_mass"] * 2, 0.0), fit=fit)
    assert pair.log_evidence == pytest.approx(np.log(integral), abs=0.02)


def test_all_collections_of_as_many_kinds_are_equally_probable():
    """So that the odds of two masses have the two orders of the evidence, and nothing else."""
    twice, both = hypothesis(["point_mass"] * 2, 0.0), hypothesis(["point_mass", "gain_error"], 0.0)
    pool = comparison(hypothesis([], 0.0), twice, both, point_mass=1, gain_error=1)
    assert pool.log_prior(twice) == pool.log_prior(both)
    assert pool.log_odds(twice) - pool.log_odds(both) == pytest.approx(np.log(2))
    thrice = hypothesis(["point_mass"] * 3, 0.0)
    assert thrice.log_evidence == pytest.approx(np.log(6))
    assert hypothesis(["point_mass", "gain_error", "local_stiffness_loss"], 0.0).log_evidence == 0


def test_probabilities_say_how_many_of_a_kind_are_missing():
    """Priors halve with each mass, and two of them have two orders."""
    once, twice = (hypothesis(["point_mass"] * n, np.log(4.0 * (2 * n - 1))) for n in (1, 2))
    pool = comparison(hypothesis([], 0.0), once, twice, point_mass=1)
    shares = pool.weighed.probabilities()
    assert list(shares)[:2] == ["point_mass", "point_mass_2"]
    assert shares["point_mass"] / shares["nothing_missing"] == pytest.approx(2.0 + 6.0)
    assert shares["point_mass_2"] / shares["nothing_missing"] == pytest.approx(6.0)
    alone = comparison(hypothesis([], 0.0), once, point_mass=1).weighed.probabilities()
    assert "point_mass_2" not in alone


def test_one_of_two_may_be_confounded_with_another_kind():
    best, other = hypothesis(["point_mass"] * 2, 9.0), hypothesis(["point_mass", "gain_error"], 9.0)
    pool = comparison(hypothesis([], -90.0), best, other)
    assert pool.weighed.confounded() == [("point_mass", "gain_error")]
    assert confounded_sentence("point_mass", "gain_error", best.kinds) == (
        "These data do not distinguish one point_mass of 2 from gain_error: either of them "
        "explains the data."
    )
    assert "from one more point_mass:" in confounded_sentence(
        "gain_error", "point_mass", other.kinds
    )


def test_the_way_to_two_of_a_kind_leads_over_one():
    one, two = hypothesis(["point_mass"], 100.0), hypothesis(["point_mass"] * 2, 900.0)
    pool = comparison(hypothesis([], 0.0), hypothesis(["gain_error"], 200.0), one, two)
    assert steps_to(pool, two) == [(), ("point_mass",), ("point_mass", "point_mass")]


def placed(effect):
    """A hypothesis that has an effect, as far as it matters which one."""
    problem = Mock(spec=Problem, experiment=experiment() + effect)
    return Hypothesis((effect,), problem, hypothesis([], 0.0).fit)


def is_allowed(effect, other=None):
    branch = placed(effect if other is None else other)
    return may_be_added(effect, placed(effect).problem, branch)


@pytest.mark.parametrize(
    "kind", ["point_mass", "ground_spring", "tuned_absorber", "local_stiffness_loss", "strut"]
)
def test_what_has_an_unknown_place_may_be_at_two(kind):
    candidate = effects.library(experiment(), [kind]).effects[0]
    assert is_allowed(candidate)


@pytest.mark.parametrize(
    "effect",
    [
        effects.point_mass(0.3, dist.Uniform(0.0, 1.0)),
        effects.cubic_stiffness(dist.Uniform(0.1, 0.9), dist.Uniform(0.0, 1e9)),
        *effects.library(
            experiment(),
            [
                "time_delay",
                "hysteretic_damping",
                "residual_modes",
                "sensor_mass",
                "exponential_window",
                "frequency_scale",
            ],
        ).effects,
    ],
    ids=lambda effect: effect.name,
)
def test_what_would_be_the_same_once_more_is_no_second(effect):
    assert not is_allowed(effect)


def test_the_whole_structure_changes_once_in_any_way():
    length, section = effects.library(experiment(), ["dimension_error"]).effects
    assert not is_allowed(length, section)


@pytest.mark.parametrize("kind", ["gain_error", "channel_delay", "misplaced_sensor"])
def test_two_sensors_may_have_the_same_fault_and_one_has_it_once(kind):
    first, second, *_ = effects.library(experiment(), [kind]).effects
    assert is_allowed(first, second)
    assert not is_allowed(first, first)


def test_numbers_of_names_count_on():
    mass = effects.point_mass(0.3, 0.1)
    second = numbered(mass, {"point_mass"})
    assert second.name == "point_mass_2"
    assert numbered(second, {"point_mass", "point_mass_2"}).name == "point_mass_3"
    own = renamed(mass, "clamp")
    assert numbered(own, {"clamp"}).name == "clamp_2"


@pytest.fixture(scope="module")
def found():
    """Hypotheses of up to two masses where two are hidden."""
    return searched(MASS, OTHER)


def searched(*hidden):
    null = null_hypothesis(experiment(), experiment().data(measured(*hidden, seed=2)))
    singles = _more_effects.single_effects(null, MASSES, lambda: None)
    return _more_effects.one_more_effect(singles, 1, lambda: None)


def places_of(hypothesis):
    values = hypothesis.problem.coordinates.named(hypothesis.fit.point[None])
    return {
        effect.name: float(values[PLACES.format(effect.name)][0]) for effect in hypothesis.effects
    }


def test_two_masses_are_found_at_their_places(found):
    best = found.best()
    assert best.kinds == ("point_mass", "point_mass")
    assert best.chi2_per_datum < 1.2
    assert sorted(places_of(best)) == ["point_mass", "point_mass_2"]
    assert sorted(places_of(best).values()) == pytest.approx([MASS.at, OTHER.at], abs=0.01)
    assert [h.kinds for h in found.hypotheses].count(best.kinds) == 1


def test_lines_count_by_their_noise_where_further_effects_are_chosen(found):
    """Near the truth as plain residuals; far from it so that all that is missed is one error."""
    best, null = found.best(), found.of(())
    logarithmic = best.problem.squares.residuals(best.fit.point[None], True)[0][0]
    weighted = logarithmic * _more_effects._weight(best, logarithmic)
    assert np.sum(weighted**2) == pytest.approx(np.sum(best.residual**2), rel=0.02)
    far = null.problem.squares.residuals(null.fit.point[None], True)[0][0]
    weights = _more_effects._weight(null, far)
    assert np.sum((far * weights) ** 2) == pytest.approx(null.problem.count, rel=1e-6)
    assert null.chi2_per_datum > 10


def test_what_takes_long_is_tried_beside_the_best_hypothesis_alone(found, monkeypatch):
    null, single = found.of(()), found.of(("point_mass",))
    (patch,) = effects.library(experiment(), ["segment_mass"]).effects
    assert patch.takes_long
    candidate = Mock(effect=patch, problem=null.problem.with_effect(patch))
    pool = found._replace(hypotheses=[null, single], candidates=[candidate])
    monkeypatch.setattr(_more_effects, "_by_promise", lambda *_: [candidate])
    pairs = _more_effects._pairs(pool, [single, null], 5)
    assert [[branch.kinds for branch, _ in of_kind] for of_kind in pairs] == [[single.kinds]]


def test_one_more_mode_is_tried_however_little_it_promises(found, monkeypatch):
    """What is promised is by a scan of the model without the first, which saw that one alone."""
    null, single = found.of(()), found.of(("point_mass",))
    mode, mass, gain = (
        effects.library(experiment(), [kind]).effects[0]
        for kind in ("further_mode", "point_mass", "gain_error")
    )
    problem = null.problem.with_effect(mode)
    branch = dataclasses.replace(single, effects=(mode,), problem=problem)
    candidates = [
        Mock(effect=effect, problem=null.problem.with_effect(effect)) for effect in (mass, gain)
    ]
    candidates.append(Mock(effect=mode, problem=problem))
    monkeypatch.setattr(_more_effects, "_by_promise", lambda *_: candidates)
    pool = found._replace(hypotheses=[null, branch], candidates=candidates)
    pairs = _more_effects._pairs(pool, [branch], 1)
    assert [kind_of(group[0][1]) for group in pairs] == ["point_mass", "further_mode"]


def test_what_is_given_up_keeps_its_place_among_the_kinds_that_promise_most(found, monkeypatch):
    null = found.of(())
    mass, gain, delay = (
        Mock(effect=effect, problem=null.problem.with_effect(effect))
        for kind in ("point_mass", "gain_error", "time_delay")
        for effect in effects.library(experiment(), [kind]).effects[:1]
    )
    monkeypatch.setattr(_more_effects, "_by_promise", lambda *_: [mass, gain, delay])
    pool = found._replace(hypotheses=[null], candidates=[mass, gain, delay])
    pairs = _more_effects._pairs(pool, [null], 2, lambda effect: effect is mass.effect)
    assert [[effect for _, effect in of_kind] for of_kind in pairs] == [[gain.effect]]


def test_one_mass_is_not_two():
    hypotheses = searched(MASS)
    assert {len(h.effects) for h in hypotheses.hypotheses} == {0, 1, 2}
    assert hypotheses.best().kinds == ("point_mass",)


def test_names_may_be_swapped_and_mean_nothing(found):
    best = found.best()
    swapped = with_swapped_names(best, "point_mass", "point_mass_2")
    first, second = places_of(best), places_of(swapped)
    assert (first["point_mass"], first["point_mass_2"]) == (
        second["point_mass_2"],
        second["point_mass"],
    )
    np.testing.assert_allclose(swapped.residual, best.residual, atol=1e-9)
    assert places_of(named_alike(swapped, best)) == first
    alone = found.of(("point_mass",))
    assert places_of(with_swapped_names(alone, "point_mass", "point_mass_2")).keys() == {
        "point_mass_2"
    }


@pytest.fixture(scope="module")
def ledger():
    candidates = dataclasses.replace(effects.library(experiment(), ["point_mass"]), effects=MASSES)
    return improve(experiment(), measured(MASS, OTHER, seed=2), candidates=candidates)


@pytest.mark.long
def test_the_ledger_names_both_masses_and_their_places(ledger):
    assert ledger.verdict == ("point_mass", "point_mass")
    assert [step.added for step in ledger.steps] == [None, "point_mass", "point_mass_2"]
    assert ledger.probabilities["point_mass_2"] > 0.99
    assert re.match(
        r"Missing: point_mass twice, 0\.3[45]\d* kg at 31\d\.?\d* mm and 0\.2[45]\d* kg "
        r"at 7[12]\d\.?\d* mm \(probability [\d.]+\); reduced chi-square falls from ",
        ledger.sentence(),
    )
    assert ledger.compared["effects"].tolist() == ["point_mass + point_mass", "point_mass", "none"]


@pytest.mark.long
def test_both_masses_are_marked_on_the_map_of_suspicion(ledger):
    strips = plots.ledger.suspicion(ledger).axes[0]
    (stars,) = [line for line in strips.lines if line.get_label() == "place as fitted"]
    assert sorted(stars.get_xdata()) == pytest.approx([MASS.at, OTHER.at], abs=0.01)
    assert len(set(stars.get_ydata())) == 1


def test_a_further_effect_of_a_kind_takes_the_place_of_none(found, monkeypatch):
    """Of the kinds that are tried on one mass, as many others as without a second mass."""
    null, best = found.of(()), found.of(("point_mass",))
    library = effects.library(experiment(), ["point_mass", "gain_error", "time_delay"])
    candidates = scanned([(null, effect) for effect in library.effects], lambda: None)
    by_promise = sorted(candidates, key=lambda candidate: candidate.predicted_cost)
    monkeypatch.setattr(_more_effects, "_by_promise", lambda *_: by_promise)
    pool = found._replace(hypotheses=[null, best], candidates=by_promise)
    groups = _more_effects._pairs(pool, [best], 2)
    kinds = [kind_of(group[0][1]) for group in groups]
    assert sorted(kinds) == ["gain_error", "point_mass", "time_delay"]
    assert kinds[0] == "point_mass"  # where it promises less than two others, it is not tried
    # A mass that was removed, best alone, need not be the best one beside another.
    signs = [effect.mass.icdf(0.5) > 0 for _, effect in groups[0]]
    assert sorted(map(bool, signs)) == [False, True]


def test_of_two_states_the_effect_that_is_new_has_a_name_of_its_own(found):
    """A mass was found in between; of two in the later state one is that, the other is new."""
    best = found.best()
    between = found.of(("point_mass",))
    near = with_swapped_names(best, "point_mass", "point_mass_2")
    for later in (best, near):
        alike = named_alike(later, between)
        distances = [
            abs(place - places_of(between)["point_mass"]) for place in places_of(best).values()
        ]
        nearest = places_of(alike)["point_mass"] - places_of(between)["point_mass"]
        assert abs(nearest) == pytest.approx(min(distances))
    (single,) = [h for h in found.hypotheses if len(h.effects) == 1]
    assert [kind_of(effect) for effect in _next_best(found, single)] == ["point_mass"]


def test_effects_are_followed_whatever_their_numbers():
    first = FoundEffect(effects.point_mass(0.3, 0.1), "", {}, None)
    second = first._replace(effect=renamed(first.effect, "point_mass_2"))
    assert first.is_comparable(second)
    assert not first.is_comparable(second._replace(effect=effects.point_mass(0.4, 0.1)))


def test_an_effect_is_compared_with_the_nearest_of_its_kind_alone(found, monkeypatch):
    """What is one mass in both states might else be either of two in each."""
    best = found.best()
    swapped = with_swapped_names(best, "point_mass", "point_mass_2")
    earlier = FoundEffect(best.effects[0], "", {}, best)
    same, other = (
        FoundEffect(effect, "", {}, swapped)
        for effect in sorted(swapped.effects, key=lambda e: e.name == earlier.effect.name)
    )
    asked = []
    monkeypatch.setattr(
        _change_between_states, "_log_odds", lambda *states: asked.append(states) or 0.0
    )
    assert _change_between_states.change(earlier, other) == NEW
    assert not asked
    assert _change_between_states.change(earlier, same) == UNCHANGED
    (renamed_earlier, *_), *_ = asked
    assert renamed_earlier.effect.name == same.effect.name == "point_mass_2"
    assert places_of(renamed_earlier.hypothesis) == places_of(swapped)


@pytest.mark.long
def test_in_words_one_of_two_is_not_both(ledger):
    doubted = dataclasses.replace(ledger, confounded=(("point_mass", "gain_error"),))
    assert any("one point_mass of 2 from gain_error" in line for line in doubted.words())


def test_parts_of_the_best_have_no_kind_more_often_than_it_has():
    part, other = (hypothesis([kind, kind], 0.0) for kind in ("point_mass", "gain_error"))
    best = hypothesis(["point_mass", "point_mass", "gain_error"], 900.0)
    pool = comparison(hypothesis([], -90.0), part, other, best)
    assert _more_effects._subsets_of_best(pool, 2, 5) == [part]
