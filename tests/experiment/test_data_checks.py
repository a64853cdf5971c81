"""Checks of the data: each detects its flaw and is silent without it."""

import dataclasses
import json
from itertools import product
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.experiment.data_checks import CHECKS
from tests.experiment.measured_bars import (
    FREE_LINES,
    LINES,
    bar,
    changed,
    exchanged,
    free_beam,
    kinds,
    measured,
)
from tests.in_space import Linear

DATA = Path(__file__).parents[3] / "shared" / "data"
FURTHER = [pytest.mark.long, pytest.mark.longest]


@pytest.mark.parametrize(
    ("quantity", "coherence"),
    [("receptance", True), ("mobility", False)]
    + [
        pytest.param(*case, marks=FURTHER)
        for case in [
            ("receptance", False),
            ("mobility", True),
            *product(["accelerance"], [True, False]),
        ]
    ],
)
def test_good_data_pass_all_checks(quantity, coherence):
    for experiment in (exchanged(), free_beam()):
        for seed in range(5):
            data = measured(experiment, seed=seed, quantity=quantity)
            if not coherence:
                data = dataclasses.replace(data, coherence=None, averages=None)
            checks = experiment.check_data(data)
            assert checks.passed, checks
            found = f"No fault was found in the data (checked: {', '.join(checks.faults)})."
            assert checks.words() == [found]


def test_the_two_simulated_experiments_allow_every_check():
    faults = exchanged().check_data(measured(exchanged())).faults
    faults |= free_beam().check_data(measured(free_beam())).faults
    told_where_they_fail = {"names"}
    assert set(faults) | told_where_they_fail == {check.name for check in CHECKS}


@pytest.mark.parametrize(("name", "is_told"), [("S1", True), ("s2", False)])
def test_names_that_differ_in_case_alone_are_told(name, is_told):
    sensors = [bp.Sensor("s1", at=0.23), bp.Sensor(name, at=0.61)]
    experiment = bar(sensors, [bp.Actuator("a1", at=0.23)])
    faults = experiment.check_data(measured(experiment)).faults
    assert ("names" in faults) == is_told
    if is_told:
        (fault,) = faults["names"]
        assert fault.sensor == "S1+x" and "'s1' differs from 'S1' in case" in fault.sentence


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_reversed_polarity_shows_at_the_driving_point(quantity):
    data = changed(measured(exchanged(), quantity=quantity), -1.0)
    checks = exchanged().check_data(data)
    assert kinds(checks) == ["driving points"]
    (sentence,) = checks.words()
    assert sentence.startswith("The driving point s1+x / a1+x has the wrong sign at 6")
    assert "its polarity reversed: turn its direction round (or, if all driving" in sentence
    part = "real part must not be negative" if quantity == "mobility" else "imaginary part must"
    assert part in sentence


@pytest.mark.parametrize("first", range(0, 25, 3))
def test_lines_too_far_apart_tell_nothing_of_the_sign_of_time(first):
    """Between lines that are far apart the phase of the model itself turns either way."""
    coarse = eqx.tree_at(lambda tree: tree.frequency, exchanged(), LINES[first::25])
    assert coarse.check_data(measured(coarse)).passed


@pytest.mark.parametrize("form", [np.abs, np.real])
def test_numbers_without_a_phase_are_told(form):
    data = measured(exchanged())
    checks = exchanged().check_data(dataclasses.replace(data, frf=form(data.frf).astype(complex)))
    assert kinds(checks)[0] == "phase"
    assert "All FRFs (first s1+x / a1+x) have no imaginary part at any line" in str(checks)


@pytest.mark.parametrize("modulus", [1e-9, 1e9])
def test_a_model_without_a_natural_frequency_among_the_lines_is_told(modulus):
    faults = free_beam(modulus).check_data(measured(free_beam())).faults["natural frequencies"]
    assert len(faults) == 1
    assert faults[0].sentence.startswith("The FRFs have resonances between 4 and 300 Hz, but no")


def test_frequencies_in_khz_are_told_and_not_a_wrong_model():
    data = measured(free_beam())
    in_khz = dataclasses.replace(data, frequency=data.frequency / 1000)
    setup = eqx.tree_at(lambda tree: tree.frequency, free_beam(), in_khz.frequency)
    (fault,) = setup.check_data(in_khz).faults["natural frequencies"]
    assert "frequencies in kHz" in fault.sentence and "GPa" not in fault.sentence


