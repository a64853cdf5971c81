"""Several states of one structure: a mass that grows is one effect, with its size in each state."""

import dataclasses
import json

import numpy as np
import pytest

from bayes_placement import effects, improve
from bayes_placement.criticism.missing._change_between_states import (
    CHANGED,
    NEW,
    UNCHANGED,
    FoundEffect,
)
from bayes_placement.criticism.missing.states import courses_of
from bayes_placement.inference.residuals import Problem
from bayes_placement.inference.residuals_of_state import State
from tests.criticism.missing.test_before_and_after import imperfect, measured
from tests.criticism.small import experiment

MASSES = {"10 nuts": 0.05, "again": 0.05, "20 nuts": 0.1, "21 nuts": 0.108}


@pytest.fixture(scope="module")
def ledger():
    """The ledger of a mass that grows over four states, and the share of the work reported."""
    states = {"bare": measured(imperfect(1), 2)}
    for seed, (label, mass) in enumerate(MASSES.items(), 3):
        states[label] = measured(imperfect(1, effects.point_mass(0.313, mass)), seed)
    candidates = effects.library(experiment(), ["point_mass"])
    shares = []
    settings = {"candidates": candidates, "most_effects": 1}
    result = improve(experiment(), states, progress=shares.append, **settings)
    assert shares == sorted(shares)
    assert shares[-1] == 1
    return result


@pytest.mark.long
@pytest.mark.longest
def test_a_growing_mass_is_one_effect_of_the_right_size_in_each_state(ledger):
    (course,) = ledger.courses
    assert course.kind == "point_mass"
    for label, mass in MASSES.items():
        estimates = course.in_state[label].found.estimates
        assert estimates["mass"].low < mass < estimates["mass"].high
        assert estimates["at"].low < 0.313 < estimates["at"].high


@pytest.mark.long
@pytest.mark.longest
def test_only_what_has_changed_is_new(ledger):
    assert ledger.new == {label: () if label == "again" else ("point_mass",) for label in MASSES}
    changes = [state.change for state in ledger.courses[0].in_state.values()]
    assert changes == [NEW, UNCHANGED, CHANGED, CHANGED]


@pytest.mark.long
@pytest.mark.longest
def test_the_ledger_of_states_prints_one_line_with_all_sizes(ledger):
    table = ledger.table()
    assert [*table.columns] == [*MASSES]
    assert table.index[0].startswith("point_mass at 31")
    assert all(cell.startswith("mass ") for cell in table.iloc[0])
    text = str(ledger)
    assert '"bare" is the baseline. The baseline alone has a reduced chi-square' in text
    assert '"10 nuts": since "bare" point_mass is new (at 31' in text
    assert '"again": nothing is claimed to be new since "10 nuts".' in text
    assert 'since "again" point_mass is another: mass 0.1' in text


@pytest.mark.long
@pytest.mark.longest
def test_the_ledger_of_states_is_written(ledger, tmp_path):
    ledger.write(tmp_path / "states.json")
    content = json.loads((tmp_path / "states.json").read_text())
    assert content["baseline"] == "bare"
    assert [state["label"] for state in content["states"]] == [*MASSES]
    (course,) = content["effects"]
    assert course["states"]["20 nuts"]["change"] == CHANGED
    assert course["states"]["20 nuts"]["parameters"]["mass"]["unit"] == "kg"
    assert course["states"]["20 nuts"]["parameters"]["at"]["field"] == "at"


@pytest.mark.long
@pytest.mark.longest
def test_a_change_is_seen_that_two_sizes_alone_would_not_tell(ledger):
    """The error of the model at the mass is the same in both states, so that it cancels."""
    earlier, later = (ledger.courses[0].in_state[label] for label in ("20 nuts", "21 nuts"))
    uncertainty = earlier.found.estimates["mass"].standard_deviation
    assert MASSES["21 nuts"] - MASSES["20 nuts"] < 2 * uncertainty
    assert later.change == CHANGED


@pytest.mark.long
@pytest.mark.longest
def test_an_effect_stays_where_it_was_when_another_one_comes():
    """By itself the second state has a wrong place of the mass, beside the gain."""
    gain = effects.gain_error("s2", -0.06)
    small = effects.point_mass(0.313, 0.05)
    states = {
        "bare": measured(imperfect(201), 402),
        "mass": measured(imperfect(201, small), 702),
        "and gain": measured(imperfect(201, small, gain), 1407),
    }
    candidates = effects.library(experiment(), ["point_mass", "gain_error"])
    ledger = improve(experiment(), states, candidates=candidates, most_effects=2)
    assert ledger.new == {"mass": ("point_mass",), "and gain": ("gain_error",)}
    mass = ledger.courses[0].in_state["and gain"].found.estimates
    assert mass["at"].low < 0.313 < mass["at"].high
    assert mass["mass"].low < 0.05 < mass["mass"].high


