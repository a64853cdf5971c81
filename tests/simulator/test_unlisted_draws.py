"""Measurements whose hidden effect may be anything: what they promise to hold."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize

from bayes_placement.io import case
from tests.simulator import case_folders, fine_beams, unlisted_draws, unlisted_scenes
from tests.simulator.fine_beams import BENDING, HEAVY, STIFF, outer, row, spread
from tests.simulator.fine_elements import Line
from tests.simulator.hidden_structures import Instrument
from tests.simulator.law_identity import is_told
from tests.simulator.law_networks import (
    dynamic_stiffness,
    is_grounded,
    leaves,
    networks,
    of_one_stiffness,
    without_one,
)
from tests.simulator.unlisted_draws import MISFIT, draw, nothing
from tests.simulator.unlisted_effects import KINDS, Hidden, response
from tests.simulator.unlisted_scenes import FORMS, Scene

pytestmark = [pytest.mark.long, pytest.mark.longest]  # only benchmarks draw structures

UNDAMPED = 1e-12
AT, TO, START, END = 0.28, 0.49, 0.2, 0.44
PLACES = (0.18, 0.4, 0.57)
"""Two sensors and an actuator on nodes of the other mesh."""


def scene_of(line: Line, places, frequency) -> Scene:
    instruments = [Instrument(f"i{n}", place, 0.01, 3, place) for n, place in enumerate(places)]
    return Scene(
        form="cantilever",
        nominal=line,
        uncertain={"youngs_modulus": (0.9 * line.youngs_modulus, 1.1 * line.youngs_modulus)},
        true=line,
        gains=np.ones((len(places) - 1, 1)),
        sensors=tuple(instruments[:-1]),
        actuators=tuple(instruments[-1:]),
        frequency=np.array(frequency),
        noise=0.01,
    )


@pytest.fixture(scope="module")
def cantilever():
    line = Line(
        kind="beam",
        ends="fixed-free",
        length=fine_beams.LENGTH,
        area=fine_beams.AREA,
        youngs_modulus=fine_beams.STIFFNESS,
        density=fine_beams.DENSITY,
        damping_ratio=UNDAMPED,
        second_moment=fine_beams.MOMENT,
    )
    return scene_of(line, PLACES, [6.3, 40.0, 111.0, 302.0, 801.0, 1100.0])


def slope():
    return row(AT, slope=True)


def maxwell(omega):
    return 1 / (1 / 2e4 + 1 / (40j * omega))


def body(omega, mass=0.2, radius=0.02, offset=0.015):
    beside = row(AT) + offset * slope()
    return -(omega**2) * mass * (outer(beside) + radius**2 * outer(slope()))


ADDED = {
    "spring on a rotation": (
        Hidden("rotation", "k", (300.0,), (1,), (AT,)),
        lambda w: 300.0 * outer(slope()),
    ),
    "spring and dashpot in series": (
        Hidden("displacement", ["-", "c", "k"], (40.0, 2e4), (1, 1), (AT,)),
        lambda w: maxwell(w) * outer(row(AT)),
    ),
    "fractional mount": (
        Hidden("displacement", "p", (500.0, 0.4), (1, 0), (AT,)),
        lambda w: 500.0 * (1j * w) ** 0.4 * outer(row(AT)),
    ),
    "body": (Hidden("body", "body", (0.2, 0.02, 0.015), (1, 0, 0), (AT,)), body),
    "lossy strut": (
        Hidden("relative", "h", (9e3, 0.2), (1, 0), (AT, TO)),
        lambda w: 9e3 * (1 + 0.2j) * outer(row(AT) - row(TO)),
    ),
    "mass over a segment": (
        Hidden("region", "m", (0.3,), (1,), (START, END)),
        lambda w: -(w**2) * 0.3 / (END - START) * spread(HEAVY, START, END),
    ),
    "layer": (
        Hidden("region", "layer", (0.3, 0.2), (1, 0), (START, END)),
        lambda w: 0.3 * (0.2 + 1j) * BENDING * spread(STIFF, START, END),
    ),
}


@pytest.mark.parametrize("hidden, added", ADDED.values(), ids=ADDED)
def test_an_effect_is_that_of_another_mesh(cantilever, hidden, added):
    exact = fine_beams.receptance(PLACES, 2 * np.pi * cantilever.frequency, added)
    check_receptance(cantilever, hidden, exact)


def test_a_lossy_cut_is_that_of_another_mesh(cantilever):
    hidden = Hidden("cut", "h", (80.0, 0.3), (-1, 0), (AT,))
    omega = 2 * np.pi * cantilever.frequency
    exact = fine_beams.cut_open(PLACES, omega, AT, lambda w: 80.0 * (1 + 0.3j), freedom=1)
    check_receptance(cantilever, hidden, exact)


def check_receptance(scene, hidden, exact):
    expected = -((2 * np.pi * scene.frequency) ** 2) * exact[:-1, -1:]
    np.testing.assert_allclose(response(scene, [hidden]), expected, rtol=2e-4)
    assert np.max(np.abs(response(scene, []) / expected - 1)) > 0.05


def test_a_shorter_line_is_a_line_of_that_length(cantilever):
    short = replace(cantilever.true, length=0.97 * cantilever.true.length)
    hidden = Hidden("structure", "length", (-0.03,), (1,))
    expected = response(replace(cantilever, true=short), [])
    np.testing.assert_allclose(response(cantilever, [hidden]), expected)


def test_a_spring_on_a_bar_is_the_sum_of_waves():
    bar = Line("bar", "fixed-fixed", 0.8, 2e-4, 7e10, 2700.0, UNDAMPED)
    places, at, spring = np.array([0.13, 0.5, 0.61]), 0.33, 4e7
    scene = scene_of(bar, places, [900.0, 2500.0, 5200.0, 9100.0])
    omega = 2 * np.pi * scene.frequency
    wave = omega * np.sqrt(bar.density / bar.youngs_modulus)

    def green(x, y):
        """Receptance between two places of a bar that is fixed at both ends."""
        low, high = min(x, y), max(x, y)
        stiff = bar.rigidity * wave * np.sin(wave * bar.length)
        return np.sin(wave * low) * np.sin(wave * (bar.length - high)) / stiff

    def held(x, y):
        return green(x, y) - green(x, at) * spring * green(at, y) / (1 + spring * green(at, at))

    expected = [[-(omega**2) * held(x, places[-1])] for x in places[:-1]]
    hidden = Hidden("displacement", "k", (spring,), (1,), (at,))
    np.testing.assert_allclose(response(scene, [hidden]), expected, rtol=1e-3)


def test_a_channel_is_filtered_alone(cantilever):
    hidden = Hidden("channel", "low_pass", (500.0, 1.0), (-1, 0), (), "i1")
    ratio = response(cantilever, [hidden]) / response(cantilever, [])
    np.testing.assert_allclose(ratio[0], 1)
    np.testing.assert_allclose(ratio[1, 0], 1 / (1 + 1j * cantilever.frequency / 500.0))


def test_a_draw_is_its_seed():
    one, same, other = draw(2), draw(2), draw(4)
    assert one.hidden == same.hidden != other.hidden
    np.testing.assert_array_equal(one.record.frf, same.record.frf)


@pytest.mark.parametrize("kind", KINDS)
def test_a_nominal_model_misses_as_much_as_is_said(kind):
    drawn = draw(17, [kind])
    scene = drawn.scene
    assert [effect.kind for effect in drawn.hidden] == [kind]
    assert MISFIT[0] <= drawn.chi2 <= MISFIT[1]
    exact = response(scene, drawn.hidden)
    fit = scene.best_fit(drawn.record.frf).values
    missed = np.abs(scene.fit.predicted(fit) - drawn.record.frf) / scene.error(exact)
    # The mean square over some thousand data, half of which may lie near few resonances.
    assert np.mean(missed**2) == pytest.approx(drawn.chi2, rel=0.2)


def test_of_five_seeds_one_hides_nothing_and_one_two_effects():
    counts = unlisted_draws.EFFECTS
    assert sorted(counts) == [0, 1, 1, 1, 2]
    assert not draw(counts.index(0)).hidden


def test_noise_is_as_large_as_its_coherence_says():
    drawn = nothing(3, imperfect=False)
    square = np.abs(drawn.record.frf - response(drawn.scene, [])) ** 2 / drawn.record.variance()
    assert np.mean(square) == pytest.approx(1.0, abs=5 / np.sqrt(square.size))


def test_an_imperfect_structure_is_that_of_its_flaws():
    drawn = nothing(3, imperfect=True)
    assert drawn.scene.true.pieces and not np.all(drawn.scene.gains == 1)
    assert drawn.chi2 > 2 and not drawn.hidden


def test_a_law_whose_element_is_of_no_consequence_is_not_told(cantilever):
    hidden = Hidden("displacement", ["|", "c", "k"], (8.0, 2e4), (1, 1), (AT,))
    assert is_told(cantilever, hidden)
    assert not is_told(cantilever, replace(hidden, values=(1e-4, 2e4)))


def test_taking_out_an_element_keeps_the_numbers_of_the_others():
    left = without_one(["|", ["-", "c", "k"], "h"], [1.0, 2.0, 3.0, 0.4])
    assert left == [
        (["|", "k", "h"], [2.0, 3.0, 0.4]),
        (["|", "c", "h"], [1.0, 3.0, 0.4]),
        (["-", "c", "k"], [1.0, 2.0]),
    ]


EACH = 3
"""Of so many networks one is tried, and all by `-m longest`."""
GROUNDED = [tree for tree in networks(3) if is_grounded(tree)]
OMEGA = np.geomspace(0.03, 30.0, 40) * np.exp(-1j * np.pi / 6)  # no law has a pole there


def test_there_are_27_networks_of_at_most_three_elements_on_the_ground():
    assert len(networks(1)) + len(networks(2)) + len(GROUNDED) == 27


@pytest.mark.parametrize(
    "tree",
    [
        pytest.param(tree, marks=[pytest.mark.longest] if number % EACH else [])
        for number, tree in enumerate(GROUNDED)
    ],
    ids=json.dumps,
)
def test_expected_laws_are_those_that_can_have_the_same_dynamic_stiffness(tree):
    target = dynamic_stiffness(tree, [0.7, 1.3, 0.9], OMEGA)
    same = [other for other in networks(3) if reaches(other, target)]
    assert sorted(map(json.dumps, same)) == sorted(map(json.dumps, of_one_stiffness(tree)))


def reaches(tree, target) -> bool:
    def missed(logs):
        ratio = np.log(dynamic_stiffness(tree, np.exp(logs), OMEGA) / target)
        return np.concatenate([ratio.real, ratio.imag])

    starts = np.random.default_rng(0).normal(0.0, 1.0, (12, len(leaves(tree))))
    fits = (scipy.optimize.least_squares(missed, start, max_nfev=100) for start in starts)
    return any(fit.cost < 1e-12 for fit in fits)


def test_expected_says_names_of_a_library_and_places():
    hidden = Hidden("relative", "k", (9e3,), (1,), (AT, TO))
    assert case_folders.entry(hidden) == {
        "acts_on": ["relative"],
        "place_m": [[AT], [TO]],
        "laws": ["k"],
        "names": ["strut"],
    }


@pytest.mark.parametrize("form", FORMS)
def test_a_case_folder_is_read_as_it_was_drawn(tmp_path, form):
    scene = unlisted_scenes.drawn((1, 0), form)
    drawn = unlisted_draws.measured(scene, (), 1.0, np.random.default_rng(0))
    case_folders.write(drawn, "a", tmp_path / "cases", tmp_path / "truth")
    study = case.read(tmp_path / "cases" / "a")
    np.testing.assert_allclose(study.measurement.frf, drawn.record.frf, rtol=1e-9)
    np.testing.assert_allclose(study.measurement.frequency, scene.frequency)
    assert study.experiment.sensor_channels[0][0] == "s1"
    truth = json.loads((tmp_path / "truth" / "a.json").read_text())
    assert truth["expected"] == [] and truth["size_m"] == scene.nominal.length
