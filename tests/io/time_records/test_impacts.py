"""Hits of a hammer: the FRF in closed form, windows, and hits that are left out."""

import functools
import re

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from tests.io.time_records.oscillator import (
    DAMPING,
    NATURAL,
    RATE,
    accelerance,
    hit,
    pulse,
    response,
    times,
)

pytestmark = pytest.mark.filterwarnings(
    "ignore::bayes_placement.io.time_records.estimate.EstimateWarning"
)

BAND = (20.0, 800.0)
DURATION = 1.0


@functools.cache
def four_hits():
    return [hit(DURATION, force=force) for force in (80.0, 100.0, 120.0, 95.0)]


def estimated(hits=None, seed=0, noise=(0.02, 0.02), **options):
    """Estimate from hits with noise on force and response."""
    random = np.random.default_rng(seed)
    records = [
        tuple(
            level * random.standard_normal(x.size) + x for level, x in zip(noise, pair, strict=True)
        )
        for pair in hits or four_hits()
    ]
    arguments = {
        "excitation": bp.time_records.Impacts(before=0.015),
        "actuator": "hammer",
        "quantity": "acceleration",
        "band": BAND,
    } | options
    force, motion = ([pair[side] for pair in records] for side in (0, 1))
    return bp.time_records.frf(force, {"s1": motion}, RATE, **arguments)


def chi2(estimate, shift=0.0):
    """Mean squared error of the FRF over its variance, against the closed form."""
    measurement = estimate.measurement
    exact = accelerance(2j * np.pi * measurement.frequency + shift)
    return np.mean(np.abs(measurement.frf[0, 0] - exact) ** 2 / measurement.variance[0, 0])


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
def test_without_noise_the_frf_is_the_closed_form(estimator):
    measurement = estimated(noise=(1e-9, 1e-9), estimator=estimator).measurement
    exact = accelerance(2j * np.pi * measurement.frequency)
    np.testing.assert_allclose(measurement.frf[0, 0], exact, rtol=1e-3)
    assert measurement.quantity == "accelerance"
    assert [channel.label for channel in measurement.actuators] == ["hammer"]
    assert measurement.averages == 4
    assert measurement.frequency[0] >= 20.0 and measurement.frequency[-1] <= 800.0


@pytest.mark.parametrize("estimator", ["H1", "H2", "Hv"])
def test_the_error_is_as_large_as_stated(estimator):
    errors = [chi2(estimated(seed=seed, estimator=estimator)) for seed in range(8)]
    assert np.mean(errors) == pytest.approx(1.0, abs=5 * np.std(errors) / np.sqrt(8) + 0.01)


@pytest.mark.parametrize("tau", [0.05, 0.2])
def test_an_exponential_window_is_a_known_damping(tau):
    window = bp.time_records.Impacts(before=0.015, time_constant=tau)
    estimate = estimated(excitation=window, noise=(1e-9, 1e-9), every=1)
    shift = 1 / tau
    exact = accelerance(2j * np.pi * estimate.measurement.frequency + shift)
    np.testing.assert_allclose(estimate.measurement.frf[0, 0], exact, rtol=2e-3)
    (effect,) = estimate.effects
    assert isinstance(effect, type(bp.effects.exponential_window(1.0)))
    assert effect.rate == pytest.approx(1 / tau)
    assert estimate.time_constant == tau
    assert f"exponential window of time constant {tau:g} s" in str(estimate)
    assert estimated().effects == ()


