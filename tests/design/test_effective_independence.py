"""Effective independence against determinants, brute force, and zeros of Legendre polynomials."""

import itertools

import jax
import numpy as np
import numpy.testing as npt
import pytest
from numpy.polynomial import legendre

import bayes_placement as bp
from bayes_placement import design
from models import bar
from tests.design import landscapes
from tests.effects import models_in_space

SEVEN = np.array([0.07, 0.2, 0.33, 0.41, 0.58, 0.72, 0.88])


def sines(places, modes):
    return np.sin(np.pi * np.outer(places, modes))


def log_det(rows):
    return np.linalg.slogdet(rows.T @ rows)[1]


def names(count):
    return tuple(f"s{number}" for number in range(1, count + 1))


def chosen(count, places, modes=None, experiment=None):
    declared = experiment or landscapes.experiment(names(count))
    return design.effective_independence(declared, dict.fromkeys(names(count), places), modes=modes)


def at(selection):
    return sorted(map(float, selection.positions.values()))


@pytest.mark.parametrize("count", [2, 3, 4])
def test_sensors_on_a_bar_sit_at_zeros_of_a_legendre_polynomial(count):
    """Products of sines are a weighted Vandermonde determinant in the cosine (Stieltjes)."""
    fine = np.linspace(0.005, 0.995, 199)
    selection = chosen(count, fine, modes=range(1, count + 1))
    zeros = np.sort(np.arccos(legendre.leggauss(count)[0]) / np.pi)
    npt.assert_allclose(at(selection), zeros, atol=0.011)


@pytest.mark.parametrize(
    ("count", "modes"), [(2, (1, 2)), (3, (1, 2, 3)), (4, (1, 2, 3)), (3, (2,))]
)
def test_it_is_near_the_largest_determinant_of_all_choices(count, modes):
    selection = chosen(count, SEVEN, modes=modes)
    rows = sines(SEVEN, modes)
    sets = map(list, itertools.combinations(range(SEVEN.size), count))
    determinants = {tuple(subset): log_det(rows[subset]) for subset in sets}
    subset = tuple(int(np.flatnonzero(place == SEVEN)[0]) for place in at(selection))
    # Removing one by one is greedy: at least 80 % of the largest, the median choice has far less.
    assert determinants[subset] > max(determinants.values()) + np.log(0.8)
    assert determinants[subset] > np.median([*determinants.values()]) + 0.3


def test_what_is_removed_contributes_least_to_the_determinant():
    """Each step beside determinants of all that could be removed."""
    selection = chosen(3, SEVEN, modes=(1, 2, 3))
    remaining = list(SEVEN)
    removed = selection.table[~selection.table["kept"]][::-1]
    for row in removed.itertuples():
        complete = log_det(sines(remaining, (1, 2, 3)))
        without = [
            log_det(sines([x for x in remaining if x != removed_place], (1, 2, 3)))
            for removed_place in remaining
        ]
        assert remaining[int(np.argmax(without))] == row.place
        assert row.effective_independence == pytest.approx(1 - np.exp(max(without) - complete))
        remaining.remove(row.place)
    npt.assert_allclose(at(selection), remaining)


def test_effective_independence_is_the_leverage():
    selection = chosen(5, SEVEN[:5], modes=(1, 2, 3))
    rows = sines(SEVEN[:5], (1, 2, 3))
    leverage = np.sum(np.linalg.qr(rows)[0] ** 2, axis=1)
    table = selection.table.sort_values("place")
    npt.assert_allclose(table["effective_independence"], leverage)
    assert table["effective_independence"].sum() == pytest.approx(3)  # the rank


def test_log_determinants_are_those_of_mass_normalised_shapes():
    selection = chosen(2, SEVEN, modes=(1, 2))
    shapes = sines(at(selection), (1, 2)) * np.sqrt(2 / 9)  # the bar has 9 kg
    assert selection.log_determinant[-1] == pytest.approx(log_det(shapes))
    complete = sines(SEVEN, (1, 2)) * np.sqrt(2 / 9)
    assert selection.log_determinant[0] == pytest.approx(log_det(complete))
    assert len(selection.log_determinant) == 6 and np.all(np.diff(selection.log_determinant) < 0)


def test_modes_are_those_of_the_band_unless_chosen():
    assert chosen(2, SEVEN).modes == (1, 2)  # 167 and 333 Hz of 22 to 411 Hz
    assert chosen(2, SEVEN, modes=(3, 1)).modes == (1, 3)


