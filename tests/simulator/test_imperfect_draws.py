"""Measurements of imperfect structures: what they promise to hold."""

from dataclasses import replace

import numpy as np
import pytest

from tests.simulator import imperfect_draws, imperfect_scenes
from tests.simulator.fine_elements import NOTHING, Line, effect, plant
from tests.simulator.hidden_structures import accelerance
from tests.simulator.imperfect_scenes import FORMS, NO_FLAWS, Scene, Sizes, drawn
from tests.simulator.nominal_fits import NAMES, NominalFit, flat

pytestmark = [pytest.mark.long, pytest.mark.longest]  # only benchmarks draw structures


@pytest.mark.parametrize("form", ["bar", "beam"])
def test_without_flaws_a_line_is_that_of_the_exact_simulator(form):
    scene = drawn((3, 0), form, NO_FLAWS)
    clean = replace(scene.true, pieces=(), masses=(), damping_factors=())
    exact = accelerance(clean, scene.sensors, scene.actuators, scene.frequency)
    # Between the nodes of a bar, which are other ones, a quadratic errs by (k h)^3 / 125.
    most = {"bar": 1e-4, "beam": 1e-6}[form]
    np.testing.assert_allclose(scene.response(NOTHING), exact, atol=most * abs(exact).max())


def test_without_flaws_a_plate_is_naviers_sum():
    scene = drawn((3, 0), "plate", NO_FLAWS)
    plate, omega = scene.true, 2 * np.pi * scene.frequency[:, None, None]
    m, n = np.meshgrid(np.arange(1, 81), np.arange(1, 81))
    waves = np.pi * np.stack([m / plate.length, n / plate.width])
    natural = (waves**2).sum(axis=0) * np.sqrt(plate.rigidity / plate.density / plate.thickness)
    loss = 2j * plate.damping_ratio * natural * omega
    modal = 4 / plate.mass / (natural**2 - omega**2 + loss)

    def shape(instrument):
        return np.sign(instrument.direction) * np.prod(np.sin(waves.T * instrument.true), axis=-1).T

    exact = np.stack(
        [
            [
                np.sum(-(omega**2) * modal * shape(s) * shape(a), axis=(1, 2))
                for a in scene.actuators
            ]
            for s in scene.sensors
        ]
    )
    # Far modes, which are static, converge with the square of the number of polynomials.
    np.testing.assert_allclose(scene.response(NOTHING), exact, atol=2e-4 * abs(exact).max())


def test_an_uneven_bar_has_the_natural_frequencies_of_its_transfer_matrices():
    scene = drawn((5, 0), "bar", Sizes(mass=0.0))
    bar = scene.true

    def force_at_the_end(omega):
        state = np.array([0.0, 1.0])  # motion and force at the fixed end
        for factor in bar.pieces:
            rigidity = bar.rigidity * factor
            wave = omega * np.sqrt(bar.density * bar.area / rigidity)
            turn = wave * bar.length / len(bar.pieces)
            stiff = rigidity * wave
            state = (
                np.array(
                    [
                        [np.cos(turn), np.sin(turn) / stiff],
                        [-stiff * np.sin(turn), np.cos(turn)],
                    ]
                )
                @ state
            )
        return state[1]

    for natural in plant(bar).natural[:8]:
        below, above = (force_at_the_end(natural * share) for share in (1 - 1e-5, 1 + 1e-5))
        assert below * above < 0


@pytest.mark.parametrize("form", FORMS)
def test_a_forgotten_mass_is_an_attached_mass(form):
    scene = drawn((4, 0), form, NO_FLAWS)
    bare = replace(scene.true, masses=(), damping_ratio=1e-9)
    place, mass = scene.true.masses[0][0], 0.02 * bare.mass
    response = replace(scene, true=replace(bare, masses=((place, mass),))).response(NOTHING)
    put = replace(scene, true=bare).response(effect("point_mass", at=place, mass=mass))
    level = np.sqrt(np.median(abs(response) ** 2))
    apart = abs(response - put) / np.maximum(abs(response), level)
    assert np.quantile(apart, 0.9) < 1e-3  # beside resonances without damping
    assert np.median(apart) < 1e-4


def test_flaws_have_the_sizes_that_were_asked_for():
    scenes = [drawn((seed, 0), "bar") for seed in range(60)]
    asked = {"pieces": 0.04, "damping_factors": 0.3}
    for name, size in asked.items():
        values = np.log([getattr(scene.true, name) for scene in scenes]).ravel()
        assert abs(values.mean()) < 5 * size / np.sqrt(values.size)
        assert abs(values.std() - size) < 5 * size / np.sqrt(2 * values.size)
    gains = np.log([scene.gains[:, 0] for scene in scenes])  # sensor and actuator
    spread = gains - gains.mean(axis=1, keepdims=True)
    size = np.sqrt(np.sum(spread**2) / (len(scenes) * 3))
    assert abs(size - 0.01) < 5 * 0.01 / np.sqrt(2 * 3 * len(scenes))
    assert abs(gains.mean(axis=1).std() - 0.01 * np.sqrt(1.25)) < 5 * 0.01 / np.sqrt(120)
    for scene in scenes:
        assert len(scene.true.masses) == 3
        for place, mass in scene.true.masses:
            assert 0 < place < scene.true.length
            assert mass == pytest.approx(0.003 * scene.true.mass)


