"""A law that is in no list is named by improve; nothing is named where nothing acts."""

import dataclasses
import functools
import json

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.criticism.missing import _model_error_choice, _networks
from bayes_placement.criticism.missing._fitted_candidates import extended
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.missing._model_error_choice import Question
from bayes_placement.criticism.missing._more_effects import (
    ALL,
    NARROW,
    single_effects,
    with_listed_replaced,
)
from bayes_placement.criticism.missing._networks import (
    LISTED,
    LawsBeside,
    _network,
    priors_of_networks,
    with_networks,
    with_other_laws,
)
from bayes_placement.criticism.missing._posterior_odds import Comparison, p_value
from bayes_placement.criticism.reach._named_laws import (
    NamedLaw,
    log_prior,
    simplest,
    squares_with_any_law,
)
from bayes_placement.criticism.reach._ports import ATTACHED, PLACES, Port, ports_of
from bayes_placement.inference.chi2 import LEVEL
from bayes_placement.laws import Dashpot, Mass, Spring
from tests.criticism.reach.cantilever import AT, experiment, maxwell, measured


@pytest.fixture
def displacements(monkeypatch):
    """Displacements alone are looked at, at few places, which takes a fraction of the time."""

    def ports(asked):
        return [port for port in ports_of(asked) if port.acts_on == "displacement"]

    monkeypatch.setattr(_networks, "ports_of", ports)
    monkeypatch.setitem(PLACES, 1, 4)


def library(networks=True):
    chosen = bp.effects.library(experiment(), ["point_mass", "ground_spring", "tuned_absorber"])
    return bp.effects.Library(chosen.experiment, chosen.effects, networks)


@pytest.mark.long
def test_a_network_is_named_where_the_list_has_a_wrong_name():
    ledger = bp.improve(experiment(), measured(maxwell), candidates=library())
    assert ledger.verdict == ("attached: dashpot - spring",)
    assert ledger.steps[-1].chi2_per_datum == pytest.approx(1.0, abs=0.25)
    (claim,) = json.loads(json.dumps(ledger.to_json()["effects"]))
    assert (claim["name"], claim["acts_on"]) == ("network", "displacement")
    assert claim["law_tree"] == ["-", "c", "k"]
    ((place,),), (((low, high),),) = claim["place_m"], claim["place_95_m"]
    assert low < AT < high and place == pytest.approx(AT, abs=2e-3)
    assert claim["probability"] + sum(e["probability"] for e in claim["equivalent"]) < 1.0 + 1e-9


@pytest.mark.long
def test_no_network_is_claimed_where_nothing_acts():
    ledger = bp.improve(experiment(), measured(), candidates=library())
    assert ledger.verdict == () and not ledger.to_json()["effects"]


@pytest.mark.long
@pytest.mark.longest
def test_a_network_that_is_new_is_named_and_stays_what_it_is():
    """With a model error that both states share; it is unchanged in a third state."""
    states = {
        "bare": measured(seed=1),
        "mount": measured(maxwell, seed=2),
        "again": measured(maxwell, seed=3),
    }
    ledger = bp.improve(experiment(), states, candidates=library(), most_effects=1)
    network = ("attached: dashpot - spring",)
    assert ledger.new == {"mount": network, "again": ()}
    for state in ledger.ledgers.values():
        assert state.verdict == network
        assert state.steps[-1].chi2_per_datum == pytest.approx(1.0, abs=0.15)
        assert state.reach.words()[0].startswith("New since the baseline: displacement at 2")
    at = ledger.courses[0].last.estimates["at"]
    assert at.low < AT < at.high


@pytest.mark.long
@pytest.mark.longest
def test_no_network_is_new_where_both_states_are_alike():
    settings = {"baseline": measured(seed=1), "candidates": library()}
    ledger = bp.improve(experiment(), measured(seed=2), **settings)
    assert ledger.verdict == () and ledger.reach is None


def test_networks_are_tried_unless_kinds_are_named():
    assert bp.effects.library(experiment()).networks
    assert not bp.effects.library(experiment(), ["point_mass"]).networks


def test_what_is_listed_is_all_that_is_tried_by_default_but_networks():
    usual, listed = bp.effects.library(experiment()), bp.effects.library(experiment(), ["listed"])
    assert (listed.kinds, listed.networks) == (usual.kinds, False)
    more = bp.effects.library(experiment(), ["listed", "point_mass", "phase_drift"])
    assert more.kinds == [*usual.kinds, "phase_drift"]
    with pytest.raises(
        ValueError, match=r"no effect 'listd'. Did you mean 'listed'\? .*; listed means"
    ):
        bp.effects.library(experiment(), ["listd"])


def test_each_further_element_costs_and_all_networks_share_the_prior():
    total = sum(np.exp(log_prior(tree, ATTACHED)) for tree in ATTACHED)
    assert total == pytest.approx(0.5 + 0.25 + 0.125)
    assert log_prior("k", ATTACHED) > log_prior(["-", "c", "k"], ATTACHED)


class Fitted:
    def __init__(self, squares):
        self.squares = squares


