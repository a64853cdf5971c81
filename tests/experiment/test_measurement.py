"""Measurement: labels, conversion, choice of lines and channels, and what it refuses."""

import numpy as np
import pytest

from bayes_placement.experiment.measurement import Channel, Measurement

FREQUENCY = np.array([5.0, 10.0, 20.0, 40.0])
GENERATOR = np.random.default_rng(11)
FRF = GENERATOR.standard_normal((3, 2, 4)) + 1j * GENERATOR.standard_normal((3, 2, 4))
COHERENCE = GENERATOR.uniform(0.5, 0.99, (3, 2, 4))


def measurement(**changes):
    arguments = {
        "frf": FRF,
        "frequency": FREQUENCY,
        "sensors": ["s1+x", "s1-z", "s2"],
        "actuators": ["a1-z", "a2+y"],
        "quantity": "accelerance",
        "coherence": COHERENCE,
        "averages": 16,
    }
    return Measurement.from_arrays(**(arguments | changes))


def single(frf=FRF[0, 0], **changes):
    arguments = {"sensors": "s1", "actuators": "a1", "coherence": None, "averages": None}
    return measurement(frf=frf, **(arguments | changes))


@pytest.mark.parametrize(
    ("label", "channel"),
    [
        ("s1", ("s1", 0)),
        ("s1+x", ("s1", 1)),
        ("s1-z", ("s1", -3)),
        ("left-wing+y", ("left-wing", 2)),
        ("wing tip", ("wing tip", 0)),
    ],
)
def test_labels_are_read_and_written(label, channel):
    assert Channel.parse(label) == channel
    assert Channel(*channel).label == label


def test_a_channel_is_parsed_to_itself():
    assert Channel.parse(Channel("s1", -2)) == ("s1", -2)


def test_a_label_without_name_is_refused():
    with pytest.raises(ValueError, match="needs the name of a transducer"):
        Channel.parse("  ")


def test_a_direction_that_is_none_is_refused():
    with pytest.raises(ValueError, match=r"given direction 4; it must be one of \+-1"):
        Channel.parse(Channel("s1", 4))


def test_a_name_that_reads_as_a_direction_is_refused():
    with pytest.raises(ValueError, match="would be read as another channel"):
        measurement(sensors=[Channel("s1+x", 0), "s2", "s3"])


def test_a_single_pair_may_be_one_dimensional():
    pair = single(list(FRF[0, 0]), coherence=list(COHERENCE[0, 0]))
    assert pair.frf.shape == pair.coherence.shape == (1, 1, 4)
    assert pair.sensors == (Channel("s1", 0),)


def test_arrays_are_copied_and_read_only():
    values = FRF.copy()
    copied = measurement(frf=values)
    values[:] = 0
    assert np.array_equal(copied.frf, FRF)
    with pytest.raises(ValueError, match="read-only"):
        copied.frf[0] = 0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"frf": FRF[:2]}, r"frf has shape \(2, 2, 4\); .* = \(3, 2, 4\) is needed"),
        ({"coherence": COHERENCE[..., :2]}, r"coherence has shape \(3, 2, 2\)"),
        ({"frf": np.full((3, 2, 4), np.nan)}, "nothing but NaN"),
        ({"frequency": FREQUENCY[::-1]}, "goes from 40 Hz to 20 Hz; it must increase"),
        ({"frequency": [5, 10, 10, 40]}, "goes from 10 Hz to 10 Hz"),
        ({"frequency": FREQUENCY - 6}, "value -1 Hz; lines must be finite and not negative"),
        ({"frequency": [5, 10, 20, np.nan]}, "value nan Hz"),
        ({"frequency": FREQUENCY[:, None]}, r"frequency has shape \(4, 1\); one axis"),
        ({"quantity": "inertance"}, "quantity='inertance' was given"),
        ({"coherence": 1.1 * COHERENCE / COHERENCE}, r"coherence is 1.1 for s1\+x / a1-z at 5 Hz"),
        ({"averages": 0}, "averages=0 was given; a whole number"),
        ({"averages": 1.5}, "averages=1.5 was given; a whole number"),
        ({"force_level": -1.0}, r"force_level=-1.0 was given; a positive amplitude \[N\]"),
        ({"positions": {"s1": (1.0, 2.0)}}, "position of 's1' .* three finite coordinates"),
        ({"positions": {"s1": (1.0, 2.0, np.nan)}}, "three finite coordinates"),
        ({"sensors": ["s1", "s2", "s1"]}, "sensor channel s1 was given twice"),
        ({"actuators": ["a1-z", "a1-z"]}, "actuator channel a1-z was given twice"),
    ],
)
def test_what_cannot_have_been_measured_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        measurement(**changes)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_gap_within_a_measured_pair_is_refused(bad):
    values = FRF.copy()
    values[1, 0, 2] = bad
    with pytest.raises(ValueError, match="for s1-z / a1-z at 20 Hz; a measured pair needs"):
        measurement(frf=values)


