"""Mistakes of whole records: each is named before anything else, and none on what is right."""

import dataclasses
import functools
from pathlib import Path

import equinox as eqx
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.experiment.data_checks.mistaken_records import LEAST_ODDS
from tests.experiment.measured_bars import LINES, bar, exchanged, free_beam, kinds, measured

DATA = Path(__file__).parents[3] / "shared" / "data"
NAME = "mistaken records"
FEW = ("07_cantilever-02", "09_freebeam-02", "11_cantilever-03")
"""Open cases without a file of finite elements, which take long to read."""

needs_cases = pytest.mark.skipif(
    not DATA.is_dir(), reason="the measured cases are outside the repository"
)


def of_frf(change):
    """A mistake that makes other FRFs of FRFs and angular frequencies [rad/s]."""

    def mistaken(run):
        return dataclasses.replace(run, frf=change(run.frf, 2 * np.pi * run.frequency))

    return mistaken


def polar(amplitude, phase):
    return amplitude * np.exp(1j * phase)


def decibels(frf):
    return 20 * np.log10(np.abs(frf))


def swapped(run):
    frf = np.array(run.frf)
    frf[[0, 1]] = frf[[1, 0]]
    return dataclasses.replace(run, frf=frf)


MISTAKES = {
    "conjugated": of_frf(lambda frf, omega: frf.conj()),
    "inverted": of_frf(lambda frf, omega: 1 / frf),
    "integrated twice": of_frf(lambda frf, omega: -frf / omega**2),
    "integrated once": of_frf(lambda frf, omega: frf / (1j * omega)),
    "differentiated once": of_frf(lambda frf, omega: 1j * omega * frf),
    "differentiated twice": of_frf(lambda frf, omega: -frf * omega**2),
    "like decibels": of_frf(lambda frf, omega: decibels(frf) + 0j),
    "like decibels that": of_frf(lambda frf, omega: polar(decibels(frf), np.angle(frf))),
    "like linear amplitudes": of_frf(
        lambda frf, omega: polar(10 ** (np.abs(frf) / 20), np.angle(frf))
    ),
    "made with phases in degrees": of_frf(
        lambda frf, omega: polar(np.abs(frf), np.angle(frf, deg=True))
    ),
    "made with phases in radians": of_frf(
        lambda frf, omega: polar(np.abs(frf), np.deg2rad(np.angle(frf)))
    ),
    "to have lines in rad/s": lambda run: dataclasses.replace(
        run, frequency=2 * np.pi * run.frequency
    ),
    "to have lines in Hz": lambda run: dataclasses.replace(
        run, frequency=run.frequency / (2 * np.pi)
    ),
    "like those of s1": swapped,
}


def only_sentence(experiment, measurement):
    """The sentence of a record that is mistaken, and has no other fault."""
    checks = experiment.check_data(measurement)
    assert kinds(checks) == [NAME], checks
    return checks.faults[NAME][0].sentence


@functools.cache
def study(name):
    (folder,) = DATA.glob(f"*/{name}")
    return bp.io.case.read(folder)


def runs(measurement):
    return [measurement] if isinstance(measurement, bp.Measurement) else list(measurement)


@pytest.mark.parametrize(
    "experiment", [exchanged(), pytest.param(free_beam(), marks=pytest.mark.long)]
)
@pytest.mark.parametrize("words", [words for words in MISTAKES if "degrees" not in words])
def test_each_mistake_of_a_simulated_record_is_named(experiment, words):
    sentence = only_sentence(experiment, MISTAKES[words](measured(experiment)))
    assert f" look {words}" in sentence


def test_degrees_are_told_where_the_damping_is_low():
    """Where phases turn by more than half a turn in radians from line to line, they are noise."""
    experiment = free_beam()
    data = measured(experiment)
    words = "made with phases in degrees"
    assert f" look {words}" in only_sentence(experiment, MISTAKES[words](data))


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_the_line_that_mends_a_derivative_names_the_quantity(quantity):
    data = measured(exchanged())
    stated = dataclasses.replace(data.converted(quantity), quantity="mobility")
    if quantity == "mobility":
        assert exchanged().check_data(stated).passed
    else:
        assert f'they are {quantity}, quantity="{quantity}"' in only_sentence(exchanged(), stated)
        assert exchanged().check_data(dataclasses.replace(stated, quantity=quantity)).passed


def test_a_derivative_that_has_no_name_is_mended_by_a_factor():
    sentence = only_sentence(exchanged(), MISTAKES["differentiated once"](measured(exchanged())))
    assert "divide them by (2j * np.pi * frequency) ** 1" in sentence


