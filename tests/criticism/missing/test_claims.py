"""Entries of claimed effects for a file: on what they act, nested places, laws as typed."""

import json

import numpy as np
import numpyro.distributions as dist
import pytest

from bayes_placement import effects
from bayes_placement.criticism.missing._claims import _entry
from bayes_placement.criticism.missing._estimates import estimates
from bayes_placement.criticism.missing._fitted_candidates import extended
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.criticism.missing._rows import places_of
from bayes_placement.laws.catalogue import canonical
from bayes_placement.laws.elements import typed
from tests.criticism.small import MASS, experiment, measured

SPRING = effects.Spring(dist.LogUniform(1e3, 1e7))
ANYWHERE = dist.Uniform(0.0, 1.0)


@pytest.fixture(scope="module")
def null():
    setup = experiment()
    return null_hypothesis(setup, setup.data(measured(MASS, seed=4)))


def candidates():
    (part,) = effects.library(experiment(), ["segment_mass"]).effects
    gain = effects.library(experiment(), ["gain_error"]).effects[0]
    return {
        "displacement": effects.attached(ANYWHERE, SPRING - effects.Dashpot(40.0)),
        "relative": effects.strut(ANYWHERE, 0.7, SPRING),
        "cut": effects.inserted(ANYWHERE, SPRING, motion="displacement"),
        "region": part,
        "channel": gain,
    }


@pytest.mark.parametrize(
    "acts_on",
    ["displacement", "relative", "channel"]
    + [pytest.param(word, marks=pytest.mark.long) for word in ("cut", "region")],
)
def test_an_entry_says_where_and_by_which_law(null, acts_on):
    effect = candidates()[acts_on]
    (fitted,) = extended([[(null, effect)]], lambda: None)
    entry = _entry(fitted.effects[0], fitted, estimates(fitted, None), 0.5, 0.8)
    assert json.loads(json.dumps(entry)) == entry
    assert (entry["acts_on"], entry["probability"]) == (acts_on, 0.4)
    ends = {"relative": 2, "region": 2, "channel": 0}.get(acts_on, 1)
    assert [len(place) for place in entry["place_m"]] == [1] * ends
    assert [np.shape(place) for place in entry["place_95_m"]] == [(1, 2)] * ends
    for place, sides in zip(entry["place_m"], entry["place_95_m"], strict=True):
        assert sides[0][0] - 1e-9 <= place[0] <= sides[0][1] + 1e-9  # a known one is its mean
    if acts_on == "relative":
        assert entry["place_m"][1] == pytest.approx([0.7])
    if acts_on == "region":
        assert entry["place_m"][0] < entry["place_m"][1]  # least first
    law = entry["law"]
    assert (law is None) == (acts_on == "channel")
    assert law is None or entry["law_tree"] == canonical(typed(law).tree())
    assert law is None or not law.startswith("1.0 *")  # what is not scaled is typed without
    for number in entry["parameters"].values():
        (low, high), (inner, outer) = number["interval_99"], number["interval_95"]
        assert low < inner < number["mean"] < outer < high and number["unit"]


def test_a_support_is_at_its_end(null):
    """It has no unknown place, and what acts close to it is at the same one."""
    support = effects.compliant_support(dist.LogUniform(1e-9, 1e-7), motion="translation")
    (fitted,) = extended([[(null, support)]], lambda: None)
    entry = _entry(fitted.effects[0], fitted, estimates(fitted, None), 0.5, 0.8)
    assert entry["place_m"] == [[0.0]] and entry["place_95_m"] == [[[0.0, 0.0]]]
    assert [*places_of(fitted)] == [("compliant_support", ((0.0,), (0.0,)))]
    right = effects.compliant_support(1e-8, end="right", motion="translation")
    setup = experiment()
    assert right.location(setup.structure.modes, setup.instruments) == 1.0
