"""Labels and symmetries of maps of information, and places that cannot be tried."""

import io
import itertools

import jax
import numpy as np
import numpyro.distributions as dist
import pytest
from rich.console import Console

import bayes_placement as bp
from bayes_placement import information
from bayes_placement._shared import progress as shown_progress
from bayes_placement.design import maps
from bayes_placement.design.information.estimator import jackknife_error
from models import bar
from tests.effects import models_in_space

GRID = np.array([0.25, 0.4, 0.6, 0.75])
SMALL = information.KernelGain(draws=128, placement_draws=64)


@pytest.fixture(scope="module")
def experiment():
    return bar.placed(0.3, 0.3, None)


@pytest.fixture(scope="module")
def full_map(experiment):
    return bp.information_map(experiment, {"s1": GRID, "a1": GRID}, estimator=SMALL, key=3)


def test_a_map_is_labelled(full_map):
    assert full_map["information_gain"].dims == ("s1", "a1")
    np.testing.assert_array_equal(full_map["s1"], GRID)
    assert (
        full_map["a1"].attrs["units"] == "m"
        and full_map["information_gain"].attrs["units"] == "nat"
    )
    assert full_map.attrs["estimator"] == "KernelGain" and full_map.attrs["draws"] == 128
    assert (
        np.isfinite(full_map["information_gain"]).all()
        and (full_map["information_gain_se"] > 0).all()
    )


def test_each_cell_is_the_estimate_of_the_experiment_there(experiment, full_map):
    moved = bar.placed(0.4, 0.75, None)
    plan = SMALL.plan(moved, 3)
    gain = jax.jit(lambda: plan(moved, moved.nominal_values()))()
    cell = full_map.sel(s1=0.4, a1=0.75)
    assert float(gain.estimate) == pytest.approx(float(cell["information_gain"]), rel=1e-5)
    assert jackknife_error(np.asarray(gain.jackknife)) == pytest.approx(
        float(cell["information_gain_se"]), rel=1e-3
    )


def test_the_order_of_names_is_of_no_consequence(experiment, full_map):
    places = {"a1": GRID[2:], "s1": GRID[:1]}
    key = jax.random.key(3)  # the seed 3
    exchanged = bp.information_map(experiment, places, estimator=SMALL, key=key)["information_gain"]
    np.testing.assert_allclose(exchanged.values.T, full_map["information_gain"][:1, 2:], rtol=1e-5)


def test_the_map_is_symmetric_under_exchange_and_mirror(full_map):
    kl, error = full_map["information_gain"].values, full_map["information_gain_se"].values
    for image in (kl.T, kl[::-1, ::-1]):
        assert np.all(np.abs(kl - image) < 5 * np.sqrt(2) * error + 1e-3)
    assert kl.max() > 5 * kl.min()


def test_the_lead_of_the_best_has_an_error_of_its_own(full_map):
    lead = maps.lead(full_map)
    assert lead.difference == float(
        np.sort(full_map["information_gain"].values, axis=None)[-1:-3:-1] @ [1, -1]
    )
    distant = maps.lead(full_map, {"s1": 1, "a1": 1})
    assert distant.best == lead.best
    assert distant.difference > 5 * distant.difference_se > 0
    # What is common to both placements does not count.
    apart = np.hypot(
        full_map["information_gain_se"].isel(distant.best),
        full_map["information_gain_se"].isel(distant.other),
    )
    assert distant.difference_se < 1.5 * float(apart)


def test_one_transducer_may_be_moved_alone(experiment, full_map):
    line = bp.information_map(experiment, {"a1": GRID}, estimator=SMALL, key=3)
    assert line["information_gain"].dims == ("a1",)
    mid = bp.information_map(experiment, {"a1": [0.6], "s1": [0.3]}, estimator=SMALL, key=3)
    assert float(line["information_gain"].sel(a1=0.6)) == pytest.approx(
        float(mid["information_gain"][0, 0]), rel=1e-5
    )


def test_candidates_may_have_different_tolerances(experiment):
    wide, narrow = (bp.positions.Segment(0.25, within=within) for within in (0.04, 0.01))
    learnt = bp.information_map(experiment, {"s1": [wide, narrow]}, estimator=SMALL)[
        "information_gain"
    ]
    assert float(learnt[1]) > float(learnt[0])


def test_nominal_values_may_be_given(experiment):
    name = "structure.damping.ratio.2"
    places = {"s1": [0.25], "a1": [0.25]}
    low_ratio, high_ratio = (
        bp.information_map(experiment, places, estimator=SMALL, nominal={name: value})[
            "information_gain"
        ]
        for value in (0.025, 0.04)
    )
    assert float(low_ratio[0, 0]) > float(high_ratio[0, 0]) + 0.1


@pytest.mark.long
def test_candidates_on_several_members_of_a_frame():
    scene = models_in_space.frame()
    seats = [bp.positions.Member(*ends, centre=at, within=0.03) for ends, at in members(scene)]
    experiment = bp.Experiment(
        bp.Structure(scene.modes, damping=bp.damping.Modal(dist.Uniform(0.005, 0.03))),
        sensors=[bp.Sensor("s1", at=seats[0], directions=(1, 2, 3))],
        actuators=[bp.Actuator("a1", at=tuple(scene.place), directions=(2,))],
        frequency=scene.frequency[:3],
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.Gaussian(0.02),
    )
    learnt = bp.information_map(experiment, {"s1": seats}, estimator=SMALL)
    assert np.isfinite(learnt["information_gain"]).all() and learnt["information_gain"].std() > 0.01
    np.testing.assert_allclose(learnt["s1.z"], [seat.centre[2] for seat in seats])


