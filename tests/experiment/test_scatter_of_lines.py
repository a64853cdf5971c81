"""Noise that is read from the scatter of lines, compared with the noise that was added."""

from dataclasses import replace

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement.experiment._noise_level import variance_by_fits

MODES = [(37.0, 0.01, 1.0), (90.0, 0.004, -0.8), (171.0, 0.01, 0.6), (260.0, 0.02, 0.7)]
LEVELS = {
    "of the force": lambda frequency, size: 0.01 * size,
    "of the response": lambda frequency, size: 0.02 * np.median(size) * np.ones(size.shape),
    "of a hammer": lambda frequency, size: np.hypot(
        0.005 * size, 0.003 * np.median(size) * np.exp(frequency / 100)
    ),
}


def accelerance(frequency):
    omega = 2 * np.pi * frequency
    return -(omega**2) * sum(
        share / ((2 * np.pi * natural) ** 2 - omega**2 + 4j * np.pi * natural * ratio * omega)
        for natural, ratio, share in MODES
    )


def white(random, count):
    return (random.standard_normal(count) + 1j * random.standard_normal(count)) / np.sqrt(2)


def windowed(random, count):
    """Errors that a Hann window makes alike at neighbouring lines."""
    return np.convolve(white(random, count), [0.5, 1.0, 0.5], "same") / np.sqrt(1.5)


@pytest.mark.parametrize("spacing", [0.0625, 0.25])
@pytest.mark.parametrize("level", LEVELS.values(), ids=LEVELS)
@pytest.mark.parametrize("errors", [white, windowed])
def test_the_added_noise_comes_out(errors, level, spacing):
    """Four lines or more in a half-power bandwidth; the mean over records has an error of 0.02."""
    random, frequency = np.random.default_rng(3), np.arange(20.0, 320.0, spacing)
    frf = accelerance(frequency)
    deviation = level(frequency, np.abs(frf))
    ratios, squares = [], []
    for _ in range(10):
        error = deviation * errors(random, frequency.size)
        variance = variance_by_fits(frf + error)
        ratios.append(np.median(variance / deviation**2))
        squares.append(np.mean(np.abs(error) ** 2 / variance))
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.12)
    assert np.mean(squares) == pytest.approx(1.0, abs=0.12)


def recorded():
    frequency = np.arange(20.0, 120.0, 0.25)
    frf = accelerance(frequency) + 0.01 * white(np.random.default_rng(1), frequency.size)
    named = {"sensors": ["s1"], "actuators": ["a1"], "quantity": "accelerance"}
    return bp.Measurement.from_arrays(frf, frequency, **named)


def test_chosen_lines_keep_the_variance_of_the_whole_record():
    record = recorded()
    variance = record.scatter_variance()
    few = record.thinned(12)
    kept = np.isin(record.frequency, few.frequency)
    np.testing.assert_array_equal(few.scatter_variance(), variance[..., kept])
    again = few.band(25.0, 110.0).channels(["s1"], ["a1"]).converted("receptance")
    lines = np.isin(record.frequency, again.frequency)
    omega = 2 * np.pi * again.frequency
    np.testing.assert_allclose(again.scatter_variance(), variance[..., lines] / omega**4)


LEVEL = dist.LogUniform(1e-3, 1.0)
BAR = bp.beams.bar(2, length=1.0, area=1e-3, youngs_modulus=7e10, density=2700.0)


@pytest.mark.parametrize(
    ("noise", "is_kept"),
    [
        (bp.noise.Gaussian(LEVEL), True),
        (bp.noise.Relative(LEVEL), True),
        (bp.noise.Gaussian(0.01), False),
        (bp.noise.FromCoherence(LEVEL), False),
        (None, False),
    ],
)
def test_data_of_chosen_lines_keep_the_scatter_where_the_level_of_the_noise_is_unknown(
    noise, is_kept
):
    record = replace(recorded(), coherence=np.full((1, 1, 400), 0.9), averages=8)
    few = bp.Experiment(
        bp.Structure(BAR, damping=bp.damping.Modal(0.01)),
        sensors=[bp.Sensor("s1", at=0.2)],
        actuators=[bp.Actuator("a1", at=0.6)],
        frequency=record.frequency[5::40],
        observe=bp.observe.Complex("acceleration"),
        noise=noise,
    )
    scatter = few.data(record).scatter
    assert (scatter is not None) == is_kept
    if is_kept:
        variance = record.scatter_variance()[..., 5::40]
        np.testing.assert_allclose(np.sum(np.square(scatter), axis=-2), variance, rtol=1e-5)
        still = replace(record, frf=np.ones((1, 1, 400), dtype=complex))
        assert few.data(still).scatter is None


@pytest.mark.parametrize("lines", [slice(0, 20), np.r_[0:40, 50:90]], ids=["few", "a gap"])
def test_lines_that_tell_no_scatter_are_refused(lines):
    whole = recorded()
    record = replace(whole, frf=whole.frf[..., lines], frequency=whole.frequency[lines])
    with pytest.raises(ValueError, match=r"at least 23 that are evenly spaced are needed"):
        record.scatter_variance()


def test_lines_without_scatter_are_refused():
    record = replace(recorded(), frf=np.ones((1, 1, 400), dtype=complex))
    with pytest.raises(ValueError, match="variance of s1 / a1 at 20 Hz is 0; a positive one"):
        record.scatter_variance()