def test_a_gap_within_a_coherence_is_refused():
    values = COHERENCE.copy()
    values[2, 1, 0] = np.nan
    with pytest.raises(ValueError, match=r"coherence is nan for s2 / a2\+y at 5 Hz"):
        measurement(coherence=values)


def test_a_pair_may_be_left_unmeasured():
    values = FRF.copy()
    values[1, 0] = np.nan
    partly = measurement(frf=values)
    assert partly.measured.tolist() == [[True, True], [False, True], [True, True]]
    assert partly.to_dataset().frf[1, 0].isnull().all()


def test_conversion_is_division_by_the_square_of_i_omega():
    receptance = measurement().converted("receptance")
    assert np.allclose(receptance.frf, -FRF / (2 * np.pi * FREQUENCY) ** 2, rtol=1e-14)
    assert receptance.quantity == "receptance"


def test_the_mobility_of_a_damper_is_real():
    # Force c v: under exp(+i w t) the receptance is 1 / (i w c), and the mobility 1 / c.
    damper = single(1 / (2j * np.pi * FREQUENCY * 5.0), quantity="receptance")
    assert np.allclose(damper.converted("mobility").frf, 0.2, rtol=1e-14)


def test_0_hz_is_not_divided_by():
    resting = single(frequency=[0.0, 1.0, 2.0, 3.0])
    with pytest.raises(ValueError, match=r"accelerance at 0 Hz .* measurement.without\(0, 0\)"):
        resting.converted("mobility")
    assert resting.without(0, 0).converted("mobility").frequency[0] == 1.0


def test_0_hz_may_be_multiplied_by():
    resting = single(frequency=[0.0, 1.0, 2.0, 3.0], quantity="receptance")
    assert resting.converted("mobility").frf[0, 0, 0] == 0


def test_an_unknown_quantity_is_no_conversion():
    with pytest.raises(ValueError, match="quantity='inertance' was given"):
        measurement().converted("inertance")


def test_band_and_its_complement_share_out_the_lines():
    inside, outside = measurement().band(10, 20), measurement().without(10, 20)
    assert inside.frequency.tolist() == [10, 20]
    assert outside.frequency.tolist() == [5, 40]
    assert np.array_equal(outside.frf, FRF[..., [0, 3]])
    assert np.array_equal(inside.coherence, COHERENCE[..., [1, 2]])


def test_an_empty_band_is_refused():
    with pytest.raises(ValueError, match=r"band\(41, 50\) leaves no line .* 4 from 5 to 40 Hz"):
        measurement().band(41, 50)
    with pytest.raises(ValueError, match=r"without\(0, 50\) leaves no line"):
        measurement().without(0, 50)


def test_lines_are_found_to_the_digits_of_a_file():
    chosen = measurement().lines(np.array([9.99995, 40.0]))
    assert chosen.frequency.tolist() == [10, 40]
    assert np.array_equal(chosen.frf, FRF[..., [1, 3]])


def test_lines_that_were_not_measured_are_named():
    with pytest.raises(ValueError, match=r"2 of the .*: 11 Hz \(nearest 10 Hz\), 50 Hz \(nearest"):
        measurement().lines([5.0, 11.0, 50.0])


def test_many_missing_lines_are_counted():
    with pytest.raises(ValueError, match="and 4 more"):
        measurement().lines(np.arange(31.0, 40.0))


def test_lines_are_asked_for_once_and_in_order():
    with pytest.raises(ValueError, match="do not increase from one measured line to the next"):
        measurement().lines([10.0, 10.0])


def test_a_single_line_is_a_measurement():
    assert measurement().lines(20.0).frf.shape == (3, 2, 1)


def test_channels_are_picked_and_ordered():
    chosen = measurement().channels(["s2", "s1+x"], ["a2+y", "a1-z"])
    assert np.array_equal(chosen.frf, FRF[[2, 0]][:, [1, 0]])
    assert np.array_equal(chosen.coherence, COHERENCE[[2, 0]][:, [1, 0]])
    assert [channel.label for channel in chosen.sensors] == ["s2", "s1+x"]


