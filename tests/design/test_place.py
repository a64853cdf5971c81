"""The best placement of a grid, forbidden places, and the significance of its lead."""

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement import design, information
from bayes_placement.design.search._search_space import PlacementRules
from models import bar
from tests.effects import models_in_space

GRID = np.array([0.1, 0.25, 0.4, 0.5, 0.62, 0.75])
SMALL = information.KernelGain(draws=128, placement_draws=64)


@pytest.fixture(scope="module")
def experiment():
    """About the second ratio: best where the second mode moves most, at a quarter of the bar."""
    return bar.placed(0.3, 0.4, None, structure=bar.bar(0.04, bar.PRIOR))


@pytest.fixture(scope="module")
def full_grid(experiment):
    return bp.place(experiment, {"s1": GRID, "a1": GRID}, estimator=SMALL, least_distance=0.0)


def test_the_best_of_a_grid_is_that_of_the_map(experiment, full_grid):
    table = bp.information_map(experiment, {"s1": GRID, "a1": GRID}, estimator=SMALL)
    lead = design.lead(table)
    assert full_grid.positions == {name: GRID[place] for name, place in lead.best.items()}
    assert set(full_grid.positions.values()) <= {0.25, 0.75}
    assert full_grid.information_gain == pytest.approx(
        float(table["information_gain"].max()), rel=1e-5
    )
    assert (full_grid.lead, full_grid.lead_se) == pytest.approx(
        (lead.difference, lead.difference_se), rel=1e-3
    )
    assert (
        len(full_grid.table) == GRID.size**2
        and full_grid.table["information_gain"].is_monotonic_decreasing
    )


def test_one_at_a_time_finds_as_good_a_place_by_fewer_trials(experiment, full_grid):
    placement = bp.place(
        experiment, {"s1": GRID, "a1": GRID}, estimator=SMALL, search=design.Sequential()
    )
    assert placement.information_gain == pytest.approx(
        full_grid.information_gain, abs=4 * full_grid.information_gain_se
    )
    assert len(placement.table) < len(full_grid.table)
    assert list(placement.table.columns) == list(full_grid.table.columns)


def test_what_is_mounted_stays(experiment):
    placement = bp.place(experiment, {"s1": GRID}, estimator=SMALL)
    assert set(placement.positions) == {"s1"} and placement.positions["s1"] in (0.25, 0.75)


def test_nothing_sits_where_it_is_forbidden(experiment, full_grid):
    placement = bp.place(
        experiment, {"s1": GRID, "a1": GRID}, estimator=SMALL, forbidden=[(0.0, 0.3), (0.7, 0.8)]
    )
    assert set(placement.table["s1"]) == {0.4, 0.5, 0.62}
    assert placement.information_gain < full_grid.information_gain


def test_sensors_keep_their_distance():
    base = bar.placed(0.3, 0.25, None)
    two = bp.Experiment(
        base.structure,
        sensors=[
            bp.Sensor(name, at=bp.positions.Segment(at, within=0.04))
            for name, at in (("s1", 0.4), ("s2", 0.7))
        ],
        actuators=[bp.Actuator("a1", at=bp.positions.Segment(0.25, within=0.04))],
        frequency=base.frequency,
        observe=base.observe,
        noise=None,
    )
    places = {"s1": GRID[:4], "s2": GRID[:4]}
    placement = bp.place(two, places, estimator=SMALL, least_distance=0.2)
    assert np.all(np.abs(placement.table["s1"] - placement.table["s2"]) >= 0.2)
    alone = bp.place(two, {"s1": GRID}, estimator=SMALL, least_distance=0.2)
    assert np.all(np.abs(alone.table["s1"] - 0.7) >= 0.2)


def test_the_result_says_what_it_took(full_grid):
    assert full_grid.search == "Exhaustive" and full_grid.evaluations == GRID.size**2
    assert (
        full_grid.omitted == ()
        and full_grid.cost == 0
        and full_grid.net_gain == full_grid.information_gain
    )
    assert [*full_grid.table.columns] == [
        "s1",
        "a1",
        "information_gain",
        "information_gain_se",
        "cost",
        "net_gain",
    ]


def test_adding_one_at_a_time_begins_with_sensor_and_actuator_together(experiment, full_grid):
    places = {"s1": GRID, "a1": GRID}
    placement = bp.place(
        experiment, places, estimator=SMALL, search=design.Forward(), least_distance=0.0
    )
    assert (
        placement.information_gain == full_grid.information_gain
        and placement.positions == full_grid.positions
    )


def test_one_place_has_no_second_best(experiment):
    placement = bp.place(
        experiment, {"s1": [0.25], "a1": [0.25]}, estimator=SMALL, least_distance=0.0
    )
    assert str(placement).endswith("nat.") and np.isnan(placement.lead_se)


def test_it_says_where_and_how_sure(full_grid):
    sentence = str(full_grid)
    assert (
        sentence.startswith("Best of 36 placements: s1 at 0.")
        and "more than the second" in sentence
    )
    # The bar is symmetric: its mirror image is as good.
    assert sentence.endswith("which is not significant.")


