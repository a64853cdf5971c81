"""Entries of claimed effects in words: places and numbers with intervals, in units for people."""

import json

import pytest

from bayes_placement.criticism.missing._claims_in_words import (
    claims_in_words,
    law_of_entry,
    where_in_words,
)
from bayes_placement.criticism.missing._parameter_estimate import ParameterEstimate


def estimate(mean, deviation, unit, field, word):
    ends = [mean + side * deviation for side in (-3.0, 3.0)]
    inner = [mean + side * deviation for side in (-2.0, 2.0)]
    of = ParameterEstimate(mean, deviation, *ends, unit, "pad", word, field, *inner)
    return json.loads(json.dumps(of.to_json()))


def entry(**other):
    return {
        "name": "network",
        "kind": "attached: dashpot - (dashpot | spring)",
        "acts_on": "displacement",
        "on": "",
        "place_m": [[0.3593]],
        "place_95_m": [[[0.3581, 0.3606]]],
        "law": "Dashpot(3.008) - (Spring(2060.0) | Dashpot(0.5))",
        "parameters": {
            "at": estimate(0.3593, 0.0006, "m", "at", "at"),
            "law.parts.1.viscosity": estimate(3.0, 0.02, "N s/m", "law", "law.parts.1.viscosity"),
            "law.parts.2.parts.1.stiffness": estimate(
                2.06e4, 300.0, "N/m", "law", "law.parts.2.parts.1.stiffness"
            ),
        },
        "probability": 0.9,
        "equivalent": [],
    } | other


def test_a_network_is_told_with_its_place_and_numbers():
    (sentence,) = claims_in_words([entry()])
    assert sentence == (
        "displacement at 359.3 mm (95 %: 358.1 to 360.6): dashpot of 3.000 N s/m "
        "(95 %: 2.960 to 3.040) - (spring of 20.60 kN/m (95 %: 20.00 to 21.20) | dashpot of "
        "0.5 N s/m) (probability 0.9)."
    )


def test_what_explains_the_data_as_well_follows_with_its_probability():
    other = entry(law="Springpot(1e4, 0.5, 30.0)", parameters={}, probability=0.04)
    first, second = claims_in_words([entry(equivalent=[other])])
    assert second.startswith("or displacement at 359.3 ")
    assert second.endswith("springpot of 1e+04 N/m, order 0.5, frequency 30 Hz (probability 0.04).")
    assert first == claims_in_words([entry()])[0]


def test_an_effect_of_the_library_is_told_by_its_name():
    mass = entry(
        name="sensor_mass",
        kind="sensor_mass",
        acts_on="displacement",
        on="sensor s2",
        place_m=[],
        place_95_m=[],
        law="Mass(0.2)",
        parameters={"mass": estimate(0.2, 0.01, "kg", "mass", "mass")},
    )
    (sentence,) = claims_in_words([mass])
    assert sentence == (
        "displacement sensor s2: sensor_mass, mass 0.200 kg (95 %: 0.180 to 0.220) "
        "(probability 0.9)."
    )
    assert law_of_entry(mass) is None


def test_a_part_is_told_once_and_edges_by_their_axes():
    parameters = {
        f"extent.{axis}": estimate(edge, 0.001, "m", "extent", f"extent.{axis}")
        for axis, edge in ((1, 0.06), (2, 0.04))
    }
    coat = {"name": "segment_mass", "kind": "segment_mass", "parameters": parameters}
    where = {"acts_on": "region", "on": "region bearing B", "place_m": [], "place_95_m": []}
    (sentence,) = claims_in_words([entry(**coat, **where)])
    assert sentence == (
        "region bearing B: segment_mass, extent along x 60.0 mm (95 %: 58.0 to 62.0), extent along "
        "y 40.0 mm (95 %: 38.0 to 42.0) (probability 0.9)."
    )


@pytest.mark.parametrize(
    ("places", "intervals", "words"),
    [
        (
            [[0.1], [0.4]],
            [[[0.1, 0.1]], [[0.38, 0.42]]],
            "at 100 mm to 400 mm (95 %: 380 to 420)",
        ),
        (
            [[0.5, 0.25, 0.0]],
            [[[0.5, 0.5], [0.2, 0.3], [0.0, 0.0]]],
            "at 500 mm, 250 mm (95 %: 200 to 300), 0 mm",
        ),
        (  # ends on either side of the edge between two nodes
            [[1.0499999], [1.0500001]],
            [[[1.0499999, 1.0499999]], [[1.0500001, 1.0500001]]],
            "at 1050 mm",
        ),
        ([], [], "displacement"),
    ],
)
def test_places_of_struts_and_in_space_are_told(places, intervals, words):
    told = where_in_words(entry(place_m=places, place_95_m=intervals))
    assert told.endswith(words)


def test_a_factor_is_told_before_its_law():
    scaled = entry(
        law="0.4 * (Spring(2.0) - Mass(0.1))",
        parameters={"strength": estimate(0.4, 0.01, "1", "strength", "strength")},
    )
    (sentence,) = claims_in_words([scaled])
    assert "): 0.400 (95 %: 0.380 to 0.420) * (spring of 2 N/m - mass of 0.1 kg)" in sentence
