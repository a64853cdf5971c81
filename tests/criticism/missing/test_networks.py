"""A law that is in no list is named by improve; nothing is named where nothing acts."""

import json

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.criticism.missing._networks import _is_listed
from bayes_placement.criticism.reach._named_laws import NamedLaw, log_prior, simplest
from bayes_placement.criticism.reach._ports import ATTACHED, Port
from tests.criticism.reach.cantilever import AT, experiment, maxwell, measured


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


def test_networks_are_tried_unless_kinds_are_named():
    assert bp.effects.library(experiment()).networks
    assert not bp.effects.library(experiment(), ["point_mass"]).networks


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


def test_a_network_of_the_library_is_told_as_its_effect():
    assert _is_listed(named(Port("displacement", None), "m", 100.0))
    assert not _is_listed(named(Port("rotation", None), "m", 100.0))
