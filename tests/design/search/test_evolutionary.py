"""The evolutionary search finds the highest of several hills, by the rules and by its seed."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import numpy.testing as npt
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import design, information
from bayes_placement.design.running import evaluation
from bayes_placement.design.search import evolutionary
from models import bar
from tests.design import landscapes
from tests.design.landscapes import Hills, Modal, Nearness, learnt
from tests.effects import models_in_space

ANYWHERE = bp.positions.Segment(0.5, within=0.46)
SMALL = information.KernelGain(draws=128, placement_draws=64)
FURTHER = [pytest.mark.long, pytest.mark.longest]


SHORT = design.Evolutionary(scattered=2, generations=3)


def placed(places, estimator, *, key=0, search=None, **settings):
    names = [name for name in places if name.startswith("s")]
    return bp.place(
        landscapes.experiment(names),
        places,
        estimator=estimator,
        search=search or design.Evolutionary(),
        key=key,
        least_distance=settings.pop("least_distance", 0.0),
        **settings,
    )


def two_places(**settings):
    return placed({"s1": ANYWHERE, "a1": ANYWHERE}, Hills(), **settings)


@pytest.fixture(scope="module")
def placement():
    return two_places()


def on_the_narrow_hill(placement):
    npt.assert_allclose(
        [placement.positions["s1"], placement.positions["a1"]], (0.8, 0.15), atol=0.01
    )
    assert placement.information_gain == placement.table["information_gain"].max()
    # The second best is the top of the other hill, not the next place on the same one.
    assert placement.information_gain - placement.lead == pytest.approx(0.8, abs=2e-4)
    return True


def test_the_narrow_high_hill_is_found_beside_the_broad_low_one(placement):
    assert on_the_narrow_hill(placement)


@pytest.mark.long
@pytest.mark.parametrize("key", [1, pytest.param(2, marks=pytest.mark.longest)])
def test_it_is_found_with_any_seed(key):
    assert on_the_narrow_hill(two_places(key=key))


@pytest.mark.long
def test_it_is_the_best_of_a_fine_grid_by_fewer_trials(placement):
    fine = np.linspace(0.04, 0.96, 47)
    grid = placed({"s1": fine, "a1": fine}, Hills(), search=design.Exhaustive())
    assert placement.information_gain > grid.information_gain - 1e-3
    assert placement.evaluations < grid.evaluations / 2


@pytest.mark.parametrize(
    ("ratios", "best"),
    [
        pytest.param((bar.PRIOR, 0.04), {0.5}, marks=FURTHER),
        pytest.param((bar.PRIOR, bar.PRIOR), {0.25, 0.75}, marks=pytest.mark.long),
    ],
    ids=["the first ratio", "both"],
)
def test_the_bar_of_the_paper(ratios, best):
    """Both ratios have a local maximum at (0.5, 0.5), where the first alone has its best place."""
    experiment = bar.placed(0.5, 0.5, None, structure=bar.bar(*ratios))
    places = {"s1": ANYWHERE, "a1": ANYWHERE}
    placement = bp.place(
        experiment,
        places,
        estimator=SMALL,
        search=design.Evolutionary(populations=2),
        least_distance=0.0,
    )
    for place in placement.positions.values():
        assert min(abs(float(place) - peak) for peak in best) < 0.02
    assert placement.evaluations < 1000


@pytest.mark.long
def test_three_sensors_are_placed_as_well_as_on_a_fine_grid():
    """The determinant is greatest at the zeros of a Legendre polynomial in the cosine."""
    names = ("s1", "s2", "s3")
    search = design.Evolutionary(populations=2)
    placement = placed(dict.fromkeys(names, ANYWHERE), Modal(strength=1e4), search=search)
    zeros = np.sort(np.arccos(np.polynomial.legendre.leggauss(3)[0]) / np.pi)
    sensors = [float(placement.positions[name]) for name in names]
    npt.assert_allclose(sensors, zeros, atol=0.01)  # equal sensors are sorted
    assert placement.information_gain > learnt(zeros, strength=1e4) - 0.01


def test_the_same_seed_finds_the_same_and_another_one_does_not():
    first, repeated, different = (two_places(key=key, search=SHORT) for key in (1, 1, 2))
    assert first.table.equals(repeated.table)
    assert not first.table.equals(different.table)


def test_random_numbers_of_the_user_are_left_alone():
    np.random.seed(3)
    before = np.random.get_state()[1].copy()
    two_places(search=SHORT)
    npt.assert_array_equal(before, np.random.get_state()[1])


def test_all_generations_are_compiled_once():
    landscapes.TRACED.clear()
    placement = placed({"s1": ANYWHERE, "s2": ANYWHERE}, Modal(strength=12.0), search=SHORT)
    assert len(landscapes.TRACED) == 1 and placement.evaluations == 5 * 32


def test_what_is_kept_is_not_computed_again_and_threads_find_the_same(tmp_path, monkeypatch):
    first = two_places(store=tmp_path, search=SHORT)
    with ThreadPoolExecutor(2) as threads:
        threaded = two_places(executor=threads, search=SHORT)
    assert threaded.table.equals(first.table)
    monkeypatch.setattr(evaluation, "compute", None)
    assert two_places(store=tmp_path, search=SHORT).table.equals(first.table)


def test_nothing_that_is_forbidden_is_ever_tried():
    forbidden = [(0.7, 1.0), (0.0, 0.1)]
    placement = two_places(forbidden=forbidden, search=design.Evolutionary(populations=2))
    for name in ("s1", "a1"):
        assert placement.table[name].between(0.1, 0.7).all()
    assert placement.positions["s1"] > 0.3  # on the other hill


@pytest.mark.long
def test_a_best_place_at_an_edge_of_what_is_allowed_is_found():
    placement = two_places(forbidden=[(0.78, 0.9)], search=design.Evolutionary(populations=2))
    assert (
        placement.positions["s1"] == pytest.approx(0.78, abs=0.01)
        and placement.positions["s1"] < 0.78
    )


def test_sensors_keep_their_distance_and_that_to_those_mounted():
    experiment = landscapes.experiment(("s1", "s2", "s3"))  # the third at 0.5
    places = {"s1": ANYWHERE, "s2": ANYWHERE}
    placement = bp.place(experiment, places, estimator=Modal(), search=SHORT, least_distance=0.3)
    positions = placement.table[["s1", "s2"]].assign(s3=0.5).to_numpy()
    assert np.diff(np.sort(positions, axis=1), axis=1).min() >= 0.3


def test_where_rules_leave_little_it_is_found_all_the_same():
    placement = two_places(forbidden=[(0.0, 0.6), (0.62, 1.0)], search=SHORT)
    assert placement.table["a1"].between(0.6, 0.62).all()


def test_only_sensors_worth_their_cost_are_placed():
    cost = {"s1": 1.2, "s2": 1.2}
    search = design.Evolutionary(populations=1)
    placement = placed({"s1": ANYWHERE, "s2": ANYWHERE}, Modal(modes=1), cost=cost, search=search)
    assert placement.omitted == ("s2",)
    assert placement.positions["s1"] == pytest.approx(0.5, abs=0.01)
    assert placement.net_gain == pytest.approx(learnt([0.5], modes=1) - 1.2, abs=1e-3)


def test_numbers_on_a_line_are_a_region_from_the_least_to_the_greatest():
    placement = placed({"s1": [0.6, 0.7, 0.9]}, Modal(modes=1), search=SHORT)
    assert placement.table["s1"].between(0.6, 0.9).all()
    assert placement.positions["s1"] == pytest.approx(0.6, abs=0.01)


def test_a_region_is_clipped_to_the_structure():
    region = bp.positions.Segment(0.9, within=0.3)
    placement = placed({"s1": region}, Modal(modes=2), search=SHORT)
    assert placement.table["s1"].between(0.6, 1.0).all()


def test_progress_runs_from_nothing_to_all():
    shares = []
    two_places(progress=shares.append, search=SHORT)
    assert shares[0] == 0 and shares[-1] == 1 and np.all(np.diff(shares) >= 0)


def in_space(tolerance):
    scene = models_in_space.plate()
    return bp.Experiment(
        bp.Structure(scene.modes, damping=bp.damping.Modal(dist.Uniform(0.005, 0.03))),
        sensors=[bp.Sensor("s1", at=tolerance)],
        actuators=[bp.Actuator("a1", at=(0.3, 0.1, 0.0))],
        frequency=scene.frequency[:3],
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.Gaussian(0.02),
    )


BOX = bp.positions.Box((0.1, 0.08, 0.0), within=(0.01, 0.01, 0.0))
BALL = bp.positions.Ball((0.1, 0.08, 0.0), 0.01)


@pytest.mark.parametrize(
    ("region", "target"),
    [
        (bp.positions.Box((0.2, 0.15, 0.0), within=(0.15, 0.1, 0.0)), (0.12, 0.21, 0.0)),
        (
            bp.positions.Patch((0.2, 0.15, 0.0), (0, 1, 0), (1, 0, 0), within=(0.1, 0.15)),
            (0.12, 0.21, 0.0),
        ),
        (bp.positions.Member((0.05, 0.05, 0.0), (0.35, 0.25, 0.0)), (0.23, 0.17, 0.0)),
    ],
)
def test_regions_in_space(region, target):
    search = design.Evolutionary(populations=1)
    placement = bp.place(in_space(BOX), {"s1": region}, estimator=Nearness(target), search=search)
    npt.assert_allclose(placement.positions["s1"], target, atol=0.004)


@pytest.mark.long
def test_places_on_a_plate_are_evaluated_as_such():
    region = bp.positions.Box((0.2, 0.15, 0.0), within=(0.1, 0.1, 0.0))
    search = design.Evolutionary(populations=1, scattered=1, generations=1)
    placement = bp.place(in_space(BOX), {"s1": region}, estimator=SMALL, search=search)
    best = tuple(map(float, placement.positions["s1"]))
    repeated = bp.place(in_space(BOX), {"s1": [best]}, estimator=SMALL)
    assert placement.evaluations == 16 and repeated.information_gain == pytest.approx(
        placement.information_gain, rel=1e-5
    )


@pytest.mark.parametrize(
    ("tolerance", "region", "message"),
    [
        (BOX, [(0.1, 0.1, 0.0), (0.2, 0.1, 0.0)], r'Sensor "s1" was given a list of places; des'),
        (BOX, BALL, r'Sensor "s1" was to be moved through Ball; a region with straight sides'),
        (
            BALL,
            bp.positions.Box((0.2, 0.15, 0.0), within=(0.1, 0.1, 0.0)),
            r"distribution of another form",
        ),
    ],
)
def test_what_one_cannot_move_through_is_refused(tolerance, region, message):
    with pytest.raises(ValueError, match=message):
        bp.place(in_space(tolerance), {"s1": region}, estimator=SMALL, search=design.Evolutionary())


@pytest.mark.parametrize("places", [[0.3], []])
def test_one_place_is_no_region(places):
    with pytest.raises(ValueError, match=r'Sensor "s1" was given a list of places; design.Evol'):
        placed({"s1": places}, Modal())


@pytest.mark.parametrize("settings", [{"populations": 0}, {"size": 2}, {"accuracy": 0.0}])
def test_settings_without_sense_are_refused(settings):
    with pytest.raises(
        ValueError, match=r"at least one population of four, one generation of each"
    ):
        design.Evolutionary(**settings)


def test_a_gain_that_is_not_finite_is_worse_than_any_other():
    losses = evolutionary._losses(np.array([2.0, -np.inf, -1.0]))
    np.testing.assert_array_equal(losses, [-2.0, 2.0, 1.0])
    assert np.isfinite(evolutionary._losses(np.array([-np.inf, -np.inf]))).all()
