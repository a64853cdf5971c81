"""Where a report says to measure next: by `Separation`, in bounded time, or why not."""

import dataclasses
import inspect
import json
import types

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared.labels import ABOUT
from bayes_placement.cli._findings import HOW_NEXT, where_next
from bayes_placement.design import next_measurement as searched
from bayes_placement.design.next_measurement import next_measurement
from bayes_placement.inference.alternative_explanation import Alternative

DRAWS = 200


def experiment(noise=0.02):
    modes = bp.beams.bar(8, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.03, 0.04))),
        sensors=[bp.Sensor("s1", at=bp.positions.Segment(0.24, within=0.01))],
        actuators=[bp.Actuator("a1", at=0.4)],
        frequency=np.linspace(100.0, 400.0, 13),
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=None if noise is None else bp.noise.Gaussian(noise),
    )


def alternative(name, mass, probability, of):
    """A mass in the left or in the right half of the bar: mirror images but for the actuator."""
    effect = bp.effects.point_mass(dist.Uniform(*mass), dist.Uniform(0.2, 0.4), name=name)
    explained = of + effect
    random = np.random.default_rng(1)
    draws = {
        unknown.name: np.asarray(random.uniform(*limits(unknown.distribution), DRAWS))
        for unknown in explained.unknowns
    }
    return Alternative(name, probability, explained, draws)


def limits(prior):
    return float(prior.low), float(prior.high)


@pytest.fixture(scope="module")
def alternatives():
    of = experiment()
    return (
        alternative("left", (0.3, 0.32), 1.0, of),
        alternative("right", (0.68, 0.7), 0.5, of),
    )


def test_the_best_place_tells_the_explanations_apart(alternatives, monkeypatch):
    monkeypatch.setattr(searched, "SECONDS", np.inf)
    following = next_measurement(experiment(), experiment().nominal_measurement(), alternatives)
    assert following["columns"] == ["s1 [m]", "expected gain [nat]", "its error [nat]"]
    at, gain, error = np.array(following["rows"]).T
    assert len(at) == searched.PLACES
    assert gain[0] == gain.max()
    share = np.array([2.0, 1.0]) / 3
    entropy = float(-(share * np.log(share)).sum())
    assert np.all(gain < entropy + 5 * error)
    assert gain[0] > 0.5 * entropy
    assert f"s1 at {at[0]:.4g} m" in following["sentence"]
    assert "tells left and right apart best" in following["sentence"]
    assert f"{entropy:.2g} nat that decide" in following["sentence"]


def test_the_search_ends_when_its_time_is_over(alternatives, monkeypatch):
    monkeypatch.setattr(searched, "SECONDS", 0.0)
    following = next_measurement(experiment(), experiment().nominal_measurement(), alternatives)
    places = sorted(row[0] for row in following["rows"])
    assert len(places) == searched.PLACES // searched.GROUPS
    assert places[0] < 0.2
    assert places[-1] > 0.7


def test_one_explanation_leaves_nothing_to_decide(alternatives):
    following = next_measurement(experiment(), experiment().nominal_measurement(), alternatives[:1])
    assert following["sentence"].startswith("Only one explanation is left")
    assert following["rows"] == []


@pytest.mark.parametrize(
    ("confounded", "count", "search", "said"),
    [
        ([("left", "right")], 2, {"sentence": "With s1 at 0.2 m."}, ["With s1 at 0.2 m."]),
        ([("left", "right")], 2, None, [HOW_NEXT]),
        ([], 2, {"sentence": "With s1 at 0.2 m."}, []),
        ([("left", "right")], 1, None, []),
    ],
)
def test_what_is_not_told_apart_ends_with_where_to_measure_next(confounded, count, search, said):
    about = {} if search is None else {"next": search}
    kept = types.SimpleNamespace(attrs={ABOUT: json.dumps(about)})
    result = types.SimpleNamespace(confounded=confounded, alternatives=range(count))
    assert inspect.unwrap(where_next)(kept, result) == said


@pytest.mark.long
def test_networks_are_told_apart_as_effects_of_the_library_are():
    of = experiment()
    spring = bp.effects.Spring(3e4)
    laws = {"solid": spring | (bp.effects.Dashpot(40.0) - spring), "spring": spring}
    random = np.random.default_rng(2)
    rivals = [
        Alternative(
            name,
            1.0,
            of + bp.effects.attached(dist.Uniform(0.3, 0.32), law),
            {
                "structure.effects.attached.at": random.uniform(0.3, 0.32, DRAWS),
                "structure.damping.ratio": random.uniform(0.03, 0.04, DRAWS),
                "sensor.s1.position": random.uniform(0.23, 0.25, DRAWS),
            },
        )
        for name, law in laws.items()
    ]
    following = next_measurement(of, of.nominal_measurement(), rivals)
    assert "tells solid and spring apart best" in following["sentence"]
    assert following["rows"][0][1] > 5 * following["rows"][0][2]


def test_what_no_place_tells_apart_is_said(alternatives):
    twice = [alternatives[0], dataclasses.replace(alternatives[0], name="again")]
    following = next_measurement(experiment(), experiment().nominal_measurement(), twice)
    assert following["sentence"].startswith("Wherever s1 is, one more measurement does not tell ")
    assert " left and again apart: at most " in following["sentence"]


def test_why_no_place_was_searched_for_is_said(alternatives):
    without_noise = experiment(noise=None)
    following = next_measurement(without_noise, without_noise.nominal_measurement(), alternatives)
    assert following["sentence"].startswith("Where to measure next was not searched for: ")
    assert following["rows"] == []