def test_an_opposite_direction_flips_the_sign():
    chosen = measurement().channels(["s1+z", "s1+x"], ["a1+z", "a2+y"])
    assert np.array_equal(chosen.frf[0, 0], FRF[1, 0])  # both turned round
    assert np.array_equal(chosen.frf[0, 1], -FRF[1, 1])
    assert np.array_equal(chosen.frf[1, 0], -FRF[0, 0])
    assert np.array_equal(chosen.frf[1, 1], FRF[0, 1])
    assert [channel.label for channel in chosen.sensors] == ["s1+z", "s1+x"]
    assert np.array_equal(chosen.coherence, COHERENCE[[1, 0]])


def test_the_recorded_direction_is_preferred_to_its_opposite():
    two_ways = measurement(sensors=["s1-x", "s1+x", "s2"])
    assert np.array_equal(two_ways.channels("s1+x", "a1-z").frf[0, 0], FRF[1, 0])


def test_an_unstated_direction_matches_the_only_channel():
    chosen = measurement().channels(["s2+y"], ["a1"])
    assert np.array_equal(chosen.frf[0, 0], FRF[2, 0])
    assert (chosen.sensors[0].label, chosen.actuators[0].label) == ("s2+y", "a1-z")


def test_channels_may_repeat():
    chosen = measurement().channels(["s2", "s2"], "a1-z")
    assert np.array_equal(chosen.frf[0], chosen.frf[1])


def test_an_unstated_direction_must_not_be_a_choice():
    with pytest.raises(ValueError, match="channel s1 was requested, and several channels"):
        measurement().channels("s1", "a1")


def test_missing_channels_are_refused_with_what_there_is():
    with pytest.raises(ValueError, match=r"sensor channel s1\+y .* only s1\+x, s1-z, s2 were"):
        measurement().channels("s1+y", "a1")
    with pytest.raises(ValueError, match=r"actuator channel a3 .* only a1-z, a2\+y were"):
        measurement().channels("s2", "a3")


def test_noise_variance_is_that_of_simulated_h1_estimates():
    # Simulate the estimator itself: H1 = Sxy / Sxx over n averages with noise on the output.
    generator = np.random.default_rng(5)
    runs, averages, gain, noise = 20000, 50, 2.0 - 1.0j, 1.5

    def white(*shape):
        return (generator.standard_normal(shape) + 1j * generator.standard_normal(shape)) / 2**0.5

    force = white(runs, averages)
    motion = gain * force + noise * white(runs, averages)
    h1 = (motion * force.conj()).mean(1) / (abs(force) ** 2).mean(1)
    coherence = abs(gain) ** 2 / (abs(gain) ** 2 + noise**2)
    measured = single([gain], frequency=[1.0], coherence=[coherence], averages=averages)
    variance = np.mean(abs(h1 - gain) ** 2)
    # E[1 / mean |force|^2] adds a share of 1 / (n - 1) that the first-order formula leaves out.
    assert variance == pytest.approx(
        measured.noise_variance()[0, 0, 0] * averages / (averages - 1), rel=0.04
    )


def test_noise_variance_is_unknown_where_nothing_was_measured():
    values, coherence = FRF.copy(), COHERENCE.copy()
    values[0, 0] = coherence[0, 0] = np.nan
    variance = measurement(frf=values, coherence=coherence).noise_variance()
    assert np.isnan(variance[0, 0]).all()
    assert (variance[1:] > 0).all()


@pytest.mark.parametrize(
    ("missing", "name", "line"),
    [("coherence", "coherence", 'coherence = "coh"'), ("averages", "number of", "averages = 20")],
)
def test_noise_variance_needs_coherence_and_averages(missing, name, line):
    with pytest.raises(ValueError, match=f"has no {name}.* a file {line}.*noise.Gaussian"):
        measurement(**{missing: None}).noise_variance()


@pytest.mark.parametrize(("coherence", "variance"), [(0.0, "inf"), (1.0, "0")])
def test_noise_variance_must_be_positive_and_bounded(coherence, variance):
    values = COHERENCE.copy()
    values[1, 1, 2] = coherence
    with pytest.raises(ValueError, match=rf"s1-z / a2\+y at 20 Hz {variance}; a positive one"):
        measurement(coherence=values).noise_variance()


def test_a_measured_pair_without_coherence_has_no_variance():
    values = COHERENCE.copy()
    values[1, 1] = np.nan
    with pytest.raises(ValueError, match=r"s1-z / a2\+y at 5 Hz nan; a positive one is needed"):
        measurement(coherence=values).noise_variance()


