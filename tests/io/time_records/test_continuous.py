"""Random excitation: the FRFs and coherences of SciPy, and the scatter of many tests."""

import numpy as np
import pytest
from scipy import signal

import bayes_placement as bp
from bayes_placement.io.time_records import continuous, estimation
from tests.io.time_records.oscillator import DAMPING, MASS, NATURAL

pytestmark = pytest.mark.filterwarnings(
    "ignore::bayes_placement.io.time_records.estimate.EstimateWarning"
)

RATE = 1024.0
TWO_SENSORS = np.array([1.0, -0.6])[:, None]


def oscillator():
    """The oscillator with a zero-order hold, which is exact in discrete time."""
    continuous = (
        [[0.0, 1.0], [-(NATURAL**2), -2 * DAMPING * NATURAL]],
        [[0.0], [1 / MASS]],
        [[0.0, 1.0]],
        [[0.0]],
    )
    *matrices, _ = signal.cont2discrete(tuple(map(np.array, continuous)), 1 / RATE)
    return signal.ss2tf(*matrices)


NUMERATOR, DENOMINATOR = oscillator()


def exact(frequency):
    _, response = signal.freqz(NUMERATOR[0], DENOMINATOR, 2 * np.pi * frequency / RATE)
    return TWO_SENSORS * response


def recorded(seed, duration=20.0, noise=(0.02, 2e-5)):
    random = np.random.default_rng(seed)
    force = random.standard_normal(round(duration * RATE))
    motion = TWO_SENSORS * signal.lfilter(NUMERATOR[0], DENOMINATOR, force)
    return (
        force + noise[0] * random.standard_normal(force.size),
        motion + noise[1] * random.standard_normal(motion.shape),
    )


def estimated(force, motion, excitation=None, **options):
    arguments = {
        "excitation": excitation or bp.time_records.Continuous(segment=1.0),
        "sensors": ["s1", "s2"],
        "actuator": "shaker",
        "quantity": "velocity",
    } | options
    return bp.time_records.frf(force, list(motion), RATE, **arguments)


@pytest.mark.parametrize(
    ("segment", "overlap", "window"),
    [(1.0, 0.5, "hann"), (0.75, 0.66, ("kaiser", 8.0)), (0.5, 0.0, "boxcar"), (0.31, 0.5, "hann")],
)
def test_estimates_are_those_of_scipy(segment, overlap, window):
    force, motion = recorded(0)
    excitation = bp.time_records.Continuous(segment, overlap=overlap, window=window)
    length = round(segment * RATE)
    options = {"fs": RATE, "window": window, "nperseg": length, "noverlap": int(overlap * length)}
    frequency, cross = signal.csd(force, motion, **options)
    _, power = signal.welch(force, **options)
    _, coherence = signal.coherence(force, motion, **options)
    _, response = signal.welch(motion, **options)
    h1 = estimated(force, motion, excitation, every=1)
    used = slice(1, 1 + h1.measurement.frequency.size)
    np.testing.assert_allclose(h1.measurement.frequency, frequency[used])
    np.testing.assert_allclose(h1.measurement.frf[:, 0], (cross / power)[:, used], rtol=1e-9)
    np.testing.assert_allclose(h1.measurement.coherence[:, 0], coherence[:, used], rtol=1e-9)
    h2 = estimated(force, motion, excitation, every=1, estimator="H2")
    expected = (response / cross.conj())[:, used]
    np.testing.assert_allclose(h2.measurement.frf[:, 0], expected, rtol=1e-9)
    hv = estimated(force, motion, excitation, every=1, estimator="Hv")
    np.testing.assert_allclose(np.abs(hv.measurement.frf[:, 0]) ** 2, (response / power)[:, used])


@pytest.mark.parametrize("overlap", [0.0, 0.5, pytest.param(0.75, marks=pytest.mark.long)])
def test_the_variance_is_the_scatter_of_many_tests(overlap):
    tests, excitation = 150, bp.time_records.Continuous(segment=0.5, overlap=overlap)
    runs = [
        estimated(*recorded(seed, 12.0, (0.1, 1e-3)), excitation, band=(40.0, 200.0), neighbours=1)
        for seed in range(tests)
    ]
    frfs = np.array([run.measurement.frf for run in runs])
    truth = np.sum(np.abs(frfs - frfs.mean(axis=0)) ** 2, axis=0) / (tests - 1)
    stated = np.mean([run.measurement.variance for run in runs], axis=0)
    ratio = truth / stated
    assert np.median(ratio) == pytest.approx(1.0, abs=0.1)
    away = np.abs(runs[0].measurement.frequency - 100.0) > 15.0
    assert np.all(np.abs(ratio[..., away] - 1) < 5 / np.sqrt(tests))
    # At the resonance segments also err by what they cut off, which the next segment makes up for.
    assert np.all(ratio[..., ~away] < 1 + 5 / np.sqrt(tests))
    errors = (frfs - frfs.mean(axis=0))[..., away] / np.sqrt(truth[..., away])
    neighbouring = np.abs(np.mean(errors[..., 1:].conj() * errors[..., :-1], axis=0)) ** 2
    if (
        overlap == 0.0
    ):  # neighbouring lines have the correlation 2 / 3, of the force and of the noise
        assert np.mean(neighbouring) - 1 / tests == pytest.approx((2 / 3) ** 4, abs=0.03)
    expected = {0.0: 24.0, 0.5: 44.6, 0.75: 47.0}[overlap]
    assert runs[0].measurement.averages == pytest.approx(expected, abs=1.0)


