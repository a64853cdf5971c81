"""Forms in which records may be given, options of the estimate, and what is refused."""

import numpy as np
import pytest

import bayes_placement as bp
from tests.io.time_records.oscillator import RATE, hit

ONE = np.array(hit(0.5, force=1.0))
HITS = [force * ONE for force in (80.0, 100.0, 120.0)]
NOISE = 0.01 * np.random.default_rng(0).standard_normal((3, 3, HITS[0][0].size))
FORCE = np.array([force for force, _ in HITS]) + NOISE[0]
RESPONSE = np.array([[scale * motion for _, motion in HITS] for scale in (1, -2)]) + NOISE[1:]
REQUIRED = {
    "excitation": bp.time_records.Impacts(),
    "actuator": "a1",
    "quantity": "acceleration",
    "band": (20.0, 500.0),
}


def frf(force=FORCE, response=RESPONSE, rate=RATE, **options):
    return bp.time_records.frf(
        force, response, rate, **(REQUIRED | {"sensors": ["s1", "s2"]} | options)
    )


@pytest.mark.parametrize(
    ("force", "response", "sensors"),
    [
        (FORCE, RESPONSE, ["s1", "s2"]),
        (list(FORCE), [list(row) for row in RESPONSE], ["s1", "s2"]),
        (FORCE, {"s1": RESPONSE[0], "s2": list(RESPONSE[1])}, None),
        (FORCE.tolist(), RESPONSE.tolist(), ["s1", "s2"]),
    ],
    ids=["arrays", "sequences", "by label", "lists of numbers"],
)
def test_records_may_be_given_in_several_forms(force, response, sensors):
    measurement = frf(force, response, sensors=sensors).measurement
    np.testing.assert_array_equal(measurement.frf, frf().measurement.frf)
    assert [channel.label for channel in measurement.sensors] == ["s1", "s2"]


@pytest.mark.parametrize("response", [RESPONSE[0], RESPONSE[:1], list(RESPONSE[0])])
def test_the_response_of_one_sensor_may_stand_alone(response):
    measurement = frf(response=response, sensors="s1+x").measurement
    np.testing.assert_array_equal(measurement.frf[0], frf().measurement.frf[0])
    assert measurement.sensors[0] == ("s1", 1)


def test_lines_and_neighbours_can_be_chosen():
    alone = frf(neighbours=1)
    np.testing.assert_array_equal(alone.measurement.variance, alone.scatter)
    np.testing.assert_array_equal(frf().scatter, alone.scatter)
    assert not np.allclose(frf().measurement.variance, alone.scatter, rtol=0.1)
    second = frf(every=2).measurement
    np.testing.assert_allclose(second.frequency, frf().measurement.frequency[::2])
    np.testing.assert_allclose(second.frf, frf().measurement.frf[..., ::2])


def test_the_estimate_says_what_it_is():
    words = str(frf())
    assert "241 lines from 20 to 500 Hz, with coherence and with variance, 3 averages" in words
    assert "By H1 from 3 repeats." in words


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"sensors": None}, r"given without names; a sensor label is needed for each"),
        ({"sensors": ["s1", "s1"]}, r"sensor channel s1 was given twice"),
        ({"sensors": ["s1", "s2", "s3"]}, r"have 2 rows for 3 sensor channels; one row for each"),
        ({"response": RESPONSE[:, :2]}, r"s1 has 2 records and the force has 3; one for each"),
        ({"response": RESPONSE[..., :-1]}, r"Record 1 of s1 has 2047 samples and its force 2048"),
        ({"force": FORCE[:, None]}, r"force was given as .* of 3 axes; the samples of one record"),
        ({"force": FORCE[:0]}, r"The force has no record"),
        ({"force": FORCE + 1j}, r"of shape \(2048,\) and complex128; at least 16 real numbers"),
        ({"force": FORCE[:, :5]}, r"of shape \(5,\) and float64; at least 16 real numbers"),
        ({"force": np.where(FORCE > 99, np.nan, FORCE)}, r"Sample \d+ of the force is nan; finite"),
        ({"rate": 0.0}, r"rate=0 was given; a number above 0"),
        ({"rate": np.nan}, r"rate=nan was given; one finite number"),
        ({"estimator": "H3"}, r"estimator='H3' was given; one of H1, H2, Hv is needed"),
        ({"every": 0}, r"every=0 was given; a whole number of at least 1"),
        ({"neighbours": 0}, r"neighbours=0 was given; a whole number of at least 1"),
        ({"band": (2000.5, 2001.5)}, r"band=\(2000.5, 2001.5\) was given; one that holds a line"),
        ({"band": (500.0, 20.0)}, r"its limits must rise"),
        ({"ranges": {"s3": 1.0}}, r"ranges names 's3', which is no channel; one of a1, s1, s2"),
        ({"ranges": {"s1": -1.0}}, r"ranges\['s1'\]=-1 was given; a number above 0"),
        ({"quantity": "jerk"}, r"quantity='jerk' was given"),
        (
            {"force": FORCE[[0, 1, 0]], "response": RESPONSE[:, [0, 1, 0]]},
            r"Records 1 and 3 are equal in all samples of all channels; each record is needed once",
        ),
    ],
)
def test_wrong_arguments_are_refused(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        frf(**options)


def test_a_response_without_content_is_refused():
    silent = np.zeros(2048)
    silent[700] = 1e-200
    shaken = bp.time_records.Continuous(segment=0.1)
    with pytest.raises(ValueError, match=r"The response has no content at 29"):
        frf(response=[[silent] * 3] * 2, excitation=shaken)