@pytest.mark.parametrize("quantity", ["receptance", "accelerance"])
def test_lines_away_from_resonances_do_not_tell_the_sense_of_time(quantity):
    conjugated = MISTAKES["conjugated"](measured(exchanged(), quantity=quantity))
    resonances = 1e9**0.5 / 9000**0.5 / 2 * np.arange(1, 6)
    away = np.all(np.abs(LINES[:, None] - resonances) > 0.1 * resonances, axis=1)
    assert kinds(exchanged().check_data(conjugated)) == [NAME]
    few = eqx.tree_at(lambda tree: tree.frequency, exchanged(), LINES[away])
    assert NAME not in kinds(few.check_data(conjugated.lines(LINES[away])))


def cantilever(turned=()):
    """A bar that is fixed at one end, places of some sides measured from the other."""

    def at(side, place):
        return bp.positions.Segment(1.0 - place if side in turned else place, within=0.01)

    sensors = [bp.Sensor(f"s{n}", at=at("sensors", x)) for n, x in enumerate((0.2, 0.55, 0.9))]
    actuators = [bp.Actuator("a1", at=at("actuators", 0.35))]
    return bar(sensors, actuators, ends="fixed-free")


@pytest.mark.parametrize("sides", [["sensors"], ["actuators"], ["sensors", "actuators"]])
def test_places_that_were_measured_from_the_other_end_are_named(sides):
    sentence = only_sentence(cantilever(sides), measured(cantilever()))
    named = " and ".join(sides)
    assert f"at places of the {named} that were measured from the other end: " in sentence
    assert (
        f"state where the {named} sat from the other end, each place as 1 - place [m]" in sentence
    )


@needs_cases
@pytest.mark.long
def test_in_space_the_axis_is_named():
    plate = study("02_plate-01").experiment.nominal()
    low, high = (corner[1] for corner in plate.structure.modes.bounds())
    assert low < high

    def positions(experiment):
        return [sensor.position for sensor in experiment.sensor.values()]

    turned = [
        bp.positions.Cartesian(x, low + high - y, z)
        for x, y, z in (map(float, place.coordinates()) for place in positions(plate))
    ]
    sentence = only_sentence(eqx.tree_at(positions, plate, turned), measured(plate))
    # The plate is symmetric: the same would be seen of its actuators.
    for side in ("sensors", "actuators"):
        assert f"places of the {side} that were measured from the other end along y" in sentence


@pytest.mark.parametrize("words", ["conjugated", "inverted"])
def test_one_sensor_alone_may_be_mistaken(words):
    data = measured(exchanged())
    frf = np.array(data.frf)
    frf[1] = MISTAKES[words](data).frf[1]
    sentence = only_sentence(exchanged(), dataclasses.replace(data, frf=frf))
    assert sentence.startswith(f"2 of 4 FRFs (first s2-x / a1+x) look {words}")


def test_swapped_sensors_are_told_with_their_effect():
    sentence = only_sentence(exchanged(), swapped(measured(exchanged())))
    assert "like those of s1 and s2 swapped" in sentence
    assert 'add effects.swapped_sensors("s1", "s2")' in sentence


def test_actuators_that_are_swapped_are_told():
    data = measured(exchanged())
    sentence = only_sentence(exchanged(), dataclasses.replace(data, frf=data.frf[:, ::-1]))
    assert 'add effects.swapped_actuators("a1", "a2")' in sentence


def test_channels_that_were_not_measured_cannot_be_swapped():
    """With warnings as errors: no mean is taken over none of the pairs."""
    places = {"a1": 0.61, "a2": 0.37, "a3": 0.83}
    experiment = bar(
        [bp.Sensor("s1", at=0.23)], [bp.Actuator(name, at=place) for name, place in places.items()]
    )
    data = measured(experiment)
    frf = np.array(data.frf)
    frf[:, 1:] = np.nan
    assert experiment.check_data(dataclasses.replace(data, frf=frf)).passed


@pytest.mark.parametrize("words", ["inverted", "integrated once", "to have lines in rad/s"])
def test_one_channel_that_is_enough(words):
    one = bar([bp.Sensor("s1", at=0.23)], [bp.Actuator("a1", at=0.61)])
    assert f" look {words}" in only_sentence(one, MISTAKES[words](measured(one)))