def test_a_softer_model_than_any_is_told_from_a_stiffer_one():
    """No effect raises all natural frequencies from below the lines: commands stop there."""
    values = [
        free_beam(modulus).check_data(measured(free_beam())).faults["natural frequencies"][0].value
        for modulus in (1e-9, 1e9)
    ]
    assert values[0] > 1 > values[1]


@pytest.mark.parametrize(("factor", "words"), [(1 / 9.80665, "unit g in"), (1e3, "millimetres")])
def test_all_frfs_in_another_unit_are_told(factor, words):
    data = measured(exchanged(), quantity="accelerance")
    assert exchanged().check_data(data).faults["units"] == []
    (fault,) = (
        exchanged().check_data(dataclasses.replace(data, frf=factor * data.frf)).faults["units"]
    )
    assert words in fault.sentence and "divide them by this factor" in fault.sentence


def test_natural_frequencies_without_the_effects_of_a_model_tell_nothing():
    """A body on soft mounts, measured below its first elastic mode, resonates on its mounts."""
    stiff = free_beam(1e6)
    mounted = stiff + bp.effects.ground_spring(0.1, 1e6, name="left")
    mounted = mounted + bp.effects.ground_spring(0.7, 1e6, name="right")
    mounted = mounted + bp.effects.tuned_absorber(0.5, 0.5, 60.0, 0.01)
    data = measured(mounted)
    assert stiff.check_data(data).faults["natural frequencies"]
    assert "natural frequencies" not in mounted.check_data(data).faults


def test_opposite_directions_at_a_driving_point_are_told():
    checks = exchanged().check_data(changed(measured(exchanged()), -1.0, 1, 1))
    assert "with the opposite directions of the two, minus its imaginary part" in str(checks)


def test_a_lag_shows_at_the_driving_point():
    lag = np.exp(-2j * np.pi * LINES * 2e-4)
    checks = exchanged().check_data(changed(measured(exchanged()), lag))
    assert "driving points" in kinds(checks)
    assert "one of them lags" in checks.words()[0]


def test_the_wrong_lines_of_a_driving_point_are_counted():
    data = measured(exchanged())
    apart = np.abs(LINES - 1e9**0.5 / 9000**0.5 / 2)  # from the first natural frequency [Hz]
    narrow, wide = (np.where(apart < width, -1.0, 1.0) for width in (5.0, 15.0))
    assert 2 <= np.sum(narrow < 0) <= 5
    assert exchanged().check_data(changed(data, narrow)).passed
    (fault,) = exchanged().check_data(changed(data, wide)).faults["driving points"]
    assert fault.value == pytest.approx(np.mean(wide < 0))
    assert fault.threshold == pytest.approx(0.02)
    assert (fault.sensor, fault.actuator) == ("s1+x", "a1+x")


def test_a_driving_point_that_may_sit_apart_excuses_what_its_tolerance_explains():
    def experiment(within):
        at = bp.positions.Segment(0.23, within=within)
        return bar([bp.Sensor("s1", at=at)], [bp.Actuator("a1", at=0.23)])

    apart = bar([bp.Sensor("s1", at=0.31)], [bp.Actuator("a1", at=0.23)])
    data = measured(apart)
    assert not experiment(0.001).check_data(data).passed
    assert experiment(0.15).check_data(data).passed


def test_a_gain_breaks_reciprocity():
    checks = exchanged().check_data(changed(measured(exchanged()), 1.3, 0, 1))
    assert kinds(checks) == ["reciprocity"]
    (sentence,) = checks.words()
    assert sentence.startswith("s1+x / a2+x and s2-x / a1+x differ by 26 %")
    assert "(the first is 1.29 times the second)" in sentence


def test_reciprocity_allows_gains_of_a_few_percent():
    assert exchanged().check_data(changed(measured(exchanged()), 1.08, 0, 1)).passed


def test_reversed_polarity_breaks_reciprocity():
    (sentence,) = exchanged().check_data(changed(measured(exchanged()), -1.0, 0, 1)).words()
    assert "(the first is minus 0.995 times the second)" in sentence