SEATS = [(0.1, 0.08, 0.0), (0.2, 0.15, 0.0), (0.2, 0.25, 0.0)]


def on_plate(*positions):
    scene = models_in_space.plate()
    sensors = [bp.Sensor(f"s{number}", at=at) for number, at in enumerate(positions, start=1)]
    return bp.Experiment(
        bp.Structure(scene.modes, damping=bp.damping.Modal(bar.PRIOR)),
        sensors=sensors,
        actuators=[bp.Actuator("a1", at=SEATS[0])],
        frequency=scene.frequency[:3],
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.Gaussian(0.02),
    )


def box(seat, size=0.01):
    return bp.positions.Box(seat, within=(size, size, 0.0))


def test_a_place_in_space_has_three_coordinates():
    placement = bp.place(on_plate(box(SEATS[0])), {"s1": SEATS[:2]}, estimator=SMALL)
    assert [*placement.table.columns][:3] == ["s1.x", "s1.y", "s1.z"]
    assert "s1 at (0." in str(placement)


def test_rules_hold_in_space():
    two = on_plate(box(SEATS[0]), box(SEATS[1]))
    seats = np.array(SEATS)
    rules = PlacementRules([((0.15, 0.1, -1.0), (0.3, 0.2, 1.0))])
    assert rules.allowed(two, {"s1": seats}, ["s2"]).tolist() == [True, False, True]
    # Rules of their own let an actuator be where a sensor is; the last two are 0.1 m apart.
    pairs = {"s1": seats[:2], "s2": seats[1:]}
    assert PlacementRules((), 0.101).allowed(two, pairs).tolist() == [True, False]
    assert PlacementRules((), 0.099).allowed(two, pairs).tolist() == [True, True]
    assert not PlacementRules().checked(two).allowed(two, pairs)[0]


def test_no_two_instruments_share_a_point_unless_that_is_asked_for(experiment):
    places = {"s1": GRID, "a1": GRID}
    apart = bp.place(experiment, places, estimator=SMALL)
    assert len(apart.table) == GRID.size**2 - GRID.size
    assert (np.abs(apart.table["s1"] - apart.table["a1"]) >= 0.01).all()
    mounted = bp.place(
        experiment,
        {"s1": [float(experiment.actuator["a1"].recorded)]},
        estimator=SMALL,
        least_distance=0.0,
    )
    assert len(mounted.table) == 1


@pytest.mark.long
def test_tolerances_on_several_members_are_candidates_as_well():
    scene = models_in_space.frame()
    start, corner = models_in_space.FEET["left foot"], models_in_space.CORNERS["left column"]
    end = models_in_space.CORNERS["beam"]
    seats = [
        bp.positions.Member(low, high, centre=tuple(np.add(low, high) / 2), within=0.03)
        for low, high in ((start, corner), (corner, end))
    ]
    experiment = bp.Experiment(
        bp.Structure(scene.modes, damping=bp.damping.Modal(bar.PRIOR)),
        sensors=[bp.Sensor("s1", at=seats[0], directions=(2,))],
        actuators=[bp.Actuator("a1", at=tuple(scene.place), directions=(2,))],
        frequency=scene.frequency[:3],
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.Gaussian(0.02),
    )
    placements = [
        bp.place(experiment, {"s1": seats}, estimator=SMALL, search=search)
        for search in (design.Exhaustive(), design.Forward())
    ]
    assert len({tuple(placement.positions["s1"]) for placement in placements}) == 1
    np.testing.assert_allclose(
        [placement.information_gain for placement in placements],
        placements[0].information_gain,
        rtol=1e-5,
    )


def test_a_tolerance_in_nodes_is_refused_by_the_estimate():
    nodes = bp.positions.Nodes(models_in_space.plate().matrices.position, box(SEATS[0], 0.05))
    with pytest.raises(
        ValueError, match=r'"sensor.s1.position.node" has the distribution Categorical'
    ):
        bp.place(on_plate(nodes), {"s1": SEATS[:2]}, estimator=SMALL)


def test_a_place_that_does_not_move_is_never_the_answer(experiment):
    """On the clamp the response vanishes, and its logarithm is infinite."""
    exact = bp.Experiment(
        experiment.structure,
        sensors=[bp.Sensor("s1", at=0.3)],
        actuators=list(experiment.actuator.values()),
        frequency=experiment.frequency,
        observe=experiment.observe,
        noise=None,
    )
    placement = bp.place(exact, {"s1": [0.0, 0.25]}, estimator=SMALL)
    assert placement.positions == {"s1": 0.25} and np.isneginf(
        placement.table["information_gain"][1]
    )
    full_grid = bp.information_map(exact, {"s1": [0.0, 0.25]}, estimator=SMALL)
    assert np.isnan(full_grid["information_gain"][0]) and design.lead(full_grid).best == {"s1": 1}
    assert list(design.rivals(full_grid).values) == [False, True]
    for search in (bp.place, bp.information_map):
        with pytest.raises(ValueError, match=r"At none of 1 placements is the information finite"):
            information = search(exact, {"s1": [0.0]}, estimator=SMALL)
            design.lead(information)
