"""Choice of lines around resonances and of thinned lines."""

import dataclasses
import itertools

import jax
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement.experiment._noise_level import noise_variance
from bayes_placement.experiment.line_choice import half_power_bandwidth, resonances

NATURAL, DAMPING = np.array([40.0, 47.0, 130.0, 260.0]), 0.01
LINES = np.arange(1.0, 400.0, 0.1)


def modal(lines=LINES, *, noise=0.01, seed=0, damping=DAMPING, quantity="mobility", averages=25):
    """FRFs of four modes at three sensors, with relative noise as the coherence says."""
    random = np.random.default_rng(seed)
    constants = random.choice([-1, 1], (3, 1, 4)) * random.uniform(0.5, 1.5, (3, 1, 4))
    omega, natural = 2 * np.pi * lines, 2 * np.pi * NATURAL[:, None]
    modes = 1j * omega / (natural**2 - omega**2 + 2j * damping * natural * omega)
    exact = np.einsum("sam,mf->saf", constants * NATURAL, modes)
    error = noise * np.abs(exact) / np.sqrt(2) * random.standard_normal((2, *exact.shape))
    coherence = 1 / (1 + averages * max(noise, 1e-9) ** 2)
    return bp.Measurement.from_arrays(
        exact + error[0] + 1j * error[1],
        lines,
        sensors=["s1", "s2", "s3"],
        actuators=["a1"],
        quantity="mobility",
        coherence=np.full(exact.shape, coherence),
        averages=averages,
    ).converted(quantity)


def without_coherence(measurement):
    return dataclasses.replace(measurement, coherence=None, averages=None)


EACH_ONCE = [
    ("receptance", True, 1e-6),
    ("mobility", False, 1e-6),
    ("accelerance", True, 0.02),
    ("receptance", False, 0.02),
    ("mobility", True, 0.1),
    ("accelerance", False, 0.1),
]
"""Each pair of two of quantity, known noise and its size, hardly any twice."""

FURTHER = [pytest.mark.long, pytest.mark.longest]


@pytest.mark.parametrize(
    ("quantity", "known", "noise"),
    [
        pytest.param(*case, marks=[] if case in EACH_ONCE else FURTHER)
        for case in itertools.product(
            ["receptance", "mobility", "accelerance"], [True, False], [1e-6, 0.02, 0.1]
        )
    ],
)
def test_resonances_are_those_of_the_structure_and_no_more(quantity, known, noise):
    for seed in range(4):
        data = modal(noise=noise, seed=seed, quantity=quantity)
        peaks = data.frequency[resonances([data if known else without_coherence(data)])]
        assert peaks.size == NATURAL.size
        assert np.allclose(peaks, NATURAL, rtol=DAMPING)


def test_noise_alone_has_no_resonance():
    random = np.random.default_rng(2)
    real, imaginary = random.standard_normal((2, 3, 1, 500))
    data = bp.Measurement.from_arrays(
        real + 1j * imaginary,
        np.arange(1.0, 501.0),
        sensors=["s1", "s2", "s3"],
        actuators=["a1"],
        quantity="accelerance",
    )
    with pytest.raises(ValueError, match=r"no peak of the FRFs .*measurement\.thinned\(200\)"):
        data.around_resonances()


def test_the_half_power_bandwidth_is_twice_the_damping_times_the_frequency():
    for natural in (130.0, 260.0):
        data = modal(noise=1e-9)
        indicator = np.sum(np.abs(data.frf) ** 2, axis=(0, 1))
        peak = int(np.argmin(np.abs(LINES - natural)))
        assert half_power_bandwidth(LINES, indicator, peak) == pytest.approx(
            2 * DAMPING * natural, rel=0.05
        )


def test_lines_lie_around_resonances_as_dense_as_asked():
    chosen = modal().around_resonances(lines_per_bandwidth=5, bandwidths=3)
    apart = np.abs(chosen.frequency[:, None] - NATURAL) / (2 * DAMPING * NATURAL)
    assert np.all(apart.min(axis=1) < 3.5)
    near = chosen.band(130 - 1.3, 130 + 1.3).frequency
    assert near.size == pytest.approx(5, abs=1)
    assert chosen.frequency.size == pytest.approx(4 * 31, abs=2)
    assert chosen.coherence.shape == chosen.frf.shape


def test_all_lines_are_taken_where_fewer_were_measured():
    coarse = modal(np.arange(1.0, 400.0, 2.0), damping=0.001)
    chosen = coarse.around_resonances(lines_per_bandwidth=4, bandwidths=5)
    assert np.isin(chosen.frequency, coarse.frequency).all()
    assert np.unique(chosen.frequency).size == chosen.frequency.size
    for natural in NATURAL:
        assert np.abs(chosen.frequency - natural).min() <= 1.0