def test_lines_that_count_as_one_are_the_closed_form():
    window = signal.get_window("hann", 512)
    correlated = estimated(*recorded(0), bp.time_records.Continuous(0.5), every=1)
    assert not any("count as one independent line" in words for words in correlated.warnings)
    # Correlations of 2 / 3 and 1 / 6 with the first and second line to either side.
    expected = 1 + 2 * ((2 / 3) ** 4 + (1 / 6) ** 4)
    assert continuous._correlated_lines(window) == pytest.approx(expected, rel=1e-6)


def test_overlapping_segments_are_worth_fewer_averages():
    force, motion = recorded(0, 10.0)
    counts = [
        (run.repeats, run.measurement.averages)
        for run in (
            estimated(force, motion, bp.time_records.Continuous(1.0, overlap=share))
            for share in (0.0, 0.5, 0.9)
        )
    ]
    assert counts[0] == (10, 10)
    assert counts[1][0] == 19 and counts[1][1] in (17, 18)
    assert counts[2][0] == 90 and 18 <= counts[2][1] <= 21  # no more than by half of it


def test_records_are_segmented_one_by_one():
    force, motion = recorded(1, 8.0)
    parts = [slice(0, 3000), slice(3000, 3500), slice(3500, None)]
    together = estimated(
        [force[part] for part in parts], [[row[part] for part in parts] for row in motion]
    )
    assert together.repeats == 4 + 0 + 8
    np.testing.assert_allclose(
        together.measurement.frf[:, 0], exact(together.measurement.frequency), rtol=3.0
    )


def test_a_window_that_correlates_lines_is_thinned_or_flagged():
    force, motion = recorded(2)
    flat = bp.time_records.Continuous(segment=1.0, window="flattop")
    thinned = estimated(force, motion, flat)
    step = round(float(np.diff(thinned.measurement.frequency)[0]))
    assert step > 1 and f"every {step}th line" in str(thinned)
    every = estimated(force, motion, flat, every=1).warnings
    assert any("take frf_of(..., every=" in words for words in every)
    assert not any(
        "count as one independent line" in words for words in estimated(force, motion).warnings
    )


def smoothed(window, width, natural=100.0):
    """Amplitude at a resonance, and that of the expectation of H1, of a sum over its response."""
    time = np.arange(40 * window.size) / RATE
    impulse = np.exp(-np.pi * width * time) * np.sin(2 * np.pi * natural * time)
    lagged = np.correlate(window, window, "full")[window.size - 1 :] / np.sum(window**2)
    turn = np.exp(-2j * np.pi * natural * time)
    return np.abs([impulse @ turn, (impulse * turn)[: window.size] @ lagged])


@pytest.mark.parametrize("window", ["hann", "boxcar", "flattop"])
@pytest.mark.parametrize("lines", [2.0, 5.0, 10.0])
def test_what_a_window_takes_off_a_resonance_is_the_expectation(window, lines):
    samples = signal.get_window(window, 1024)
    exact, expected = smoothed(samples, lines)
    lowered = estimation.peak_bias(samples, RATE, lines)
    assert lowered == pytest.approx(1 - expected / exact, abs=0.01)


def test_what_hann_takes_off_a_wide_resonance_is_the_closed_form():
    lowered = estimation.peak_bias(signal.get_window("hann", 4096), 4096.0, 40.0)  # wide enough
    assert lowered == pytest.approx(4 / 3 / 40**2, rel=0.01)


def test_short_segments_are_flagged():
    force, motion = recorded(7, 60.0)
    (sentence,) = estimated(force, motion).warnings
    assert "resonance at 100 Hz is 4" in sentence and "lowers its peak by" in sentence
    peak = np.abs(estimated(force, motion).measurement.lines([100.0]).frf[0, 0, 0])
    share = 1 - peak / np.abs(exact(np.array([100.0])))[0, 0]
    lowering = float(sentence.split("peak by ")[1].split(" %")[0]) / 100
    assert lowering == pytest.approx(share, abs=0.02)
    assert not estimated(force, motion, bp.time_records.Continuous(segment=12.0)).warnings[1:]
    noisy = recorded(7, 10.0, (0.02, 2e-3))
    assert not estimated(*noisy).warnings


def test_what_was_done_is_told():
    words = str(estimated(*recorded(3)))
    assert "By H1 from 39 repeats, segments of 1 s, hann window, overlap 0.5." in words


@pytest.mark.parametrize(("segment", "count"), [(15.0, "1 segment "), (30.0, "0 segments ")])
def test_a_single_segment_is_refused(segment, count):
    force, motion = recorded(4)
    with pytest.raises(ValueError, match=rf"hold {count}of .*at least two are needed, .*coherence"):
        estimated(force, motion, bp.time_records.Continuous(segment))


def test_segments_that_are_nearly_the_same_are_refused():
    force, motion = recorded(4, 1.06)
    with pytest.raises(ValueError, match=r"overlap by 0\.95 are worth 1 independent averages"):
        estimated(force, motion, bp.time_records.Continuous(1.0, overlap=0.95))


def test_an_overloaded_record_is_refused():
    force, motion = recorded(5)
    motion[1] = np.clip(motion[1], -0.9 * motion[1].max(), 0.9 * motion[1].max())
    with pytest.raises(ValueError, match=r"In record 1 s2 is clipped: it reaches its greatest"):
        estimated(force, motion)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"segment": 0.0}, "segment=0 was given; a number above 0"),
        ({"segment": 1.0, "overlap": 1.0}, "overlap=1. was given; a share from 0 to 0.95"),
    ],
)
def test_wrong_segments_are_refused(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        bp.time_records.Continuous(**options)


def test_too_short_segments_are_refused():
    with pytest.raises(ValueError, match=r"segment has 10 samples at 1024 Hz; at least 16"):
        estimated(*recorded(6), bp.time_records.Continuous(segment=0.01))
