"""Experiments with fewer lines, and the output error of the lines that stay."""

import dataclasses

import equinox as eqx
import numpy as np
import numpy.testing as npt
import pytest

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.experiment.variants import observing_modes, with_lines, with_only

LINES = np.arange(100.0, 110.0)


def experiment(noise, force_levels=None):
    modes = bp.beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.03)),
        sensors=[bp.Sensor("s1", at=0.25), bp.Sensor("s2", at=0.6)],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=LINES,
        observe=bp.observe.LogAmplitude("velocity"),
        noise=noise,
        force_levels=force_levels,
    )


@pytest.mark.parametrize("noise", [None, bp.noise.Gaussian(0.1)])
def test_some_lines_are_taken_evenly_and_all_else_stays(noise):
    full = experiment(noise)
    changed = with_lines(full, 5)
    npt.assert_array_equal(changed.frequency, LINES[1::2])
    for field in dataclasses.fields(full):
        if field.name != "frequency":
            assert eqx.tree_equal(getattr(changed, field.name), getattr(full, field.name))


@pytest.mark.parametrize("count", [10, 11, 1000])
def test_no_more_lines_than_there_are(count):
    full = experiment(bp.noise.Gaussian(0.1))
    assert with_lines(full, count) is full


@pytest.mark.parametrize("count", range(1, 10))
def test_no_line_is_taken_twice(count):
    changed = with_lines(experiment(None), count).frequency
    assert len(set(changed)) == count
    assert changed.mean() == pytest.approx(LINES.mean(), abs=0.5)


@pytest.mark.parametrize("shape", [(10,), (2, 1, 10)])
def test_each_line_keeps_its_level_of_the_output_error(shape):
    sigma = 0.01 * np.broadcast_to(LINES, shape)
    changed = with_lines(experiment(bp.noise.Gaussian(sigma)), 3)
    npt.assert_allclose(
        changed.noise.sigma, 0.01 * np.broadcast_to(changed.frequency, (*shape[:-1], 3))
    )


def test_levels_of_channels_stay():
    sigma = np.array([0.1, 0.2]).reshape(2, 1, 1)
    changed = with_lines(experiment(bp.noise.Gaussian(sigma)), 3)
    npt.assert_array_equal(changed.noise.sigma, sigma)


def test_each_pair_of_lines_keeps_its_covariance():
    changed = with_lines(
        experiment(bp.noise.Covariance(np.outer(LINES, LINES) + np.eye(10), factor=2.0)), 3
    )
    npt.assert_allclose(
        changed.noise.matrix, np.outer(changed.frequency, changed.frequency) + np.eye(3)
    )
    assert changed.noise.factor == 2.0


def test_each_force_level_keeps_its_output_error():
    sigma = np.stack([LINES, 2 * LINES])
    changed = with_lines(experiment(bp.noise.Gaussian(sigma), force_levels=[1.0, 3.0]), 4)
    lines = changed.frequency
    npt.assert_array_equal(changed.noise.sigma, np.stack([lines, 2 * lines]))
    assert lines.size == 4


def test_a_sensor_that_remains_keeps_its_level_of_the_output_error():
    levels = np.array([0.1, 0.2])[:, None, None]
    alone = with_only(experiment(bp.noise.Gaussian(levels)), sensors=["s2"])
    assert [channel.name for channel in alone.sensor_channels] == ["s2"]
    assert [channel.name for channel in alone.actuator_channels] == ["a1"]
    npt.assert_array_equal(alone.noise.sigma, [[[0.2]]])
    assert with_only(experiment(None), sensors=["s2"]).noise is None


def test_sensors_and_actuators_of_one_name_are_told_apart():
    shared = bp.Experiment(
        experiment(None).structure,
        sensors=[bp.Sensor("p1", at=0.25), bp.Sensor("p2", at=0.6)],
        actuators=[bp.Actuator("p1", at=0.25), bp.Actuator("p2", at=0.6)],
        frequency=LINES,
        observe=bp.observe.LogAmplitude("velocity"),
        noise=None,
    )
    alone = with_only(shared, sensors=["p2"])
    assert (list(alone.sensor), list(alone.actuator)) == (["p2"], ["p1", "p2"])


def modes_at(*labels):
    shape = np.ones((len(labels), 2))
    known = {"shape": shape, "shape_deviation": 0.1 * shape, "sensors": labels} if labels else {}
    return bp.ModalParameters([166.0, 333.0], [0.1, 0.2], number=[1, 2], **known)


def test_an_experiment_of_frfs_becomes_one_of_modes():
    of_frfs = (
        experiment(bp.noise.Gaussian(0.1))
        + bp.effects.point_mass(0.4, 0.2, name="clamp")
        + bp.effects.gain_error("s2", 1.1)
        + bp.effects.time_delay(1e-4)
    )
    modal = observing_modes(of_frfs, modes_at("s2", "s1", "s9"))
    assert (list(modal.sensor), list(modal.actuator)) == (["s1", "s2"], [])
    assert [effect.name for effect in modal.effects] == ["clamp", "gain_error"]
    gain = modal.instrument_effects["gain_error"]
    assert (int(gain.transducer), gain.error) == (1, 1.1)
    npt.assert_array_equal(modal.frequency, [166.0, 333.0])
    assert [channel.label for channel in modal.observe.channels] == ["s1+x", "s2+x"]


def test_sensors_without_a_shape_are_left_out_and_the_model_error_stays():
    sizes = {
        "frequency": 0.01,
        "damping": None,
        "shape": 0.02,
        "gain": None,
        "stiffness_and_mass": None,
    }
    of_frfs = experiment(bp.noise.Gaussian(0.1)).with_model_error(bp.model_error.Embedded(**sizes))
    modal = observing_modes(of_frfs, modes_at("s2"))
    assert list(modal.sensor) == ["s2"]
    errors = modal.model_error
    assert (errors.frequency.size, errors.shape.size, errors.gain) == (0.01, 0.02, None)
    assert list(errors.shape.standard.sensor) == ["s2"]
    assert errors.modes == 2  # of the modes above those measured nothing is seen


def test_shapes_at_other_sensors_alone_are_refused():
    with pytest.raises(InputError, match="shapes at s8, s9, but the sensors of the model are s1"):
        observing_modes(experiment(None), modes_at("s8", "s9"))
    numbered = experiment(None) + bp.effects.gain_error("s2", 1.1)
    with pytest.raises(InputError, match="about one sensor, by its number"):
        observing_modes(numbered, modes_at("s2"))