@pytest.mark.parametrize(
    "arguments", [{"lines_per_bandwidth": 0}, {"bandwidths": -1.0}, {"bandwidths": np.nan}]
)
def test_numbers_that_are_not_positive_are_refused(arguments):
    (name,) = arguments
    with pytest.raises(ValueError, match=rf"around_resonances was given {name}=.*above 0 is"):
        modal().around_resonances(**arguments)


def test_resonances_of_all_force_levels_count():
    low = dataclasses.replace(modal(), force_level=0.1)
    alone = low.around_resonances()
    together = low.around_resonances(together=[dataclasses.replace(low, force_level=1.0)])
    assert np.array_equal(alone.frequency, together.frequency)
    other = dataclasses.replace(modal(LINES * 1.2), frequency=LINES, force_level=1.0)
    selection = low.around_resonances(together=[other])
    for natural in (*NATURAL, *(NATURAL / 1.2)):
        assert np.abs(selection.frequency - natural).min() < 0.5
    assert np.abs(alone.frequency - 260 / 1.2).min() > 10
    for run in (low, other):
        assert run.lines(selection.frequency).frequency.size == selection.frequency.size


def test_runs_on_other_lines_are_refused():
    with pytest.raises(ValueError, match=r"the same lines are needed.*run\.lines\(frequency\)"):
        modal().thinned(50, together=[modal(LINES[:-1])])


@pytest.mark.parametrize("most", [1, 2, 40, 400])
def test_thinning_keeps_as_many_lines_as_asked_for(most):
    thin = modal().thinned(most)
    assert thin.frequency.size == most
    assert np.isin(thin.frequency, LINES).all()
    assert np.all(np.diff(thin.frequency) > 0)


def test_a_measurement_with_fewer_lines_stays_as_it_is():
    data = modal()
    assert np.array_equal(data.thinned(10**6).frequency, data.frequency)


@pytest.mark.parametrize("most", [0, -3])
def test_no_line_is_no_measurement(most):
    with pytest.raises(ValueError, match=r"thinned was given most=.*above 0 is needed"):
        modal().thinned(most)


def fisher(measurement):
    """Information on natural frequencies and damping ratios of the four modes, exactly."""

    def response(unknown, lines):
        natural = 2 * np.pi * unknown[:4, None]
        omega = 2 * np.pi * lines
        loss = 2j * unknown[4:, None] * natural * omega
        return (1j * omega / (natural**2 - omega**2 + loss)).sum(axis=0) * 100

    unknown = np.concatenate([NATURAL, np.full(4, DAMPING)])
    slopes = jax.jacfwd(lambda x: response(x, measurement.frequency))(unknown)
    deviation = 0.01 * np.abs(response(unknown, measurement.frequency))
    scaled = np.asarray(slopes) * unknown / deviation[:, None]
    return np.real(scaled.conj().T @ scaled)


def test_thinned_lines_keep_more_information_than_even_ones():
    data = modal(noise=0.01)
    thin, even = data.thinned(100), data.lines(LINES[20::40])
    assert abs(even.frequency.size - 100) <= 1

    def worst(chosen):
        return np.sqrt(np.diag(np.linalg.inv(fisher(chosen)))).max()

    assert worst(thin) < 0.6 * worst(even)
    assert worst(thin) < 4 * worst(data)  # a 40th of the lines has 6.3 times the deviation


def test_thinning_leaves_no_stretch_without_lines():
    thin = modal(noise=1e-4).thinned(100)
    assert np.diff(thin.frequency).max() < 400 / (0.3 * 100) * 1.5


def test_noisy_channels_do_not_decide_where_lines_are_thinned():
    data = modal(noise=0.01)
    frf, coherence = np.array(data.frf), np.array(data.coherence)
    random = np.random.default_rng(1)
    quiet = LINES < 200
    frf[2, 0, quiet] = 100 * random.standard_normal(quiet.sum())
    coherence[2, 0, quiet] = 1e-4
    noisy = dataclasses.replace(data, frf=frf, coherence=coherence)
    share = np.mean(noisy.thinned(200).frequency < 200)
    assert share == pytest.approx(np.mean(data.thinned(200).frequency < 200), abs=0.1)


def test_the_choice_serves_an_experiment():
    modes = bp.beams.bar(6, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    data = modal().thinned(30)
    experiment = bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(0.01)),
        sensors=[bp.Sensor(name, at=0.2) for name in ("s1", "s2", "s3")],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=data.frequency,
        observe=bp.observe.Complex("velocity"),
        noise=bp.noise.FromCoherence(),
    )
    assert experiment.data(modal()).z.shape[-1] == 30


def test_the_noise_of_lines_is_what_the_measurement_states_best():
    measured = modal(LINES[::50])
    by_coherence = noise_variance(measured)
    stated = np.full_like(by_coherence, 2.0)
    stated[1] = np.nan
    known = noise_variance(dataclasses.replace(measured, variance=stated))
    np.testing.assert_array_equal(known[[0, 2]], 2.0)
    np.testing.assert_array_equal(known[1], by_coherence[1])