def named(port, tree, squares):
    nothing = np.zeros(0)
    return NamedLaw(port, tree, None, None, nothing, nothing, Fitted(squares), 0.0)


@pytest.mark.parametrize(
    ("tree", "squares", "is_told"),
    [
        ("p", 100.0, True),
        (["|", "k", "p"], 99.0, False),  # no better than the springpot alone
        (["|", "k", "p"], 80.0, True),
    ],
)
def test_a_network_that_is_a_simpler_one_is_not_told(tree, squares, is_told):
    port, elsewhere = Port("displacement", None), Port("rotation", None)
    law = named(port, tree, squares)
    others = [named(port, "p", 100.0), named(elsewhere, "k", 10.0)]
    assert (law in simplest([law, *others])) == is_told


def test_a_network_of_another_search_has_its_prior_here():
    """Without it, what was found in a state in between would cost nothing for its elements."""
    setup = experiment()
    null = null_hypothesis(setup, setup.data(measured()))
    law = Mass(1.0) | Dashpot(2.0)
    mount, listed = bp.effects.attached(0.1, law), bp.effects.point_mass(0.2, 0.1)
    between = dataclasses.replace(null, effects=(mount, listed))
    comparison = Comparison([null], {"point_mass": 1})
    kind = "attached: dashpot | mass"
    expected = {kind: log_prior(["|", "c", "m"], ATTACHED)}
    assert priors_of_networks(between, comparison) == pytest.approx(expected)
    assert not priors_of_networks(between, Comparison([null], {kind: 1}))


@functools.cache
def beside_nothing(*others):
    """Laws at one kind of port beside the model as given, with so many further masses."""
    masses = [(place, lambda w: -0.08 * w**2) for place in others]
    setup = experiment()
    stiff = functools.partial(maxwell, stiffness=4e5, viscosity=600.0)
    null = null_hypothesis(setup, setup.data(measured(stiff, others=masses)))
    return LawsBeside(null, lambda: None)


def test_any_law_explains_one_effect_between_the_places_that_are_tried(displacements):
    reached, _ = beside_nothing()._at_ports
    left, least = squares_with_any_law(reached), reached[0].squares.min()
    assert left < 0.75 * beside_nothing().base.problem.count < 0.5 * least
    assert beside_nothing().may_explain(LEVEL)


def test_no_law_at_one_port_explains_effects_at_two_places(displacements):
    beside = beside_nothing(0.45, 0.55)
    assert not beside.may_explain(LEVEL)
    tried = {effect.name: beside.is_bounded(effect) for effect in library().effects}
    assert tried == {"point_mass": True, "ground_spring": True, "tuned_absorber": True}
    coat = bp.effects.segment_mass(0.3, 0.1, 0.05)
    assert beside.is_bounded_or_long(coat) and not beside.is_bounded(coat)
    assert not beside.is_bounded_or_long(bp.effects.time_delay(1e-4))
    assert not beside.is_bounded(bp.effects.compliant_support(1e-4))


@pytest.mark.parametrize(
    ("must_explain", "breadth", "rule"),
    [(True, NARROW, "is_bounded_or_long"), (True, ALL, "is_bounded"), (False, NARROW, None)],
)
def test_what_must_explain_is_looked_for_at_no_port_where_no_law_does(
    displacements, monkeypatch, must_explain, breadth, rule
):
    beside = beside_nothing(0.45, 0.55)
    setup = experiment()
    tried = library()
    question = Question.of(setup, beside.base.problem.data, tried, None, level=LEVEL)
    given_up = []

    def one_more(comparison, depth, tick, breadth, meanwhile=None, is_given_up=None):
        given_up.append(is_given_up)
        return comparison

    for name, stub in {
        "laws_beside_best": lambda *_: beside,
        "one_more_effect": one_more,
        "with_networks": lambda comparison, _: comparison,
        "with_other_laws": lambda comparison, *_: comparison,
        "with_listed_replaced": lambda comparison, _: comparison,
    }.items():
        monkeypatch.setattr(_model_error_choice, name, stub)
    comparison = Comparison([beside.base], {"point_mass": 1})
    _model_error_choice.deeper(question, comparison, 2, breadth, lambda: None, must_explain)
    assert given_up == [getattr(beside, rule) if rule else None]


@pytest.mark.parametrize("is_replaced", [True, False])
def test_laws_are_looked_for_again_beside_what_replaced_a_listed_effect(
    displacements, monkeypatch, is_replaced
):
    """A mass on a spring was the best law beside the wrong effect; a mass alone beside another."""
    base = beside_nothing(0.45, 0.55).base
    fit = base.fit._replace(log_evidence=base.fit.log_evidence + 1e6)
    better = dataclasses.replace(base, effects=(bp.effects.point_mass(0.45, 0.08),), fit=fit)
    question = Question.of(experiment(), base.problem.data, library(), None, level=LEVEL)
    before = Comparison([base], {"point_mass": 1})
    after = before.with_hypotheses([better]) if is_replaced else before
    looked = []

    def other_laws(comparison, *_):
        looked.append(comparison.best().kinds)
        return comparison

    for name, stub in {
        "laws_beside_best": lambda *_: None,
        "one_more_effect": lambda comparison, *_: comparison,
        "with_other_laws": other_laws,
        "with_listed_replaced": lambda *_: after,
    }.items():
        monkeypatch.setattr(_model_error_choice, name, stub)
    found = _model_error_choice.deeper(question, before, 2, ALL, lambda: None)
    assert found is after and looked == [(), ("point_mass",)][: 1 + is_replaced]


