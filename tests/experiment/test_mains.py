"""Hum of the mains is found in measurements that have it, and in no others."""

import dataclasses

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.experiment.data_checks import check_data, mains
from bayes_placement.experiment.data_checks.record import Record

LINES = np.arange(5.0, 405.0, 1.0)


def bar(lines=LINES, sensors=(0.23, 0.61), actuators=(0.4,)):
    modes = bp.beams.bar(
        12, length=1.0, area=1e-3, youngs_modulus=1.7e8, density=9000.0, ends="fixed-fixed"
    )
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.02)),
        sensors=[bp.Sensor(f"s{n}", at=x) for n, x in enumerate(sensors, 1)],
        actuators=[bp.Actuator(f"a{n}", at=x) for n, x in enumerate(actuators, 1)],
        frequency=lines,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Gaussian(1.0),
    )


def resonant(natural, half_width, lines=LINES):
    """Accelerance of modes of alternating sign, each with a half-power half-width [Hz]."""
    signs = (-1.0) ** np.arange(len(natural))
    square, loss = np.square(natural)[:, None], 2j * half_width * lines
    return np.sum(signs[:, None] * -(lines**2) / (square - lines**2 + loss), axis=0)


def with_noise(frf, ratio, seed, floor=0.0):
    random = np.random.default_rng(seed)
    error = random.standard_normal((2, *frf.shape)) / np.sqrt(2)
    size = ratio * np.abs(frf) + floor * np.sqrt(np.mean(np.abs(frf) ** 2))
    return frf + size * (error[0] + 1j * error[1])


def faults(frf, lines=LINES):
    """Faults of FRFs, one for each sensor."""
    frf = np.atleast_2d(frf)[:, None]
    places = np.linspace(0.2, 0.8, len(frf))
    experiment = bar(lines, places)
    measured = bp.Measurement.from_arrays(
        frf,
        lines,
        sensors=experiment.sensor_channels,
        actuators=experiment.actuator_channels,
        quantity="accelerance",
    )
    record = Record(experiment, measured, 0)
    return list(mains.check(record)) if mains.can_check(record) else []


def humming(frf, multiples, share, lines=LINES, phase=0.7):
    level = np.sqrt(np.mean(np.abs(frf) ** 2))
    added = np.isin(lines, multiples) * share * level * np.exp(1j * phase)
    return frf + added


NATURAL = (37.0, 74.0, 165.0, 231.0, 322.0)


@pytest.mark.parametrize("multiples", [(50, 100, 150), (60, 180), (50, 350)])
def test_hum_is_named_with_its_lines(multiples):
    frf = with_noise(resonant(NATURAL, 3.0), 0.01, 0)
    (fault,) = faults([frf, humming(frf, multiples, 0.3)])
    words = ", ".join(str(line) for line in multiples)
    base = 60 if 60 in multiples else 50
    expected = f"s2+x at {words} Hz: hum of the mains, at multiples of {base} Hz. "
    assert fault.sentence.startswith(expected)
    assert fault.value > fault.threshold > 4


def test_hum_that_leaks_into_the_lines_beside_it_is_found():
    """As of a Hann window, which halves its amplitude there and turns it."""
    frf = with_noise(resonant(NATURAL, 3.0), 0.005, 1)
    for shift, share in ((0, 0.4), (-1, -0.2), (1, -0.2)):
        frf = humming(frf, np.array([50, 100, 200]) + shift, share)
    (fault,) = faults(frf)
    assert "at 50, 100, 200 Hz" in fault.sentence


@pytest.mark.parametrize(
    "ratio", [0.0, 0.03, *(pytest.param(r, marks=pytest.mark.long) for r in (1e-3, 0.3))]
)
def test_clean_records_are_not_accused(ratio):
    """200 records each, of which several have resonances at 50 Hz and at its multiples."""
    random = np.random.default_rng(3)
    frf = []
    for number in range(200):
        natural = random.uniform(20.0, 390.0, 8)
        natural[: number % 4] = np.array([50.0, 100.0, 150.0])[: number % 4]
        made = resonant(natural, random.uniform(0.5, 5.0))
        frf.append(with_noise(made, ratio, number, floor=0.1 * ratio))
    assert sum(len(faults(single)) for single in frf) <= (1 if ratio else 0)


def test_noise_alone_is_not_accused():
    random = np.random.default_rng(5)
    parts = random.standard_normal((2, 300, LINES.size))
    assert sum(len(faults(frf)) for frf in parts[0] + 1j * parts[1]) <= 1


def test_a_sharp_resonance_at_50_hz_and_others_elsewhere_are_not_hum():
    """Undersampled resonances stand out as hum does, wherever they are."""
    natural = (50.0, 83.0, 121.0, 150.0, 208.0, 333.0, 371.0)
    frf = with_noise(resonant(natural, 0.05), 1e-3, 0)
    assert not faults(frf)
    assert not faults(humming(with_noise(resonant(NATURAL, 3.0), 0.01, 0), [50], 0.3))


def test_hum_beside_a_resonance_at_the_mains_is_found_at_other_multiples():
    frf = with_noise(resonant((50.0, 130.0, 290.0), 3.0), 0.01, 2)
    (fault,) = faults(humming(frf, [100, 200, 300], 0.3))
    assert "at 100, 200, 300 Hz" in fault.sentence


def test_lines_far_apart_or_few_are_not_judged():
    for lines in (np.arange(10.0, 1000.0, 12.0), np.arange(30.0, 60.0)):
        experiment = bar(lines)
        checks = check_data(experiment, experiment.nominal_measurement())
        assert "mains" not in checks.faults


def test_lines_that_were_left_out_are_no_harm():
    frf = humming(with_noise(resonant(NATURAL, 3.0), 0.01, 0), [50, 100, 150, 200], 0.3)
    kept = (LINES < 145) | (LINES > 155)
    (fault,) = faults(frf[kept], LINES[kept])
    assert "at 50, 100, 200 Hz" in fault.sentence


def test_the_effect_is_found_by_the_check_and_mended_by_leaving_lines_out():
    experiment = bar()
    hum = experiment + bp.effects.mains_hum("s1", 0.5, 0.3)
    exact = hum.nominal_measurement()
    measured = dataclasses.replace(exact, frf=with_noise(np.asarray(exact.frf), 0.01, 0))
    (fault,) = experiment.check_data(measured).faults["mains"]
    assert fault.sentence.startswith("s1+x at 50, 100, 150, 200, 250, 300, 350, 400 Hz: hum of the")
    for multiple in range(50, 401, 50):
        measured = measured.without(multiple, multiple)
    assert not experiment.check_data(measured).faults["mains"]
