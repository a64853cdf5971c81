"""Relative noise: proportional to the measured amplitude, with a floor and a coherence."""

import functools

import jax
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy import stats

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.errors import InputError
from bayes_placement.criticism.missing._hypotheses import null_hypothesis
from bayes_placement.design.next_measurement import planned
from bayes_placement.experiment.observation import measured_outputs

BEAM = bp.beams.beam(
    4, length=1.0, area=1e-3, second_moment=1e-8, youngs_modulus=7e10, density=2700.0
)
LINES = np.linspace(5.0, 200.0, 60)


def experiment(noise, observe=None, ratio=0.02):
    return bp.Experiment(
        bp.Structure(BEAM, damping=bp.damping.Modal(ratio)),
        sensors=[bp.Sensor("s1", at=0.4), bp.Sensor("s2", at=0.9)],
        actuators=[bp.Actuator("a1", at=0.65)],
        frequency=LINES,
        observe=observe or bp.observe.Complex("acceleration"),
        noise=noise,
    )


@functools.cache
def exact_frf():
    return np.asarray(compiled(bp.Experiment.frf)(experiment(None)))


def with_error(ratio, floor, seed=0, **coherence):
    """What is measured with circular errors of E|error|^2 = (ratio |H|)^2 + floor^2."""
    frf = exact_frf()
    rng = np.random.default_rng(seed)
    size = np.hypot(ratio * np.abs(frf), floor) / np.sqrt(2)
    error = rng.standard_normal(frf.shape) + 1j * rng.standard_normal(frf.shape)
    return bp.Measurement.from_arrays(
        frf + size * error,
        LINES,
        sensors=["s1", "s2"],
        actuators=["a1"],
        quantity="accelerance",
        **coherence,
    )


def test_each_part_has_half_of_the_error():
    setup = experiment(bp.noise.Relative(0.03, 0.2))
    measured = with_error(0.03, 0.2)
    size = np.hypot(0.03 * np.abs(measured.frf), 0.2) / np.sqrt(2)
    data = setup.data(measured)
    np.testing.assert_allclose(setup.noise.deviation(data), np.stack([size, size], -2), rtol=1e-12)
    predicted = compiled(bp.Experiment.predict)(setup)
    density = setup.noise.distribution(predicted, data).log_prob(data.z)
    expected = stats.norm.logpdf(data.z, predicted, np.stack([size, size], -2))
    np.testing.assert_allclose(density, expected, rtol=1e-9)


def test_a_logarithm_feels_the_part_along_the_frf():
    # Against many draws of a circular error small enough that log10 |H| is linear in it.
    setup = experiment(bp.noise.Relative(1e-3, 1e-3), bp.observe.LogAmplitude("acceleration"))
    frf = np.asarray(compiled(bp.Experiment.frf)(setup))
    draws = [setup.data(with_error(1e-3, 1e-3, seed)).z for seed in range(400)]
    expected = np.std(draws, axis=0)
    deviation = setup.noise.deviation(measured_outputs(setup.observe, frf, amplitude=True))
    assert np.mean(expected / deviation) == pytest.approx(1.0, abs=5 / np.sqrt(2 * 400 * frf.size))


def test_coherence_adds_to_it():
    coherence = {"coherence": np.full((2, 1, 60), 0.9), "averages": 10}
    measured = with_error(0.03, 0.2, **coherence)
    combined = experiment(bp.noise.Relative(0.03, 0.2, coherence=1.5))
    alone = experiment(bp.noise.Relative(0.03, 0.2))
    stated = experiment(bp.noise.FromCoherence(1.5))
    deviations = [
        setup.noise.deviation(setup.data(measured)) for setup in (combined, alone, stated)
    ]
    np.testing.assert_allclose(deviations[0], np.hypot(*deviations[1:]), rtol=1e-12)


def test_the_level_does_not_depend_on_the_parameters():
    setup = experiment(bp.noise.Relative(0.03, 0.2), ratio=dist.Uniform(0.01, 0.05))
    data = setup.data(with_error(0.03, 0.2))
    predicted = [
        compiled(bp.Experiment.predict)(setup.fix({"structure.damping.ratio": ratio}))
        for ratio in (0.01, 0.05)
    ]
    scales = [setup.noise.distribution(outputs, data).variance for outputs in predicted]
    np.testing.assert_array_equal(*scales)


def test_ratio_floor_and_factor_may_be_unknown():
    prior = dist.LogUniform(1e-4, 1.0)
    setup = experiment(bp.noise.Relative(prior, prior, coherence=prior))
    names = ["noise.ratio", "noise.floor", "noise.coherence"]
    assert [unknown.name for unknown in setup.unknowns] == names
    measured = with_error(0.1, 0.1, coherence=np.full((2, 1, 60), 0.9), averages=10)
    assert setup.noise.deviation(setup.data(measured)) is None


