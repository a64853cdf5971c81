"""Searches over all combinations, by moves and by additions; sensors that are worth their cost."""

import itertools

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement import design
from bayes_placement.experiment.variants import with_only
from tests.design import landscapes
from tests.design.landscapes import Modal, learnt

GRID = np.array([0.08, 0.2, 0.31, 0.45, 0.5, 0.64, 0.77, 0.9])
TWO, THREE = ("s1", "s2"), ("s1", "s2", "s3")


def placed(names, places=GRID, *, estimator=None, sensors=THREE, **settings):
    experiment = landscapes.experiment(sensors)
    tried = {name: places for name in names}
    settings = {"least_distance": 0.0} | settings
    return bp.place(experiment, tried, estimator=estimator or Modal(), **settings)


def at(placement):
    return [float(place) for _, place in sorted(placement.positions.items())]


def greedy(count, places=GRID, begun=()):
    """Forward placement by a plain loop."""
    chosen = list(begun)
    for _ in range(count):
        chosen.append(max(places, key=lambda place: learnt([*chosen, place])))
    return chosen[len(begun) :]


def test_sensors_alike_are_not_tried_twice():
    placement = placed(THREE)
    sets = list(itertools.combinations_with_replacement(GRID, 3))
    assert placement.evaluations == len(placement.table) == len(sets) == 120
    best = max(sets, key=learnt)
    assert sorted(at(placement)) == pytest.approx(best)
    assert placement.information_gain == pytest.approx(learnt(best))


@pytest.mark.parametrize(
    "changes",
    [
        {"at": bp.positions.Segment(0.4, within=0.02)},
        {"at": bp.positions.Segment(0.4, within=0.04), "angles": (0.0, 0.0, 0.1)},
    ],
)
def test_sensors_that_differ_are(changes):
    base = landscapes.experiment(TWO)
    experiment = bp.Experiment(
        base.structure,
        sensors=[base.sensor["s1"], bp.Sensor("s2", **changes)],
        actuators=list(base.actuator.values()),
        frequency=base.frequency,
        observe=base.observe,
        noise=None,
    )
    places = {"s1": GRID[:3], "s2": GRID[:3]}
    assert bp.place(experiment, places, estimator=Modal(), least_distance=0.0).evaluations == 9


@pytest.mark.parametrize("difference", ["places", "noise", "cost", "effect"])
def test_neither_are_those_with_other_places_noise_costs_or_effects(difference):
    levels = bp.noise.Gaussian(np.array([0.01, 0.02]).reshape(2, 1, 1))
    noise = levels if difference == "noise" else None
    experiment = landscapes.experiment(TWO, noise=noise)
    if difference == "effect":
        experiment = experiment + bp.effects.gain_error("s1", 0.1)
    places = {"s1": GRID[:3], "s2": GRID[1:4] if difference == "places" else GRID[:3]}
    cost = {"s1": 0.0} if difference == "cost" else {}
    if difference == "cost":
        assert (
            bp.place(
                experiment, places, estimator=Modal(), cost=cost, least_distance=0.0
            ).evaluations
            == 12
        )
    else:
        assert bp.place(experiment, places, estimator=Modal(), least_distance=0.0).evaluations == 9


def test_forward_placement_is_that_of_a_plain_loop():
    placement = placed(THREE, search=design.Forward())
    assert at(placement) == pytest.approx(greedy(3))
    assert placement.evaluations == 3 * GRID.size
    assert placement.search == "Forward"
    # Greedy is near the best for such information (Nemhauser, Wolsey and Fisher 1978).
    assert (
        (1 - 1 / np.e) * placed(THREE).information_gain
        < placement.information_gain
        <= placed(THREE).information_gain
    )
    assert list(placement.table["s3"]) != list(placement.table["s1"])
    assert placement.table[["s1", "s2", "s3"]].notna().all(axis=None)


def test_forward_placement_goes_on_from_what_is_mounted():
    placement = placed(("s2", "s3"), search=design.Forward())
    assert at(placement) == pytest.approx(greedy(2, begun=[0.3]))
    assert set(placement.positions) == {"s2", "s3"}


