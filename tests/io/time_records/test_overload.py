"""Channels that were overloaded, and coarse or smooth ones that were not."""

import numpy as np
import pytest

from bayes_placement.io.time_records import recording
from bayes_placement.io.time_records.records import Records
from bayes_placement.positions.channel import Channel

RATE = 1000.0
TIME = np.arange(2000) / RATE
TONE = 5.0 * np.sin(2 * np.pi * 7.3 * TIME)
NOISE = 0.01 * np.random.default_rng(0).standard_normal(TIME.size)


def fault(samples, part=slice(None), **ranges):
    force = np.random.default_rng(1).standard_normal(samples.size)
    channels = (Channel("s1"),), Channel("a1")
    return recording.overload(Records(RATE, (force,), ((samples,),), *channels, ranges), 0, part)


def coarse(samples, digits):
    digit = np.abs(samples).max() / digits
    return digit * np.round(samples / digit)


@pytest.mark.parametrize("digits", [3, 10, 100, 3000])
@pytest.mark.parametrize("decay", [0.0, 1.0, 5.0])
def test_a_smooth_signal_in_coarse_digits_is_none(digits, decay):
    assert fault(coarse(TONE * np.exp(-decay * TIME), digits)) is None


def test_a_signal_of_all_digits_is_none():
    assert fault(TONE) is None
    assert fault(TONE + NOISE) is None


@pytest.mark.parametrize(
    ("share", "digits"), [(0.5, 100), (0.9, 100), (0.5, 30_000), (0.99, 30_000)]
)
def test_a_clipped_signal_is_told(share, digits):
    clipped = coarse(np.clip(TONE + NOISE, -5 * share, 5 * share), digits)
    assert fault(clipped).startswith("s1 is clipped: it ")


@pytest.mark.parametrize("samples", [3, 4, 8, 20])
@pytest.mark.parametrize("phase", [0.0, 0.25 * np.pi, 0.5 * np.pi])
def test_a_periodic_signal_without_noise_is_none(samples, phase):
    angle = 2 * np.pi * np.arange(2000) / samples + phase
    assert fault(np.sin(angle)) is None
    assert fault(np.sin(angle) + 0.3 * np.sin(3 * angle)) is None


def test_a_period_that_is_clipped_is_told():
    period = np.clip(np.random.default_rng(3).standard_normal(200), -1.5, 1.5)
    assert fault(np.tile(period, 10)).startswith("s1 is clipped: it ")


def test_when_a_plateau_begins_is_told():
    pulse = np.where((TIME > 0.5) & (TIME < 0.6), 0.0, 1.0) * NOISE
    pulse[500:520] = np.clip(np.hanning(20), 0, 0.7)
    assert fault(pulse) == "s1 is clipped: it stays at its greatest value from 0.506 s on"


def test_few_samples_at_a_limit_are_told_by_their_number():
    clipped = np.minimum(np.random.default_rng(2).standard_normal(2000), 2.0)
    assert fault(clipped) is None  # the other side goes further
    both = np.clip(np.random.default_rng(2).standard_normal(2000), -2.0, 2.0)
    assert fault(both) == "s1 is clipped: it reaches its greatest value, 2, 88 times"


def test_a_stated_range_and_a_dead_channel_are_told():
    assert fault(TONE, s1=5.0) == "s1 reaches its range of 5 at 0.033 s: it is overloaded"
    assert fault(TONE, s1=5.1) is None
    sentence = fault(TONE, slice(500, None), s1=5.0)  # the tone has its greatest value every 68 ms
    assert sentence == "s1 reaches its range of 5 at 0.512 s: it is overloaded"
    assert fault(0 * TONE + 3.0) == ("s1 stays at 3 throughout, as a channel that is not connected")