def test_the_window_as_an_effect_of_an_experiment_predicts_what_was_recorded():
    tau = 0.05
    window = bp.time_records.Impacts(before=0.015, time_constant=tau)
    estimate = estimated(excitation=window, noise=(1e-9, 1e-9), every=1)
    modes = bp.finite_elements.modes_from_shapes  # one mode of a unit shape, over two nodes
    model = bp.finite_elements.ModalModel.from_arrays(
        position=[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
        shape=np.full((2, 3, 1), 1.0) * [[[1.0]], [[1.0]]],
        natural_frequency=[NATURAL / (2 * np.pi)],
        modal_mass=[2.0],
    )
    structure = bp.Structure(
        modes(model, bp.finite_elements.interpolation.nearest(model)),
        damping=bp.damping.Modal(DAMPING),
    )
    experiment = bp.Experiment(
        structure,
        sensors=[bp.Sensor("s1", at=(0.0, 0.0, 0.0), directions=(1,))],
        actuators=[bp.Actuator("hammer", at=(1.0, 0.0, 0.0), directions=(1,))],
        frequency=estimate.measurement.frequency,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromVariance(dist.LogUniform(0.5, 2.0)),
    )
    for effect in estimate.effects:
        experiment = experiment + effect
    predicted = np.asarray(compiled(bp.Experiment.frf)(experiment))[0, 0]
    np.testing.assert_allclose(predicted, estimate.measurement.frf[0, 0], rtol=2e-3)


def test_lines_that_an_exponential_window_correlates_are_left_out():
    tau = 0.05
    window = bp.time_records.Impacts(before=0.015, time_constant=tau)
    thinned, every = estimated(excitation=window), estimated(excitation=window, every=1)
    step = round(DURATION / tau)
    np.testing.assert_allclose(np.diff(thinned.measurement.frequency), step / DURATION)
    assert f"every {step}th line" in str(thinned)
    assert not any("count as one independent line" in words for words in thinned.warnings)
    assert any("20 lines count as one independent line" in words for words in every.warnings)
    assert chi2(thinned, 1 / tau) < 2.0


def test_neighbouring_errors_are_correlated_as_said():
    tau, tests = 0.05, 150
    window = bp.time_records.Impacts(before=0.015, time_constant=tau)
    errors = []
    for seed in range(tests):
        estimate = estimated(seed=seed, noise=(0.0, 0.02), excitation=window, every=1, neighbours=1)
        errors.append(estimate.measurement.frf[0, 0, 100:200])
    errors = np.array(errors) - np.mean(errors, axis=0)
    unit = errors / np.sqrt(np.mean(np.abs(errors) ** 2, axis=0))
    correlation = np.abs(np.mean(unit[:, 50, None].conj() * unit, axis=0)) ** 2 - 1 / tests
    assert np.sum(correlation) == pytest.approx(20.0, rel=0.25)


def test_hits_in_a_long_record_are_found():
    starts = np.array([0.3, 1.5, 2.8, 3.95])
    time = times(5.1)
    forces = np.sum([pulse(time, force=80 + 10 * n, at=at) for n, at in enumerate(starts)], axis=0)
    fine = np.arange(time.size * 16) / (RATE * 16)
    exact = np.sum([pulse(fine, force=80 + 10 * n, at=at) for n, at in enumerate(starts)], axis=0)
    motion = response(exact, fine)[::16]
    cut = bp.time_records.Impacts(duration=DURATION, before=0.015)
    long = estimated([(forces, motion)], excitation=cut)
    assert long.repeats == 4 and not long.left_out
    assert chi2(long) < 1.5
    high = bp.time_records.Impacts(duration=DURATION, before=0.015, trigger=95.0)
    assert estimated([(forces, motion)], excitation=high).repeats == 2
    assert estimated([(forces, motion), (-forces, -motion)], excitation=cut).repeats == 8
    twice = forces + pulse(time, force=25.0, at=2.815)
    (sentence,) = estimated([(twice, motion)], excitation=cut).left_out
    assert sentence.startswith("Hit 3 of 4 ") and "again at 2.815 s of its record" in sentence


def test_a_double_hit_is_left_out():
    time = times(DURATION)
    second = four_hits()[1][0] + pulse(time, force=25.0, at=0.035)
    estimate = estimated([*four_hits(), (second, four_hits()[1][1])])
    assert estimate.repeats == 4
    (sentence,) = estimate.left_out
    assert (
        sentence
        == "Hit 5 of 5 is left out: the hammer hit twice, again at 0.03491 s of its record."
    )
    assert sentence in str(estimate)
    weak = four_hits()[1][0] + pulse(time, force=6.0, at=0.035)
    assert estimated([*four_hits(), (weak, four_hits()[1][1])]).repeats == 5
    lower = bp.time_records.Impacts(before=0.015, double_hit=0.05)
    assert estimated([*four_hits(), (weak, four_hits()[1][1])], excitation=lower).repeats == 4


def test_an_earlier_smaller_hit_counts_too():
    first = four_hits()[1][0] + pulse(times(DURATION), force=25.0, at=0.012)
    assert (
        "the hammer hit twice" in estimated([*four_hits(), (first, four_hits()[1][1])]).left_out[0]
    )


@pytest.mark.parametrize("side", ["hammer", "s1"])
def test_a_clipped_hit_is_left_out(side):
    pair = dict(zip(("hammer", "s1"), four_hits()[1], strict=True))
    limit = 0.6 * np.abs(pair[side]).max()
    pair[side] = np.clip(pair[side], -limit, limit)
    estimate = estimated([*four_hits(), tuple(pair.values())], noise=(0.0, 0.0))
    assert estimate.repeats == 4
    assert f"left out: {side} is clipped: it stays at its greatest" in estimate.left_out[0]


def test_a_hit_beyond_a_stated_range_is_left_out():
    estimate = estimated(ranges={"hammer": 110.0, "s1": 1e3})
    assert estimate.repeats == 3
    assert "hammer reaches its range of 110 at 0.02" in estimate.left_out[0]


def test_a_dead_channel_is_refused():
    with pytest.raises(ValueError, match=r"0 hits can be used; .* s1 stays at 0 throughout"):
        estimated([(force, 0 * motion) for force, motion in four_hits()], noise=(0.01, 0.0))


def test_a_hit_at_the_end_of_a_record_is_left_out():
    cut = bp.time_records.Impacts(duration=0.5, before=0.015)
    short = [(force[:1000], motion[:1000]) for force, motion in four_hits()[:1]]
    estimate = estimated([*short, *four_hits()[1:]], excitation=cut)
    assert estimate.repeats == 3
    assert "the record begins too late or ends too early for it" in estimate.left_out[0]


def test_a_single_hit_is_refused():
    with pytest.raises(ValueError, match=r"^1 hit can be used; at least two are needed, .* coher"):
        estimated(four_hits()[:1])
    with pytest.raises(ValueError, match=r"1 hit can .* Hit 2 of 2 is left out: s1 is clipped"):
        clipped = np.clip(four_hits()[1][1], -1.0, 1.0)
        estimated([four_hits()[0], (four_hits()[1][0], clipped)], noise=(0.0, 0.0))


def test_few_hits_are_flagged():
    with pytest.warns(bp.time_records.EstimateWarning, match="2 independent repeats know the var"):
        estimated(four_hits()[:2])
    assert not estimated().warnings


def test_hits_of_different_lengths_are_refused():
    short = tuple(side[:-100] for side in four_hits()[0])
    with pytest.raises(ValueError, match=r"hits have 3996 to 4096 samples; one length"):
        estimated([short, *four_hits()])


def test_a_response_that_goes_on_is_flagged():
    short = [(force[:820], motion[:820]) for force, motion in four_hits()]
    (sentence, *_) = estimated(short).warnings
    assert "response of s1 has not decayed at the end of its record, where it is" in sentence
    assert "Impacts(time_constant=0.04)" in sentence
    window = bp.time_records.Impacts(before=0.015, time_constant=0.04)
    assert not any("decayed" in words for words in estimated(short, excitation=window).warnings)


def test_a_noisy_record_is_not_taken_for_one_that_goes_on():
    assert not any("decayed" in words for words in estimated(noise=(0.02, 1.0)).warnings)


def test_a_force_window_takes_noise_away():
    window = bp.time_records.Impacts(before=0.015, force_window=0.01)
    noise = (0.3, 1e-6)
    plain = [estimated(four_hits() * 5, seed, noise) for seed in range(3)]
    windowed = [estimated(four_hits() * 5, seed, noise, excitation=window) for seed in range(3)]
    ratio = np.mean([np.mean(run.measurement.variance) for run in plain]) / np.mean(
        [np.mean(run.measurement.variance) for run in windowed]
    )
    assert ratio == pytest.approx(DURATION / 0.0144, rel=0.25)  # the integral of its square
    assert np.mean([chi2(run) for run in windowed]) == pytest.approx(1.0, abs=0.5)
    assert "force window of 0.01 s" in str(windowed[0])
    # The square of the window has the transform 1 / 14 ms wide: 67 lines count as one.
    for run in windowed:
        (sentence,) = run.warnings
        assert "What differs from repeat to repeat is alike in neighbouring lines" in sentence
        assert re.search(r"Take frf_of\(\.\.\., every=\d+\), or the same of frf\.$", sentence)
        assert float(sentence.split(" lines count")[0].split()[-1]) == pytest.approx(67, rel=0.2)
    assert not any(run.warnings for run in plain)


@pytest.mark.parametrize("before", [0.015, None, 0.5])  # the record has 0.02 s
@pytest.mark.parametrize("window", [{"time_constant": 0.1}, {"force_window": 0.01}])
def test_an_offset_has_no_consequence(window, before):
    shifted = [(force + 3.0, motion - 7.0) for force, motion in four_hits()]
    plain, offset = (
        estimated(
            hits,
            excitation=bp.time_records.Impacts(before=lead, **window),
            noise=(1e-9, 1e-9),
            every=1,
        )
        for hits, lead in ((four_hits(), 0.015), (shifted, before))
    )
    np.testing.assert_allclose(offset.measurement.frf, plain.measurement.frf, rtol=1e-6)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"duration": -1.0, "before": 0.1}, r"duration=-1 was given; a number above 0"),
        ({"time_constant": 0.0}, r"time_constant=0 was given; a number above 0"),
        ({"trigger": 50.0}, r"Impacts\(trigger=50\) was given without duration; both are needed"),
        ({"double_hit": 10}, r"double_hit=10 was given; a number above zero and up to 1"),
        ({"duration": 1.0}, r"Impacts\(duration=1, before=None\) was given; a time before"),
        ({"duration": 0.1, "before": 0.2}, r"a time before the trigger that is shorter"),
    ],
)
def test_wrong_times_are_refused(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        bp.time_records.Impacts(**options)


def test_too_short_hits_are_refused():
    with pytest.raises(ValueError, match=r"duration=0.002\) has 8 samples at 4096 Hz; at least 16"):
        estimated(excitation=bp.time_records.Impacts(duration=0.002, before=0.001))