@pytest.mark.parametrize("form", FORMS)
def test_all_draws_of_a_form_have_the_same_numbers(form):
    for seed in range(3):
        scene = drawn((seed, 0), form)
        low, high = 2 * np.pi * scene.frequency[[0, -1]]
        natural = imperfect_scenes.elastic(scene.nominal)
        assert np.sum((natural > low) & (natural < high)) == 8
        assert (len(scene.sensors), len(scene.actuators), scene.frequency.size) == (4, 1, 160)
        for instrument in (*scene.sensors, *scene.actuators):
            assert np.all(
                np.abs(np.subtract(instrument.true, instrument.recorded)) <= instrument.within
            )
        for name, (least, most) in scene.priors.items():
            assert least < getattr(scene.true, name) < most
            assert least < getattr(scene.nominal, name) < most


@pytest.mark.parametrize("form", FORMS)
def test_the_nominal_fit_reaches_an_exact_structure(form):
    scene = drawn((6, 0), form, NO_FLAWS)
    fit = NominalFit(scene)
    exact = scene.response(NOTHING)
    instruments = (*scene.sensors, *scene.actuators)
    places = [at for instrument in instruments for at in flat(instrument.true)]
    truth = np.array([getattr(scene.true, name) for name in NAMES] + places)
    np.testing.assert_allclose(fit.predicted(truth), exact, atol=2e-3 * abs(exact).max())
    fit_of_exact = fit.of(exact)
    assert 1 <= fit_of_exact.chi2 < 1.1
    np.testing.assert_allclose(fit_of_exact.values[:3], truth[:3], rtol=0.03)


@pytest.mark.parametrize(
    ("seed", "name", "ratio"),
    [
        (0, "point_mass", 4.0),
        (1, "tuned_absorber", 1.2),
        (3, "compliant_support", 4.0),
        (4, "local_stiffness_loss", 4.0),
        (5, "local_stiffness_loss", 1.2),
    ],
)
def test_an_effect_shows_as_much_as_was_asked(seed, name, ratio):
    draw = imperfect_draws.draw(seed, name, ratio)
    assert draw.hidden.name == name
    assert 1 <= (draw.ratio - 1) / (ratio - 1) < 1.1
    chi2 = [best_chi2(draw, record) for record in (draw.baseline, *draw.records)]
    assert chi2[1] / chi2[0] == pytest.approx(draw.ratio, rel=0.05)
    assert chi2[0] > 20


def test_a_misplaced_sensor_shows_at_least_as_much_as_was_asked():
    draw = imperfect_draws.draw(4, "misplaced_sensor", 4.0)
    assert draw.ratio >= 4
    [sensor] = [candidate for candidate in draw.sensors if candidate.name == draw.hidden["sensor"]]
    assert abs(draw.hidden["position"] - sensor.recorded) >= 3 * sensor.within


def best_chi2(draw, record):
    """Of the nominal structure, with the noise that the coherence tells."""
    scene = Scene(
        draw.form,
        draw.nominal,
        draw.priors,
        draw.true,
        draw.gains,
        draw.sensors,
        draw.actuators,
        record.frequency,
        NOTHING,
    )
    fit = NominalFit(scene)
    missed = np.abs(fit.predicted(fit.of(record.frf).values) - record.frf) ** 2
    return float(np.mean(missed / record.variance()))


@pytest.mark.parametrize("seed", range(3))
def test_before_and_after_share_all_flaws(seed):
    draw = imperfect_draws.draw(seed)
    assert draw.hidden == NOTHING
    assert far(draw.records[0], draw.baseline) < 5 / np.sqrt(draw.baseline.frf.size)
    changed = imperfect_draws.draw(seed, "gain_error")
    others = [
        n for n, sensor in enumerate(changed.sensors) if sensor.name != changed.hidden["sensor"]
    ]
    [after], before = changed.records, changed.baseline
    wrong = int(*{*range(4)} - {*others})
    assert far(after, before, others) < 5 / np.sqrt(before.frf[others].size)
    assert far(after, before, [wrong]) > 10


def far(record, other, sensors=slice(None)):
    """By how much the mean square of a difference exceeds that of independent noise."""
    variance = record.variance() + other.variance()
    return float(abs(np.mean((np.abs(record.frf - other.frf) ** 2 / variance)[sensors]) - 1))


def test_a_draw_is_its_seed():
    first, again, other = (imperfect_draws.draw(seed, "any") for seed in (4, 4, 7))
    assert first.hidden == again.hidden
    assert first.true == again.true
    assert np.array_equal(first.records[0].frf, again.records[0].frf)
    assert np.array_equal(first.baseline.frf, again.baseline.frf)
    assert first.hidden != other.hidden
    assert isinstance(first.true, Line)


def test_forms_take_turns():
    assert [imperfect_draws.draw(seed).form for seed in (6, 7, 8)] == [*FORMS]