def test_noise_excuses_a_difference_of_reciprocal_pairs():
    random = np.random.default_rng(3)
    data = measured(exchanged())
    error = 1 + 0.25 * random.standard_normal(LINES.size)
    noisy = changed(data, error, 0, 1)
    assert kinds(exchanged().check_data(noisy)) == ["reciprocity"]
    known = dataclasses.replace(noisy, coherence=np.full(data.frf.shape, 0.6), averages=10)
    assert exchanged().check_data(known).passed


@pytest.mark.parametrize(
    "factor, words",
    [
        (1 / 9.80665, "a factor of 0.102, as of the unit g in the place of m/s²"),
        (-1.0, "a factor of -0.999, of reversed polarity"),
        (1000.0, "as of millimetres in the place of metres"),
        (2.5, "a factor of 2.5)"),
        (np.exp(1j), "no common factor"),
    ],
)
def test_free_structures_must_follow_their_rigid_body_line(factor, words):
    checks = free_beam().check_data(changed(measured(free_beam()), factor))
    assert kinds(checks) == ["rigid-body line"]
    (sentence,) = checks.words()
    assert sentence.startswith("s1+z / a1+z does not follow the rigid-body line")
    assert words in sentence


def test_a_high_pass_filter_leaves_the_rigid_body_line_at_low_frequencies():
    cut = 1 / (1 - 1j * 8.0 / FREE_LINES)
    (fault,) = free_beam().check_data(changed(measured(free_beam()), cut)).faults["rigid-body line"]
    assert "from 4 to 1" in fault.sentence


def test_missing_mass_is_no_fault_of_the_data():
    heavier = free_beam() + bp.effects.point_mass(0.7, 0.1 * 7850 * 3e-4)
    assert free_beam().check_data(measured(heavier)).passed


def test_held_structures_have_no_rigid_body_line():
    assert "rigid-body line" not in exchanged().check_data(measured(exchanged())).faults


def test_a_coherence_of_one_says_nothing():
    data = measured(exchanged())
    perfect = dataclasses.replace(data, coherence=np.ones(data.frf.shape), averages=1)
    checks = exchanged().check_data(perfect)
    assert kinds(checks) == ["coherence"]
    (sentence,) = checks.words()
    assert sentence.startswith("The coherence of all pairs (first s1+x / a1+x) is 1 at 100 %")
    partly = np.array(data.coherence)
    partly[1, 0] = 1.0
    assert "1 of 4 pairs (first s2-x / a1+x)" in str(
        exchanged().check_data(dataclasses.replace(data, coherence=partly))
    )


@pytest.mark.parametrize("sign", [1, -1])
def test_a_record_that_stands_twice_is_found(sign):
    data = measured(exchanged())
    frf = np.array(data.frf)
    frf[1, 1] = sign * frf[0, 1] * (1 + 2e-8)
    checks = exchanged().check_data(dataclasses.replace(data, frf=frf))
    (fault,) = checks.faults["repeated records"]
    assert "s1+x / a2+x and s2-x / a2+x hold the same record" in fault.sentence


def test_two_measurements_of_one_place_are_no_copies():
    sensors = [bp.Sensor("s1", at=0.23), bp.Sensor("s2", at=0.23)]
    experiment = bar(sensors, [bp.Actuator("a1", at=0.61)])
    assert not kinds(experiment.check_data(measured(experiment)))


@pytest.mark.parametrize("part", ["amplitude", "real part", "imaginary part"])
def test_a_clipped_record_is_found(part):
    data = measured(exchanged())
    frf = np.array(data.frf)
    limit = 0.3 * np.abs(frf[0, 1]).max()
    values = frf[0, 1]
    if part == "amplitude":
        frf[0, 1] = np.where(np.abs(values) > limit, limit * values / np.abs(values), values)
    elif part == "real part":
        frf[0, 1].real = np.clip(values.real, -limit, limit)
    else:
        frf[0, 1].imag = np.clip(values.imag, -limit, limit)
    checks = exchanged().check_data(dataclasses.replace(data, frf=frf))
    (fault,) = checks.faults["overload"]
    assert fault.sentence.startswith(f"The {part} of s1+x / a2+x is clipped: it stays at")