def test_the_first_sensor_and_the_first_actuator_are_placed_together():
    placement = placed(("s1", "a1"), GRID[1:6], search=design.Forward(), sensors=("s1",))
    assert placement.evaluations == 25
    pairs = itertools.product(GRID[1:6], repeat=2)
    best = max(pairs, key=lambda pair: learnt(pair[:1], force=np.sin(np.pi * pair[1])))
    assert (placement.positions["s1"], placement.positions["a1"]) == pytest.approx(best)


def test_forward_placement_keeps_to_the_rules():
    free = placed(THREE, search=design.Forward(), sensors=THREE)
    ruled = placed(
        THREE, search=design.Forward(), least_distance=0.25, forbidden=[(0.0, 0.1), (0.49, 0.51)]
    )
    assert not set(at(ruled)) & {0.08, 0.5}
    assert np.diff(sorted(at(ruled))).min() >= 0.25
    assert ruled.information_gain < free.information_gain


def test_moving_one_at_a_time_ends_where_no_single_move_helps():
    placement = placed(THREE, search=design.Sequential())
    best = at(placement)
    assert placement.information_gain == pytest.approx(learnt(best))
    for number, place in itertools.product(range(3), GRID):
        moved = [*best[:number], place, *best[number + 1 :]]
        assert learnt(moved) <= placement.information_gain + 1e-9


def test_moving_is_compiled_once_and_needs_few_trials():
    landscapes.TRACED.clear()
    placement = placed(THREE, search=design.Sequential(), estimator=Modal(strength=11.0))
    assert len(landscapes.TRACED) == 1
    rounds, remainder = divmod(placement.evaluations, 3 * GRID.size)
    assert remainder == 0 and rounds <= 5


def test_what_was_not_offered_is_no_answer():
    """The places that the experiment states are where moving begins, not places to try."""
    placement = placed(TWO, np.array([0.05, 0.1]), search=design.Sequential())
    assert set(np.ravel(placement.table[["s1", "s2"]])) <= {0.05, 0.1}


def test_moving_keeps_to_the_rules_even_where_it_begins_against_them():
    forbidden = [(0.25, 0.55)]  # there all three are stated to be
    placement = placed(THREE, search=design.Sequential(), forbidden=forbidden, least_distance=0.12)
    places = placement.table[[*THREE]]
    assert not ((places > 0.25) & (places < 0.55)).any(axis=None)
    assert np.diff(sorted(at(placement))).min() >= 0.12


def net(chosen, price):
    return learnt(chosen) - price * len(chosen)


@pytest.mark.parametrize("price", [0.05, 0.3, 0.8])
def test_a_sensor_is_placed_only_while_it_teaches_more_than_it_costs(price):
    cost = dict.fromkeys(THREE, price)
    sets = [
        chosen
        for count in (1, 2, 3)
        for chosen in itertools.combinations_with_replacement(GRID, count)
    ]
    best = max(sets, key=lambda chosen: net(chosen, price))
    placement = placed(THREE, cost=cost)
    assert placement.evaluations == len(sets)
    assert sorted(at(placement)) == pytest.approx(best)
    assert placement.net_gain == pytest.approx(net(best, price))
    assert len(placement.omitted) == 3 - len(best)
    assert placement.cost == pytest.approx(price * len(best))
    np.testing.assert_allclose(
        placement.table["net_gain"], placement.table["information_gain"] - placement.table["cost"]
    )
    assert placement.table["net_gain"].is_monotonic_decreasing
    for search in (design.Forward(), design.Sequential()):
        greedy_placement = placed(THREE, cost=cost, search=search)
        assert len(greedy_placement.omitted) == len(placement.omitted)
        assert placement.net_gain - 0.1 < greedy_placement.net_gain <= placement.net_gain + 1e-9


