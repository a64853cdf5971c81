"""Measurements of a roving hammer or sensor as one."""

import dataclasses

import numpy as np
import pytest

import bayes_placement as bp

FREQUENCY = np.array([5.0, 10.0, 20.0])
RANDOM = np.random.default_rng(0)


def run(sensors, actuators, **changes):
    shape = len(sensors), len(actuators), FREQUENCY.size
    arguments = {
        "frf": RANDOM.standard_normal(shape) + 1j * RANDOM.standard_normal(shape),
        "frequency": FREQUENCY,
        "sensors": sensors,
        "actuators": actuators,
        "quantity": "accelerance",
        "coherence": RANDOM.uniform(0.5, 0.9, shape),
        "variance": RANDOM.uniform(0.1, 0.2, shape),
        "averages": 5,
        "positions": {name: (0.1, 0.0, 0.0) for name in sensors},
    } | changes
    return bp.Measurement.from_arrays(**arguments)


def test_pairs_stand_in_one_measurement():
    first, second = run(["s1", "s2"], ["h1"]), run(["s2"], ["h3", "h2"])
    both = bp.time_records.merged([first, second])
    assert [channel.label for channel in both.sensors] == ["s1", "s2"]
    assert [channel.label for channel in both.actuators] == ["h1", "h3", "h2"]
    np.testing.assert_array_equal(both.measured, [[True, False, False], [True, True, True]])
    for name in ("frf", "coherence", "variance"):
        np.testing.assert_array_equal(getattr(both, name)[:, :1], getattr(first, name))
        np.testing.assert_array_equal(getattr(both, name)[1:, 1:], getattr(second, name))
        assert np.isnan(getattr(both, name)[0, 1:]).all()
    assert both.averages == 5 and set(both.positions) == {"s1", "s2"}


def test_what_only_some_know_is_unknown_elsewhere():
    first = run(["s1"], ["h1"])
    second = run(["s1"], ["h2"], coherence=None, averages=4)
    both = bp.time_records.merged([first, second])
    assert both.averages is None
    np.testing.assert_array_equal(both.coherence[:, 0], first.coherence[:, 0])
    assert np.isnan(both.coherence[:, 1]).all()
    by_coherence = dataclasses.replace(first, variance=None)
    variance = bp.time_records.merged([by_coherence, second]).variance
    np.testing.assert_array_equal(variance[:, 0], by_coherence.noise_variance()[:, 0])
    np.testing.assert_array_equal(variance[:, 1], second.variance[:, 0])
    without = [dataclasses.replace(measured, variance=None) for measured in (first, second)]
    known = bp.time_records.merged(without).variance
    assert np.isnan(known[:, 1]).all() and np.isfinite(known[:, 0]).all()
    alike = [dataclasses.replace(measured, averages=5) for measured in without]
    assert bp.time_records.merged(alike).variance is None


@pytest.mark.parametrize(
    ("runs", "sentence"),
    [
        ([], r"No measurement was given; measurements on the same lines"),
        ([run(["s1"], ["h1"]), run(["s1"], ["h1"])], r"s1 / h1 is in two of the measurements"),
        ([run(["s1+x"], ["h1"]), run(["s1-x"], ["h1"])], r"s1-x / h1 is in two of the meas"),
        (
            [run(["s1"], ["h1"], force_level=1.0), run(["s1"], ["h2"], force_level=5.0)],
            r"at a force of 1\.0 N and 5\.0 N were given; one level is needed",
        ),
        (
            [run(["s1"], ["h1"]), run(["s1"], ["h2"], positions={"s1": (0.2, 0.0, 0.0)})],
            r"s1 was recorded at \(0\.1, 0\.0, 0\.0\) m and at \(0\.2, 0\.0, 0\.0\) m",
        ),
        (
            [run(["s1"], ["h1"]), run(["s1"], ["h2"], quantity="mobility")],
            r"Measurements of accelerance and of mobility were given",
        ),
        (
            [run(["s1"], ["h1"]), run(["s1"], ["h2"], frequency=FREQUENCY + 1)],
            r"Measurements of 3 and 3 lines were given, or of other ones",
        ),
    ],
)
def test_what_does_not_belong_together_is_refused(runs, sentence):
    with pytest.raises(ValueError, match=sentence):
        bp.time_records.merged(runs)