@pytest.mark.long
@pytest.mark.longest
def test_two_effects_that_are_new_at_once_are_found_in_their_places():
    """Scanned before the gain, the mass seems to be elsewhere."""
    hidden = (effects.point_mass(0.313, 0.05), effects.gain_error("s2", -0.06))
    before, after = measured(imperfect(201), 402), measured(imperfect(201, *hidden), 1407)
    candidates = effects.library(experiment(), ["point_mass", "gain_error"])
    ledger = improve(experiment(), after, baseline=before, candidates=candidates, most_effects=2)
    assert sorted(ledger.verdict) == ["gain_error", "point_mass"]
    mass = {name.split(".")[-1]: value for name, value in ledger.steps[-1].parameters.items()}
    assert mass["at"].low < 0.313 < mass["at"].high
    assert mass["mass"].low < 0.05 < mass["mass"].high


@pytest.mark.long
@pytest.mark.longest
def test_each_of_two_masses_is_followed_through_the_states():
    """The first grows once the second is there; their numbers mean nothing."""
    first, second, grown = (
        effects.point_mass(at, mass, name=name)
        for at, mass, name in ((0.72, 0.1, "a"), (0.313, 0.15, "b"), (0.72, 0.2, "a"))
    )
    states = {
        "bare": measured(imperfect(1), 2),
        "first": measured(imperfect(1, first), 3),
        "second": measured(imperfect(1, first, second), 4),
        "grown": measured(imperfect(1, grown, second), 5),
    }
    library = effects.library(experiment(), ["point_mass"])
    added = dataclasses.replace(library, effects=library.effects[:1])
    ledger = improve(experiment(), states, candidates=added, most_effects=2)
    changes = [
        {label: state.change for label, state in course.in_state.items()}
        for course in ledger.courses
    ]
    assert changes == [
        {"first": NEW, "second": UNCHANGED, "grown": CHANGED},
        {"second": NEW, "grown": UNCHANGED},
    ]
    places = [course.last.estimates["at"] for course in ledger.courses]
    assert places[0].low < 0.72 < places[0].high and places[1].low < 0.313 < places[1].high
    assert ledger.ledgers["second"].verdict == ("point_mass", "point_mass")
    assert 'since "second" point_mass (at 71' in str(ledger)


def claimed_effect(kind="point_mass", *arguments):
    """An effect, as far as it matters which of them it is."""
    return FoundEffect(effects.EFFECTS[kind](*arguments), "", {}, None)


def test_an_effect_is_followed_as_long_as_it_is_not_elsewhere():
    mass = claimed_effect("point_mass", 0.3, 0.1)
    verdicts = iter([UNCHANGED, NEW, CHANGED])
    courses = courses_of(dict.fromkeys("abcd", (mass,)), lambda earlier, later: next(verdicts))
    changes = [[state.change for state in course.in_state.values()] for course in courses]
    assert changes == [[NEW, UNCHANGED], [NEW, CHANGED]]


def test_an_effect_is_followed_over_a_state_in_which_it_was_not_found():
    mass = claimed_effect("point_mass", 0.3, 0.1)
    (course,) = courses_of({"a": (mass,), "b": (), "c": (mass,)}, lambda *_: UNCHANGED)
    assert [*course.in_state] == ["a", "c"]


def test_another_candidate_is_another_effect():
    mass, other = claimed_effect("point_mass", 0.3, 0.1), claimed_effect("point_mass", 0.4, 0.1)
    courses = courses_of({"a": (mass,), "b": (other,)}, lambda *_: UNCHANGED)
    assert [[*course.in_state] for course in courses] == [["a"], ["b"]]


@pytest.mark.long
@pytest.mark.longest
def test_residuals_of_several_states_are_those_of_each(ledger):
    """With values of its own for some unknowns of a state, and the errors among those of a size."""
    first, last = (
        ledger.courses[0].in_state[label].found.hypothesis.problem
        for label in ("10 nuts", "20 nuts")
    )
    state_unknowns = frozenset(
        {"structure.effects.point_mass.mass", "model_error.ports.point_mass"}
    )
    further = (State(first.experiment, first.data, state_unknowns),)
    joint = Problem(
        last.experiment, last.data, sizes=last.sizes, baseline=last.baseline, further=further
    )
    point = np.random.default_rng(0).uniform(-1, 1, (2, joint.dimension))
    sized = last.at_sizes(last.sizes)
    alone = Problem(first.experiment, first.data, sizes=last.sizes)
    mine = np.zeros((2, alone.dimension))
    for name, place in alone.coordinates.places.items():
        source = f"{name} of state 2" if name in state_unknowns else name
        mine[:, place] = point[:, joint.coordinates.places[source]]
    expected = [
        sized.squares.residuals(point[:, : sized.dimension]),
        alone.squares.residuals(mine),
    ]
    residuals, log_scale = joint.squares.residuals(point)
    np.testing.assert_allclose(residuals, np.concatenate([part[0] for part in expected], axis=1))
    np.testing.assert_allclose(log_scale, expected[0][1] + expected[1][1])
    (size,) = (size for size in joint.unknown_sizes if size.owner.kind == "shape")
    ports = first.coordinates.places["model_error.ports.point_mass"]
    assert len(joint.errors_of(size)) == len(sized.errors_of(size)) + ports.stop - ports.start