def test_a_network_of_the_library_is_told_as_its_effect():
    listed = [*LISTED.values()]
    for acts_on in ("displacement", "rotation"):
        assert _network(named(Port(acts_on, None), "m", 100.0)) in listed
    assert _network(named(Port("rotation", None), "c", 100.0)) not in listed


@pytest.mark.long
@pytest.mark.longest
def test_a_network_is_told_as_such_where_its_effect_is_not_tried():
    data = experiment().data(measured(lambda w: -0.08 * w**2))
    null = null_hypothesis(experiment(), data)
    springs = [effect for effect in library().effects if effect.name == "ground_spring"]
    found = with_networks(
        single_effects(null, springs, lambda: None), LawsBeside(null, lambda: None)
    )
    assert found.best().kinds == ("attached: mass",)


@pytest.mark.long
@pytest.mark.longest
def test_beside_a_second_effect_a_network_gives_way_to_a_part_of_it():
    """Alone, a mass on two others by a dashpot took up a little of what the second mass does."""
    setup = experiment()
    masses = [(0.45, lambda w: -0.05 * w**2)]
    data = setup.data(measured(lambda w: -0.08 * w**2, others=masses))
    chosen = library().effects
    mass = next(effect for effect in chosen if effect.name == "point_mass")
    size = mass.mass
    law = Mass(size) | (Dashpot(dist.LogUniform(1.0, 1e4)) - Mass(size))
    null = null_hypothesis(setup, data)
    singles = single_effects(null, chosen, lambda: None)
    (first,) = extended([[(null, bp.effects.attached(mass.at, law))]], lambda: None)
    (both,) = extended([[(first, mass)]], lambda: None)
    with_network = singles.with_hypotheses([both], {first.kinds[0]: -3.0})
    assert with_network.best().kinds == both.kinds
    simpler = with_other_laws(with_network, lambda: None)
    assert simpler.best().kinds == ("point_mass", "point_mass")
    assert p_value(simpler.best()) > 0.01


@pytest.mark.long
@pytest.mark.longest
def test_beside_a_network_a_listed_effect_gives_way_to_a_simpler_one():
    """An absorber that came first is no more than a mass once the mount is known."""
    setup = experiment()
    data = setup.data(measured(maxwell, others=[(0.45, lambda w: -0.05 * w**2)]))
    chosen = library().effects
    absorber = next(effect for effect in chosen if effect.name == "tuned_absorber")
    mount = Dashpot(dist.LogUniform(1.0, 1e4)) - Spring(dist.LogUniform(1e2, 1e7))
    null = null_hypothesis(setup, data)
    singles = single_effects(null, chosen, lambda: None)._replace(hypotheses=[null])
    held = bp.effects.attached(dist.Uniform(0.25, 0.31), mount)
    about = dataclasses.replace(absorber, at=dist.Uniform(0.42, 0.48))
    (first,) = extended([[(null, held)]], lambda: None)
    (both,) = extended([[(first, about)]], lambda: None)
    with_network = singles.with_hypotheses([both], {first.kinds[0]: -3.0})
    assert with_network.best().kinds == both.kinds
    simpler = with_listed_replaced(with_network, lambda: None)
    assert simpler.best().kinds == (*first.kinds, "point_mass")
    # Found once more, from another start, it is no more probable.
    assert simpler.with_hypotheses([simpler.best()]).hypotheses == simpler.hypotheses
    assert p_value(simpler.best()) > 0.01


@pytest.mark.long
@pytest.mark.longest
def test_beside_a_second_effect_a_listed_spring_gives_way_to_one_with_a_loss():
    setup = experiment()
    others = [(0.45, lambda w: 4j * w)]
    data = setup.data(measured(lambda w: 30.0 * (1 + 0.6j) + 0 * w, slope=True, others=others))
    kinds = ["rotational_spring", "ground_dashpot"]
    chosen = bp.effects.library(setup, kinds).effects
    null = null_hypothesis(setup, data)
    singles = single_effects(null, chosen, lambda: None)._replace(hypotheses=[null])
    (first,) = extended([[(null, chosen[1])]], lambda: None)
    (both,) = extended([[(first, chosen[0])]], lambda: None)
    found = with_other_laws(singles.with_hypotheses([both]), lambda: None)
    assert found.log_odds(found.best()) > found.log_odds(both) + 3.0
    assert found.best().kinds == ("attached to rotation: lossy spring", "ground_dashpot")
    assert p_value(found.best()) > 0.01