@pytest.mark.parametrize("words", ["inverted", "integrated twice", "like decibels"])
def test_amplitudes_alone_are_enough(words):
    experiment = exchanged()
    amplitudes = bp.Experiment(
        experiment.structure,
        sensors=list(experiment.sensor.values()),
        actuators=list(experiment.actuator.values()),
        frequency=LINES,
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.Gaussian(0.1),
    )
    right = of_frf(lambda frf, omega: np.abs(frf) + 0j)(measured(experiment))
    mistaken = MISTAKES[words](right)
    mistaken = dataclasses.replace(mistaken, frf=mistaken.frf.real + 0j)
    assert not amplitudes.check_data(right).faults[NAME]
    assert f" look {words}" in only_sentence(amplitudes, mistaken)


def test_lines_at_zero_and_pairs_that_were_not_measured_are_left_out():
    data = measured(exchanged())
    frf = np.array(data.frf)
    frf[0, 1], frf[:, 0, 0] = np.nan, 0.0
    frequency = data.frequency - data.frequency[0]
    shifted = dataclasses.replace(data, frf=frf, frequency=frequency)
    assert not exchanged().check_data(shifted).faults[NAME]
    sentence = only_sentence(exchanged(), MISTAKES["conjugated"](shifted))
    assert sentence.startswith("All FRFs (first s1+x / a1+x) look conjugated")


@pytest.mark.parametrize(
    "factor", [1.0, 1000.0, -1.0, np.exp(-2j * np.pi * LINES * 2e-4), 1 / (1 + 1j * LINES / 900.0)]
)
def test_gains_polarities_delays_and_filters_are_no_mistakes(factor):
    data = measured(exchanged())
    changed = dataclasses.replace(data, frf=data.frf * factor)
    assert not exchanged().check_data(changed).faults[NAME]


@pytest.mark.parametrize("stretch", [0.5, 0.8, 1.25, 2.0])
def test_a_wrong_modulus_is_no_mistake(stretch):
    data = measured(exchanged())
    stretched = dataclasses.replace(data, frequency=stretch * data.frequency)
    assert not exchanged().check_data(stretched).faults[NAME]


@pytest.mark.parametrize("seed", range(3))
def test_noise_alone_is_no_mistake(seed):
    random = np.random.default_rng(seed).standard_normal((2, 2, 2, LINES.size))
    data = dataclasses.replace(measured(exchanged()), frf=random[0] + 1j * random[1])
    assert not exchanged().check_data(data).faults[NAME]


def test_the_odds_are_the_statistic():
    (fault,) = exchanged().check_data(MISTAKES["inverted"](measured(exchanged()))).faults[NAME]
    assert fault.value > fault.threshold == pytest.approx(np.log10(LEAST_ODDS))
    assert f"at odds of 1e{int(fault.value)} to 1" in fault.sentence


@needs_cases
@pytest.mark.parametrize("words", list(MISTAKES))
@pytest.mark.parametrize(
    "name",
    [
        FEW[0],
        pytest.param(FEW[1], marks=pytest.mark.long),
        pytest.param(FEW[2], marks=[pytest.mark.long, pytest.mark.longest]),
    ],
)
def test_each_mistake_of_three_open_cases_is_named(name, words):
    experiment, measurement, *_ = study(name)
    sentence = only_sentence(experiment, MISTAKES[words](measurement))
    assert f" look {words}" in sentence


@needs_cases
@pytest.mark.long
@pytest.mark.longest
@pytest.mark.parametrize("words", [words for words in MISTAKES if "degrees" not in words])
@pytest.mark.parametrize("name", [path.name for path in sorted(DATA.glob("cases/[01]*"))])
def test_each_mistake_of_every_open_case_is_named(name, words):
    experiment, measurement, *_ = study(name)
    mistaken = [MISTAKES[words](run) for run in runs(measurement)]
    checks = experiment.check_data(mistaken if len(mistaken) > 1 else mistaken[0])
    assert kinds(checks) == [NAME]
    assert all(f" look {words}" in sentence for sentence in checks.sentences())


def unlisted():
    """Cases with effects of no library, most of them long, as finite elements are."""
    for number, path in enumerate(sorted(DATA.glob("unlisted/n*"))):
        marks = [pytest.mark.long] * (number > 1) + [pytest.mark.longest] * (number > 3)
        yield pytest.param(path.name, marks=marks)


@needs_cases
@pytest.mark.parametrize("name", list(unlisted()))
def test_missing_effects_of_no_library_are_no_mistakes(name):
    experiment, measurement, *_ = study(name)
    faults = experiment.check_data(measurement).faults
    assert not faults[NAME] + faults["stated noise"]
