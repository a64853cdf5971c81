"""Stated noise: what is understated is named with its factor; curvature is not."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import bayes_placement as bp
from tests.experiment.measured_bars import exchanged, free_beam, kinds, measured

NAME = "stated noise"


def with_averages(run, factor):
    return dataclasses.replace(run, averages=run.averages * factor)


@pytest.mark.parametrize("experiment", [exchanged(), free_beam()])
@pytest.mark.parametrize("factor", [2.0, 3.0, 10.0])
def test_too_many_averages_are_told_with_their_factor(experiment, factor):
    checks = experiment.check_data(with_averages(measured(experiment), factor**2))
    assert kinds(checks) == [NAME]
    (fault,) = checks.faults[NAME]
    assert fault.value == pytest.approx(factor, rel=0.2)
    assert f"understated by a factor of {fault.value:.2g} (" in fault.sentence
    assert "averages say; look at the number of averages, of which" in fault.sentence


@pytest.mark.long
def test_the_interval_of_95_percent_covers_the_factor():
    """Of 20 intervals, four or more miss it by chance in 2 of 100 such tests."""
    experiment = exchanged()
    inside = 0
    for seed in range(20):
        (fault,) = experiment.check_data(with_averages(measured(experiment, seed=seed), 9)).faults[
            NAME
        ]
        low, high = fault.sentence.split("(")[1].split(" with")[0].split(" to ")
        inside += float(low) - 0.05 <= 3.0 <= float(high) + 0.05
    assert inside > 16


def test_a_variance_that_is_too_small_is_told():
    data = measured(exchanged())
    variance = np.abs(data.frf) ** 2 * 1e-6
    stated = dataclasses.replace(data, coherence=None, averages=None, variance=variance)
    (fault,) = exchanged().check_data(stated).faults[NAME]
    assert "more than its variance says; give" in fault.sentence


@pytest.mark.parametrize("factor", [1.0, 0.1, 1.9])
def test_right_and_overstated_noise_and_overlapping_blocks_are_not_told(factor):
    for seed in range(3):
        data = with_averages(measured(exchanged(), seed=seed), factor)
        assert not exchanged().check_data(data).faults[NAME]


def test_curvature_is_no_noise():
    """At few lines without noise, whose differences are those of the response alone."""
    experiment = exchanged()
    exact = measured(experiment, averages=1e8)
    few = exact.lines(exact.frequency[::9])
    variance = 1e-8 * np.abs(few.frf) ** 2
    stated = dataclasses.replace(few, coherence=None, averages=None, variance=variance)
    assert not experiment.check_data(stated).faults[NAME]


def test_noise_that_is_not_stated_is_not_checked():
    data = dataclasses.replace(measured(exchanged()), averages=None)
    assert NAME not in exchanged().check_data(data).faults


@pytest.mark.parametrize("name", ["07_cantilever-02", "09_freebeam-02", "12_bar-03"])
def test_too_many_averages_of_an_open_case_are_told(shared_data, name):
    experiment, measurement, *_ = bp.io.case.read(Path(shared_data / "cases" / name))
    (fault,) = experiment.check_data(with_averages(measurement, 9)).faults[NAME]
    assert fault.value == pytest.approx(3.0, rel=0.25)
    assert not experiment.check_data(measurement).faults[NAME]