def test_the_dataset_is_labelled_and_real():
    dataset = measurement(positions={"s2": (0.1, 0.2, 0.3)}, force_level=0.5).to_dataset()
    assert dataset.frf.dims == ("sensor", "actuator", "part", "frequency")
    chosen = dataset.sel(sensor="s1-z", actuator="a2+y", frequency=20.0)
    assert complex(*chosen.frf.values) == FRF[1, 1, 2]
    assert float(chosen.coherence) == COHERENCE[1, 1, 2]
    assert dataset.sensor_position.sel(sensor="s2").values.tolist() == [0.1, 0.2, 0.3]
    assert dataset.sensor_position.sel(sensor="s1+x").isnull().all()
    assert (dataset.frf.units, dataset.frequency.units) == ("(m/s²)/N", "Hz")
    assert dataset.attrs == {"quantity": "accelerance", "averages": 16, "force_level_newton": 0.5}


def test_it_says_what_it_is():
    assert str(measurement(force_level=0.5)) == (
        "Measurement: accelerance [(m/s²)/N] of 3 sensor channels for 2 actuator channels, 6 pairs "
        "measured, 4 lines from 5 to 40 Hz, with coherence, 16 averages, force 0.5 N."
    )
    assert "1 sensor channel for 1 actuator channel, 1 pair measured" in str(single())
    assert str(single()).endswith("no coherence.")


@pytest.mark.parametrize(
    ("frf", "motion"),
    [("receptance", "displacement"), ("mobility", "velocity"), ("accelerance", "acceleration")],
)
def test_an_frf_and_its_motion_are_one_quantity(frf, motion):
    assert measurement(quantity=motion).quantity == frf
    actual, expected = (measurement().converted(word) for word in (motion, frf))
    assert actual.quantity == expected.quantity == frf
    np.testing.assert_array_equal(actual.frf, expected.frf)


VARIANCE = GENERATOR.uniform(0.01, 0.1, (3, 2, 4))


def test_a_stated_variance_follows_lines_and_channels():
    stated = measurement(variance=VARIANCE)
    np.testing.assert_array_equal(stated.stated_variance(), VARIANCE)
    np.testing.assert_array_equal(stated.lines([10.0, 40.0]).variance, VARIANCE[..., [1, 3]])
    chosen = stated.channels(["s2", "s1-x"], ["a2+y"])
    np.testing.assert_array_equal(chosen.variance, VARIANCE[[2, 0]][:, [1]])
    assert "with coherence and with variance" in repr(stated)
    assert stated.to_dataset()["variance"].attrs["units"] == "((m/s²)/N)^2"
    with pytest.raises(ValueError, match="read-only"):
        stated.variance[0, 0, 0] = 1.0


def test_a_stated_variance_is_converted_with_its_frf():
    converted = measurement(variance=VARIANCE).converted("receptance")
    omega = 2 * np.pi * FREQUENCY
    np.testing.assert_allclose(converted.variance, VARIANCE / omega**4, rtol=1e-12)
    np.testing.assert_allclose(
        converted.variance / np.abs(converted.frf) ** 2, VARIANCE / np.abs(FRF) ** 2
    )


def test_a_stated_variance_is_asked_for():
    with pytest.raises(ValueError, match=r"states no variance of its FRFs; .*time_records\.frf"):
        measurement().stated_variance()


@pytest.mark.parametrize("wrong", [0.0, np.nan])
def test_a_stated_variance_must_be_known_where_something_was_measured(wrong):
    values = VARIANCE.copy()
    values[1, 0] = wrong
    stated = measurement(variance=values)
    with pytest.raises(ValueError, match=r"variance of s1-z / a1-z at 5 Hz is .*; a positive one"):
        stated.stated_variance()


@pytest.mark.parametrize("wrong", [-0.1, np.inf, np.nan])
def test_a_variance_must_be_finite_and_not_negative(wrong):
    values = VARIANCE.copy()
    values[2, 1, 3] = wrong
    with pytest.raises(ValueError, match=r"variance is .* for s2 / a2\+y at 40 Hz; it must be fin"):
        measurement(variance=values)


def test_the_shape_of_a_variance_is_that_of_the_frfs():
    with pytest.raises(ValueError, match=r"variance has shape \(3, 2, 3\)"):
        measurement(variance=VARIANCE[..., :3])
    assert single(variance=VARIANCE[0, 0]).variance.shape == (1, 1, 4)