def test_a_mounted_sensor_counts_but_stays():
    experiment = landscapes.experiment(("m", "s1", "s2"))  # the first at 0.3
    selection = chosen(2, SEVEN, modes=(1, 2, 3), experiment=experiment)
    remaining = list(SEVEN)
    while len(remaining) > 2:
        remaining.remove(
            max(
                remaining,
                key=lambda removed_place: log_det(
                    sines([0.3, *(x for x in remaining if x != removed_place)], (1, 2, 3))
                ),
            )
        )
    assert at(selection) == remaining
    shapes = sines([0.3, *remaining], (1, 2, 3)) * np.sqrt(2 / 9)
    assert selection.log_determinant[-1] == pytest.approx(log_det(shapes))


def test_what_is_learnt_there_is_told_by_the_same_estimator():
    experiment = landscapes.experiment(names(2))
    selection = chosen(2, SEVEN, modes=(1, 2), experiment=experiment)
    estimator = landscapes.Modal(modes=2)
    placed = bp.place(experiment, selection.places, estimator=estimator)
    best = bp.place(experiment, dict.fromkeys(names(2), SEVEN), estimator=estimator)
    assert placed.information_gain == pytest.approx(landscapes.learnt(at(selection), modes=2))
    assert 0.9 * best.information_gain < placed.information_gain <= best.information_gain + 1e-12


def test_it_says_where_and_by_which_modes():
    sentence = str(chosen(2, SEVEN))
    assert sentence.startswith("2 of 7 places by effective independence of modes 1, 2: s1 at 0.")
    assert "log determinant" in sentence


def test_places_in_space_count_with_all_their_directions():
    scene = models_in_space.frame()
    places = [tuple(map(float, seat)) for seat, _ in scene.seats]
    experiment = bp.Experiment(
        bp.Structure(scene.modes, damping=bp.damping.Modal(bar.PRIOR)),
        sensors=[bp.Sensor("s1", at=places[0], directions=(1, 2, 3))],
        actuators=[bp.Actuator("a1", at=tuple(scene.place), directions=(2,))],
        frequency=scene.frequency,
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=None,
    )
    selection = design.effective_independence(experiment, {"s1": places}, modes=(1, 2))
    shapes = jax.jit(lambda at: scene.modes.shapes(at)[:, :2])
    determinants = [log_det(np.asarray(shapes(np.array(place)))) for place in places]
    assert tuple(selection.positions["s1"]) == places[int(np.argmax(determinants))]
    assert [*selection.table.columns[:3]] == ["x", "y", "z"]
    complete = np.concatenate([np.asarray(shapes(np.array(place))) for place in places])
    first = selection.table.iloc[-1]  # the first that was removed
    number = next(i for i, p in enumerate(places) if p == (first.x, first.y, first.z))
    without = log_det(np.delete(complete, slice(3 * number, 3 * number + 3), axis=0))
    assert first.effective_independence == pytest.approx(1 - np.exp(without - log_det(complete)))


def different():
    base = landscapes.experiment(names(2))
    sensors = [base.sensor["s1"], bp.Sensor("s2", at=0.4, angles=(0.0, 0.1, 0.0))]
    return bp.Experiment(
        base.structure,
        sensors=sensors,
        actuators=list(base.actuator.values()),
        frequency=base.frequency,
        observe=base.observe,
        noise=None,
    )


@pytest.mark.parametrize(
    ("places", "modes", "message"),
    [
        ({"a1": SEVEN}, None, r'Places of the actuator "a1" were given; those of sensors are'),
        (
            {"s1": SEVEN, "s2": SEVEN[:4]},
            None,
            r'Sensors "s1" and "s2" have different places to try',
        ),
        ({"s1": SEVEN, "s2": SEVEN}, (1, 2, 3), r"2 channels were given for 3 modes; .*=\(1, 2\)"),
        ({"s1": SEVEN[:1], "s2": SEVEN[:1]}, (1,), r"1 places for 2 sensors were given; at least"),
        ({"s1": [0.5, 0.5], "s2": [0.5, 0.5]}, (1, 2), r"places only 1 of 2 modes are independent"),
        (
            {"s1": SEVEN, "s2": SEVEN},
            (0,),
            r"modes=\(0,\) was given; numbers of modes from 1 to 15",
        ),
        ({"s1": SEVEN, "s2": SEVEN}, (), r"modes=\(\) was given; numbers of modes from 1 to 15"),
    ],
)
def test_what_has_no_answer_is_refused(places, modes, message):
    with pytest.raises(ValueError, match=message):
        design.effective_independence(landscapes.experiment(names(2)), places, modes=modes)


def test_sensors_that_read_other_directions_are_refused():
    with pytest.raises(ValueError, match=r'Sensors "s1" and "s2" have different places to try or'):
        design.effective_independence(different(), {"s1": SEVEN, "s2": SEVEN})


def test_a_band_without_modes_is_refused():
    experiment = bar.placed(0.3, 0.3, None, frequency=np.array([20.0, 60.0]))
    with pytest.raises(ValueError, match=r"No natural frequency lies in the band of 20 to 60 Hz"):
        design.effective_independence(experiment, {"s1": SEVEN})