def members(scene):
    corners = [models_in_space.FEET["left foot"], *models_in_space.CORNERS.values()]
    for start, end in itertools.pairwise(corners):
        yield (start, end), tuple(0.4 * np.array(start) + 0.6 * np.array(end))


@pytest.mark.parametrize(
    ("places", "message"),
    [
        ({}, "No places to try were given"),
        ({"s9": [0.2]}, r'"s9" were given, but .* It has s1, a1'),
        ({"s1": []}, r'Sensor "s1" was given no place to try'),
        ({"s1": [1.2]}, r'Sensor "s1": Segment\(1.2, .* no point on the structure'),
    ],
)
def test_places_that_cannot_be_tried_are_refused(experiment, places, message):
    with pytest.raises(ValueError, match=message):
        bp.information_map(experiment, places, estimator=SMALL)


def test_a_distribution_without_tolerance_cannot_be_moved():
    experiment = bp.Experiment(
        bar.bar(bar.PRIOR, 0.04),
        sensors=[bp.Sensor("s1", at=dist.Uniform(0.2, 0.3))],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=bar.PAPER_LINES,
        observe=bp.observe.LogAmplitude("velocity"),
        noise=None,
    )
    with pytest.raises(ValueError, match=r"a distribution that holds at its present place only"):
        bp.information_map(experiment, {"s1": [0.5]}, estimator=SMALL)


def test_a_nominal_value_of_a_place_is_refused(experiment):
    with pytest.raises(ValueError, match=r"nominal value of sensor.s1.position was given, which"):
        bp.information_map(
            experiment, {"a1": [0.3]}, estimator=SMALL, nominal={"sensor.s1.position": 0.2}
        )


def test_one_parameter_may_be_of_interest(experiment):
    """Case 1 of the paper: the other damping ratio is fixed."""
    name = "structure.damping.ratio.2"
    places = {"s1": [0.25], "a1": [0.25, 0.5]}
    alone = bar.placed(0.3, 0.3, None, structure=bar.bar(0.04, bar.PRIOR))
    want = bp.information_map(alone, places, estimator=SMALL)["information_gain"]
    learnt = bp.information_map(experiment, places, estimator=SMALL, about=[name])[
        "information_gain"
    ]
    np.testing.assert_allclose(learnt, want, rtol=1e-5)
    fixed = {"structure.damping.ratio.1": 0.03}
    shifted = bp.information_map(experiment, places, estimator=SMALL, about=[name], nominal=fixed)
    assert not np.allclose(shifted["information_gain"], want, rtol=1e-4)


@pytest.mark.parametrize("about", [[], ["structure.damping.ratio.3"], ["sensor.s1.position"]])
def test_what_is_no_parameter_cannot_be_of_interest(experiment, about):
    with pytest.raises(ValueError, match=r"about=.* names of unknown parameters are needed"):
        bp.information_map(experiment, {"s1": [0.5]}, estimator=SMALL, about=about)


def test_a_gain_above_the_limit_of_the_draws_is_warned_of():
    sharp = bar.placed(0.3, 0.3, bp.noise.Gaussian(0.001))
    coarse = information.ExpectedGain(draws=4, placement_draws=8, data_draws=8)
    with pytest.warns(
        information.InformationWarning, match=r"draws=4 draws .* log draws = 1.4 nat"
    ):
        bp.information_map(sharp, {"s1": [0.25]}, estimator=coarse)


def test_of_many_lines_some_are_used_and_it_says_so():
    many = bar.placed(0.3, 0.3, None, frequency=np.linspace(20.0, 420.0, 50))
    few = bar.placed(0.3, 0.3, None, frequency=np.asarray(many.frequency)[[12, 37]])
    places = {"s1": GRID[:2]}
    maps_of = [
        bp.information_map(many, places, estimator=SMALL, lines=2),
        bp.information_map(few, places, estimator=SMALL),
    ]
    assert [learnt.attrs["lines"] for learnt in maps_of] == [2, 2]
    first, second = (learnt["information_gain"].values for learnt in maps_of)
    np.testing.assert_allclose(first, second, rtol=1e-9)
    best = bp.place(many, places, estimator=SMALL, lines=2)
    assert str(best).endswith("2 of 50 lines are used, evenly over the band.")


def test_a_bar_is_shown_where_somebody_looks(monkeypatch, experiment):
    screen = io.StringIO()
    places = {"s1": GRID[:1]}
    for is_terminal in (True, False):
        console = Console(file=screen, force_terminal=is_terminal, width=80)
        monkeypatch.setattr(shown_progress, "progress_console", lambda console=console: console)
        bp.information_map(experiment, places, estimator=SMALL)
        assert ("map" in screen.getvalue()) == is_terminal
        screen.seek(0)
        screen.truncate()
