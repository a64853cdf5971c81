"""Coherence estimated from few averages, against simulated records whose model is right."""

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.errors import InputError

LINES = np.arange(1.0, 601.0)
RECEPTANCE = 1 / (1 - (LINES / 120) ** 2 + 0.04j * LINES / 120) + 0.3 / (
    1 - (LINES / 410) ** 2 + 0.03j * LINES / 410
)
NOISE = {"response": 0.02 + 0 * LINES, "of each part": 0.01 + 0.03 * np.abs(RECEPTANCE)}


def measured(averages, noise, seed=0, channels=4):
    """Measurement by the H1 estimator of so many hits, each a little softer or harder."""
    random = np.random.default_rng([seed, averages])

    def normal(*shape):
        return (random.normal(size=shape) + 1j * random.normal(size=shape)) / np.sqrt(2)

    hardness = random.uniform(0.9, 1.1, (averages, channels, 1))
    force = hardness * np.exp(-((LINES / 900) ** 2))
    response = RECEPTANCE * force + noise * normal(averages, channels, LINES.size)
    powers = [np.sum(np.abs(record) ** 2, axis=0) for record in (force, response)]
    cross = np.sum(np.conj(force) * response, axis=0)
    coherence = np.abs(cross) ** 2 / (powers[0] * powers[1])
    return recorded(cross / powers[0], LINES, coherence, averages)


def recorded(frf, lines, coherence, averages):
    """Measurement of several sensors and one force, arrays [sensor, frequency]."""
    return bp.Measurement.from_arrays(
        frf[:, None],
        lines,
        sensors=[f"s{number}" for number in range(len(frf))],
        actuators=["a1"],
        quantity="receptance",
        coherence=coherence[:, None],
        averages=averages,
    )


def chi2(measurement, variance):
    return np.abs(measurement.frf - RECEPTANCE) ** 2 / variance


@pytest.mark.parametrize("noise", NOISE.values(), ids=NOISE)
@pytest.mark.parametrize("averages", [3, 5, 8, 20, 60])
def test_a_right_model_has_a_chi2_of_1(averages, noise):
    measurement = measured(averages, noise)
    squares = chi2(measurement, measurement.noise_variance())
    error = np.std(squares) / np.sqrt(squares.size)
    # What the mean of 1 / variance is corrected for holds to a few percent: levels change.
    assert abs(np.mean(squares) - 1.0) < 0.04 + 4 * error
    beyond = np.exp(-5)  # of an exponential distribution
    assert np.mean(squares > 5) < beyond + 4 * np.sqrt(beyond / squares.size)


def test_without_pooling_it_would_fail():
    measurement = measured(5, NOISE["response"])
    coherence = measurement.coherence
    variance = np.abs(measurement.frf) ** 2 * (1 - coherence) / (5 * coherence)
    assert np.mean(chi2(measurement, variance)) > 1.5  # n / (n - 2) is 1.67


@pytest.mark.parametrize("averages", [5, 20, 100])
def test_a_coherence_that_is_known_stays_as_it_is(averages):
    share = NOISE["of each part"] ** 2 / np.abs(RECEPTANCE) ** 2  # noise over signal
    measurement = measured(averages, NOISE["of each part"])
    variance = np.abs(measurement.frf) ** 2 * share / averages
    frf = measurement.frf[:, 0]
    known = recorded(frf, LINES, np.broadcast_to(1 / (1 + share), frf.shape), averages)
    np.testing.assert_allclose(known.noise_variance(), variance, rtol=1e-12)


def test_chosen_lines_keep_the_variance_of_the_whole_record():
    measurement = measured(5, NOISE["response"])
    chosen = measurement.thinned(60).channels(["s3", "s1"], ["a1"]).converted("accelerance")
    index = np.searchsorted(LINES, chosen.frequency)
    expected = measurement.noise_variance()[[3, 1]][..., index]
    factor = (2 * np.pi * chosen.frequency) ** 4
    np.testing.assert_allclose(chosen.noise_variance(), expected * factor, rtol=1e-12)


@pytest.mark.parametrize("averages", [4, 10])
@pytest.mark.parametrize("padding", [1, 4])
def test_padded_records_with_a_window_are_estimates_as_well(averages, padding):
    random, size = np.random.default_rng([padding, averages]), 1024
    window = np.exp(-4.6 * np.arange(size) / size)
    scatter = window * random.normal(size=(averages, 6, size))
    lines = np.fft.rfftfreq(size * padding)[1:-1] * size
    response = 30 / (1 - (lines / 150) ** 2 + 0.05j * lines / 150)
    hits = response + np.fft.rfft(scatter, size * padding)[..., 1:-1]
    frf = hits.mean(axis=0)
    coherence = np.abs(frf) ** 2 / np.mean(np.abs(hits) ** 2, axis=0)
    measurement = recorded(frf, lines, coherence, averages)
    truth = np.sum(window**2) / averages
    low, high = np.percentile(measurement.noise_variance() / truth, [2.5, 97.5])
    assert 0.5 < low < high < 2  # of single lines they go from 0.2 to 2.9
    squares = np.abs(frf - response) ** 2 / measurement.noise_variance()[:, 0]
    independent = squares.size / (5 * padding)
    assert abs(np.mean(squares) - 1) < 0.04 + 4 / np.sqrt(independent)


def test_lines_of_no_coherence_tell_nothing_of_their_neighbours():
    measurement = measured(5, NOISE["response"])
    coherence = measurement.coherence[:, 0].copy()
    coherence[0, [0, 300]] = 0.0, 1.0
    damaged = recorded(measurement.frf[:, 0], LINES, coherence, 5)
    with pytest.raises(InputError, match="coherence 0 means an unbounded error"):
        damaged.noise_variance()
    variance = damaged.without(1, 1).without(301, 301).noise_variance()[0, 0]
    np.testing.assert_allclose(
        variance[[10, 400]], measurement.noise_variance()[0, 0, [11, 402]], rtol=0.1
    )