@pytest.mark.parametrize(
    ("ratio", "floor"),
    [
        pytest.param(0.05, 0.5, marks=[pytest.mark.long, pytest.mark.longest]),
        pytest.param(0.01, 2.0, marks=pytest.mark.long),
    ],
)
def test_ratio_and_floor_are_found(ratio, floor):
    prior = dist.LogUniform(1e-3, 0.1), dist.LogUniform(1e-2, 1e2)
    setup = experiment(bp.noise.Relative(*prior))
    posterior = bp.infer(setup, with_error(ratio, floor), engine=bp.engines.SMC(particles=500))
    estimates = posterior["estimates"]
    truth = {"noise.ratio": ratio, "noise.floor": floor}
    for name, value in truth.items():
        estimate = estimates.sel(unknown=name)
        assert abs(float(estimate["mean"]) - value) < 3 * float(estimate["sd"]), name


def test_least_squares_find_the_most_probable_levels():
    # Without a parameter the best levels are those of the scatter about the model.
    setup = experiment(bp.noise.Relative(dist.LogUniform(1e-3, 1.0)))
    measured = with_error(0.05, 0.0)
    fit = null_hypothesis(setup, setup.data(measured))
    name = "noise.ratio"
    level = fit.problem.coordinates.named(fit.fit.point[None])[name][0]
    exact = np.asarray(compiled(bp.Experiment.frf)(setup))
    residual = np.abs(measured.frf - exact) / np.abs(measured.frf)
    assert level == pytest.approx(np.sqrt(np.mean(residual**2)), rel=5e-3)


def test_several_force_levels_and_channels_keep_their_levels():
    setup = experiment(bp.noise.Relative(0.03, 0.2))
    data = setup.data(with_error(0.03, 0.2))
    some = data.of(sensors=slice(1, 2))
    np.testing.assert_array_equal(setup.noise.deviation(some), setup.noise.deviation(data)[1:2])
    twice = bp.noise.Data.at_levels([data, data])
    again = setup.noise.deviation(twice)[:, :, 1]
    np.testing.assert_array_equal(again, setup.noise.deviation(data))


def test_a_simulation_takes_the_predicted_amplitude():
    setup = experiment(bp.noise.Relative(0.03, 0.2))
    drawn = bp.simulate(setup, draws=2000)["prior_predictive"]
    spread = (drawn["measured"] - drawn["response"]).std(["chain", "draw"])
    frf = np.asarray(compiled(bp.Experiment.frf)(setup))
    expected = np.hypot(0.03 * np.abs(frf), 0.2) / np.sqrt(2)
    error = np.asarray(spread) / np.stack([expected, expected], -2) - 1
    assert np.abs(error).max() < 5 / np.sqrt(2 * 2000)


def test_data_without_amplitudes_are_refused():
    setup = experiment(bp.noise.Relative(0.03))
    data = experiment(bp.noise.Gaussian(1.0)).data(with_error(0.03, 0.2))
    with pytest.raises(InputError, match=r"noise.Relative reads its level from the amplitude"):
        setup.noise.distribution(compiled(bp.Experiment.predict)(setup), data)


def test_data_without_coherence_are_refused():
    setup = experiment(bp.noise.Relative(0.03, coherence=1.0))
    with pytest.raises(ValueError, match="coherence"):
        setup.data(with_error(0.03, 0.2))
    data = experiment(bp.noise.Relative(0.03)).data(with_error(0.03, 0.2))
    with pytest.raises(InputError, match=r"noise.Relative\(coherence=\) reads a part"):
        setup.noise.distribution(compiled(bp.Experiment.predict)(setup), data)


@pytest.mark.parametrize(
    ("arguments", "options", "words"),
    [
        ((0.0,), {}, "a ratio of 0; the ratio must be positive"),
        ((0.1, -1.0), {}, "a floor of -1; the floor must not be negative"),
        ((0.1,), {"coherence": 0.0}, "a coherence factor of 0; the coherence factor must be pos"),
    ],
)
def test_levels_that_are_none_are_refused(arguments, options, words):
    with pytest.raises(InputError, match=words):
        bp.noise.Relative(*arguments, **options)


def test_planning_takes_the_level_of_an_earlier_measurement():
    setup = experiment(bp.noise.Relative(0.03))
    assert setup.noise.reads_measurement
    assert not setup.noise.reads_coherence
    later = planned(setup, with_error(0.03, 0.0))
    assert later.noise.sigma == pytest.approx(0.03 / np.sqrt(2) / np.log(10), rel=1e-6)


def test_the_noise_is_an_input_of_compiled_functions():
    leaves = jax.tree.leaves(bp.noise.Relative(0.03, 0.2))
    assert leaves == [0.03, 0.2]