def test_a_flat_record_is_found():
    data = measured(exchanged())
    frf = np.array(data.frf)
    frf[0, 1] = 3.0
    checks = exchanged().check_data(dataclasses.replace(data, frf=frf))
    (fault,) = checks.faults["overload"]
    assert "s1+x / a2+x is flat: it has one value at 100 % of its lines" in fault.sentence


def test_pairs_that_were_not_measured_are_left_out():
    data = changed(measured(exchanged()), np.nan, 0, 0)
    assert exchanged().check_data(data).passed


def test_force_levels_are_named():
    experiment = exchanged()
    sensors, actuators = list(experiment.sensor.values()), list(experiment.actuator.values())
    levels = bp.Experiment(
        experiment.structure,
        sensors=sensors,
        actuators=actuators,
        frequency=LINES,
        observe=experiment.observe,
        noise=experiment.noise,
        force_levels=[0.1, 1.0],
    )
    data = measured(experiment)
    good = dataclasses.replace(data, force_level=0.1)
    bad = dataclasses.replace(changed(data, -1.0), force_level=1.0)
    checks = levels.check_data([bad, good])
    assert checks.words()[0].startswith("At 1 N: the driving point s1+x / a1+x")
    assert len(checks.words()) == 1


def test_the_table_has_a_row_for_each_fault():
    table = exchanged().check_data(changed(measured(exchanged()), -1.0)).table()
    assert table["check"].tolist() == ["driving points"]
    assert table.loc[0, "value"] > table.loc[0, "threshold"]


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::bayes_placement.inference.infer.InferenceWarning")
def test_the_result_of_an_inference_and_its_check_tell_the_faults():
    experiment = exchanged()
    data = changed(measured(experiment), -1.0)
    engine = bp.engines.MAP(starts=2, draws=20)
    posterior = bp.infer(experiment, data, engine=engine)
    sentences = experiment.check_data(data).sentences()
    assert posterior.attrs["data_faults"] == sentences
    assert bp.check(posterior).words()[: len(sentences)] == sentences
    assert bp.check(bp.infer(experiment, measured(experiment), engine=engine)).data_faults == ()


def cases():
    """Folders of the cases, of which each third is tried but for plates, which are long to read."""
    folders = [*DATA.glob("cases/*/case.json"), *DATA.glob("imperfect/*/case.json")]
    for number, path in enumerate(sorted(folders)):
        marks = FURTHER * (number % 3 > 0 or "plate" in path.parent.name)
        yield pytest.param(path.parent, id=path.parent.name, marks=marks)


@pytest.mark.skipif(not DATA.is_dir(), reason="the measured cases are outside the repository")
@pytest.mark.parametrize("folder", list(cases()))
def test_no_false_alarm_on_the_cases(folder):
    study = bp.io.case.read(folder)
    checks = study.experiment.check_data(study.measurement)
    truth = json.loads((folder.parent / "truth" / f"{folder.name}.json").read_text())
    hidden = {effect["name"]: effect["parameters"] for effect in truth["effects"]}
    if "misplaced_sensor" in hidden and not checks.passed:  # its record is at fault indeed
        (fault,) = checks.faults["rigid-body line"]
        assert fault.sensor.startswith(hidden["misplaced_sensor"]["sensor"])
    else:
        assert checks.passed, checks


class Alike(Linear):
    """Two of three modes have one natural frequency."""

    def angular_frequency(self):
        return 2 * np.pi * jnp.array([40.0, 70.0, 70.0])


def test_modes_of_one_natural_frequency_are_a_fault_where_modes_are_observed():
    def checked(modes, frequency):
        measured = bp.ModalParameters(frequency, 0.1 * np.ones(len(frequency)), number=[1, 2])
        experiment = bp.Experiment(
            bp.Structure(modes, damping=bp.damping.Modal(0.01)),
            sensors=[],
            observe=bp.observe.ModalData(measured),
            noise=bp.noise.FromVariance(),
        )
        return experiment.check_data(measured)

    checks = checked(Alike(), [40.0, 70.0])
    assert not checks.passed
    assert "Modes 2 and 3 of the model are both at 70 Hz" in checks.sentences()[0]
    assert checked(Linear(), [40.0, 70.0]).words() == [
        "No fault was found in the data (checked: repeated modes)."
    ]
    assert checked(Alike(), [20.0, 40.0]).passed  # they lie above what was measured