def test_costs_of_their_own_choose_the_cheaper_sensor():
    placement = placed(TWO, cost={"s1": 3.0, "s2": 2.9}, sensors=TWO)
    assert placement.omitted == ("s1",)
    assert str(placement).endswith("s1 is left out: its information gain is less than its cost.")


def test_none_may_be_worth_its_cost_beside_those_mounted():
    for search in (design.Exhaustive(), design.Forward(), design.Sequential()):
        placement = placed(("s2", "s3"), cost={"s2": 5.0, "s3": 5.0}, search=search)
        assert placement.positions == {} and placement.omitted == ("s2", "s3")
        assert placement.information_gain == pytest.approx(learnt([0.3])) and placement.cost == 0
        assert "nothing placed" in str(placement)
        assert str(placement).endswith(
            "s2 and s3 are left out: their information gain is less than their cost."
        )
        if search == design.Forward():
            assert placement.evaluations == 1 + GRID.size  # as it is, and one more; then it stops


def test_what_has_no_cost_is_always_placed():
    for search in (design.Exhaustive(), design.Forward()):
        placement = placed(TWO, cost={"s2": 5.0}, sensors=TWO, search=search)
        assert set(placement.positions) == {"s1"} and placement.omitted == ("s2",)
        assert "s1" in placement.table and placement.table["s1"].notna().all()
    assert placement.evaluations == 2 * GRID.size  # what must be there comes first


def test_too_many_sensors_for_the_rules_are_no_obstacle_to_fewer():
    placement = placed(THREE, GRID[:3], cost=dict.fromkeys(THREE, 0.01), least_distance=0.2)
    assert len(placement.positions) == 2


@pytest.mark.parametrize(
    "search", [design.Exhaustive(), design.Sequential(), design.Forward(), design.Evolutionary()]
)
def test_rules_that_leave_nothing_are_refused(search):
    with pytest.raises(ValueError, match=r"None of the placements is allowed: forbidden regions"):
        placed(("s1",), search=search, forbidden=[(0.0, 1.0)])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"cost": {"s9": 0.1}}, r'A cost of 0.1 nat of "s9" was given; .* \(s1\) is needed'),
        ({"cost": {"s1": -1.0}}, r'A cost of -1 nat of "s1" was given; a cost that is not neg'),
        ({"least_distance": -1.0}, r"least_distance=-1 was given; a distance"),
        (
            {"forbidden": [((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))]},
            r"forbidden region .* of 1 coordinates",
        ),
        ({"forbidden": [(0.5, 0.4)]}, r"forbidden region 0.5 to 0.4 m was given; its least"),
    ],
)
def test_rules_and_costs_that_do_not_fit_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        placed(("s1",), **settings)


@pytest.mark.parametrize("search", [design.Exhaustive(), design.Sequential(), design.Forward()])
def test_a_region_is_refused_where_places_are_needed(search):
    with pytest.raises(ValueError, match=r"given Segment\(.*\), a region; a list of pl"):
        placed(("s1",), bp.positions.Segment(0.5, within=0.2), search=search)


def test_an_experiment_with_fewer_sensors_has_the_noise_of_their_channels():
    sigma = np.arange(1.0, 7.0).reshape(3, 2, 1)
    full = landscapes.experiment(THREE, ("a1", "a2"), noise=bp.noise.Gaussian(sigma))
    fewer = with_only(full, sensors=["s1", "s3"], actuators=["a2"])
    assert [*fewer.sensor] == ["s1", "s3"] and [*fewer.actuator] == ["a2"]
    np.testing.assert_array_equal(np.ravel(fewer.noise.sigma), [2.0, 6.0])
    assert with_only(full, sensors=THREE, actuators=["a1", "a2"]) is full


def test_a_sensor_with_an_effect_of_its_own_cannot_be_left_out():
    experiment = landscapes.experiment(TWO) + bp.effects.gain_error("s1", 0.1)
    with pytest.raises(ValueError, match=r'effect "gain_error" is about one sensor, by its number'):
        bp.place(experiment, {"s2": GRID}, estimator=Modal(), cost={"s2": 0.1})
