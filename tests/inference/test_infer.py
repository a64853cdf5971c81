"""Results have one layout for every method, are reproducible and hold diagnostics."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared import compiled as _compiled
from models import bar

GROUPS = {
    "posterior",
    "sample_stats",
    "log_likelihood",
    "log_prior",
    "posterior_predictive",
    "observed_data",
    "constant_data",
    "prior",
    "estimates",
}
SMALL = {
    "importance": (bp.engines.Importance(draws=60), bp.marginals.KDE(placement_draws=50)),
    "grid": (bp.engines.Grid(nodes=12), bp.marginals.Quadrature(nodes=16)),
    "map": (bp.engines.MAP(starts=2, draws=50), bp.marginals.Latent()),
    "nuts": (bp.engines.NUTS(chains=2, warmup=30, draws=30), bp.marginals.Latent()),
    "smc": (bp.engines.SMC(particles=80, populations=2, moves=3), bp.marginals.Latent()),
}
pytestmark = pytest.mark.filterwarnings("ignore::bayes_placement.inference.infer.InferenceWarning")


def experiment_and_measurement(noise=0.05):
    experiment = bar.placed(0.25, 0.30, bp.noise.Gaussian(noise))
    return experiment, experiment.nominal_measurement()


LONG_ONES = {
    "grid": [pytest.mark.long, pytest.mark.longest],
    "nuts": [pytest.mark.long],
    "smc": [pytest.mark.long],
}


def methods(*names):
    return [pytest.param(name, marks=LONG_ONES.get(name, [])) for name in names]


@pytest.fixture(scope="module", params=methods(*SMALL))
def small(request):
    """A tiny run of each method."""
    engine, marginal = SMALL[request.param]
    return bp.infer(*experiment_and_measurement(), engine=engine, marginal=marginal, key=3)


def test_the_layout_is_the_same_for_every_method(small):
    assert set(small.children) >= GROUPS
    unknowns = {unknown.name for unknown in experiment_and_measurement()[0].unknowns}
    assert set(small["posterior"].data_vars) == unknowns == set(small["prior"].data_vars)
    assert small["posterior"]["sensor.s1.position"].attrs == {
        "units": "m",
        "role": "placement",
        "owner": "sensor s1",
        "field": "position",
        "component": "",
    }
    measured = small["posterior_predictive"]["measured"]
    assert measured.dims == ("chain", "draw", "sensor", "actuator", "frequency")
    assert small["log_likelihood"]["measured"].dims == measured.dims
    assert list(small["estimates"]["unknown"].values) == list(small["posterior"].data_vars)
    assert np.all(np.isfinite(small["estimates"]["mean"]))


def test_the_record_tells_how_to_run_it_again(small):
    assert small.attrs["seed"] == 3
    assert {"engine", "marginal", "experiment", "seconds", "version_jax"} <= set(small.attrs)


def test_draws_lie_within_their_priors(small):
    ratio = small["posterior"]["structure.damping.ratio.1"]
    position = small["posterior"]["sensor.s1.position"]
    assert 0.02 <= ratio.min() <= ratio.max() <= 0.06
    assert 0.21 <= position.min() <= position.max() <= 0.29


@pytest.mark.parametrize("name", methods("importance", "smc"))
def test_a_seed_gives_the_same_result_bit_for_bit(name):
    engine, marginal = SMALL[name]
    first, again = (
        bp.infer(*experiment_and_measurement(), engine=engine, marginal=marginal, key=key)
        for key in (3, np.int64(3))
    )
    for group in GROUPS:
        assert first[group].to_dataset().identical(again[group].to_dataset()), group


@pytest.mark.long
@pytest.mark.parametrize(
    "engine", [bp.engines.SMC(), pytest.param(bp.engines.NUTS(), marks=pytest.mark.longest)]
)
def test_methods_agree_on_the_bar(engine):
    # The one full-sized run of each sampler; the other rows are in tests/benchmarks.
    experiment = bar.placed(0.25, 0.25, bp.noise.Gaussian(0.01))
    measurement = experiment.nominal_measurement()
    expected = {"structure.damping.ratio.1": (0.039385, 0.15373)}
    expected["structure.damping.ratio.2"] = (0.039983, 0.03240)
    result = bp.infer(experiment, measurement, engine=engine, key=2)
    estimates = result["estimates"].to_dataset()
    for name, (mean, variation) in expected.items():
        estimate = estimates.sel(unknown=name)
        assert abs(estimate["mean"] - mean) < 5 * estimate["mean_error"]
        assert abs(estimate["cv"] - variation) < 5 * estimate["cv_error"]
    assert abs(estimates["kl_parameters"] - 2.4862) < 0.1
    if isinstance(engine, bp.engines.SMC):
        assert abs(estimates["log_evidence"] - 28.9118) < 0.1
    else:
        assert np.max(estimates["r_hat"]) < 1.01


@pytest.mark.long
def test_an_unknown_noise_level_is_found():
    lines = np.linspace(20.0, 430.0, 42)
    noise = bp.noise.Gaussian(dist.LogUniform(1e-3, 1.0))
    experiment = bar.placed(0.25, 0.30, noise, frequency=lines)
    frf = np.asarray(experiment.nominal().frf())
    errors = np.random.default_rng(0).normal(0.0, 0.05, frf.shape)
    measurement = bp.Measurement.from_arrays(
        frf * 10**errors, lines, sensors=["s1"], actuators=["a1"], quantity="mobility"
    )
    posterior = bp.infer(experiment, measurement, engine=bp.engines.SMC(particles=1000), key=1)
    # 42 data less some four unknowns tell a level to about 1 / sqrt(2 * 38) = 11 %.
    sigma = np.log(posterior["posterior"]["noise.sigma"])
    assert abs(float(sigma.mean()) - np.log(0.05)) < 3 * float(sigma.std())
    assert 0.08 < float(sigma.std()) < 0.16


@pytest.mark.long
@pytest.mark.longest
def test_complex_responses_tell_the_sign_of_the_modes():
    experiment = bp.Experiment(
        bar.bar(),
        sensors=[bp.Sensor("s1", at=bp.positions.Segment(0.25, within=0.04))],
        actuators=[bp.Actuator("a1", at=0.30)],
        frequency=bar.PAPER_LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
    )
    frf = np.asarray(experiment.fix(
        {**{f"structure.damping.ratio.{n}": r for n, r in ((1, 0.03), (2, 0.05))},
         "sensor.s1.position": 0.27}
    ).frf())  # fmt: skip
    measurement = bp.Measurement.from_arrays(
        frf,
        bar.PAPER_LINES,
        sensors=["s1"],
        actuators=["a1"],
        quantity="accelerance",
        coherence=np.full(frf.shape, 0.99),
        averages=20,
    )
    result = bp.infer(experiment, measurement, engine=bp.engines.SMC(particles=1000), key=1)
    estimates = result["estimates"].to_dataset()
    truth = [0.03, 0.05, 0.27]
    error = np.abs(estimates["mean"] - truth)
    assert np.all(error < 3 * estimates["sd"] + 5 * estimates["mean_error"])
    assert np.all(estimates["sd"].values < [2e-3, 2e-3, 2e-3])
    assert result["observed_data"]["measured"].dims == ("sensor", "actuator", "part", "frequency")


def test_nothing_unknown_is_an_error():
    experiment, measurement = experiment_and_measurement()
    with pytest.raises(ValueError, match="Nothing in this experiment is unknown"):
        bp.infer(experiment.nominal(), measurement)


def test_a_line_that_was_not_measured_is_an_error():
    experiment, measurement = experiment_and_measurement()
    with pytest.raises(ValueError, match="not measured"):
        bp.infer(experiment, measurement.band(0.0, 300.0))


def test_sampling_without_noise_is_an_error():
    experiment = bar.placed(0.25, 0.30, None)
    with pytest.raises(ValueError, match="noise=None, so no measured value has a density"):
        bp.infer(experiment, experiment.nominal_measurement())


@pytest.mark.long
def test_lines_of_several_force_levels_are_told_apart():
    experiment = bar.placed(0.25, 0.30, bp.noise.Gaussian(0.05))
    experiment = bp.Experiment(
        experiment.structure,
        sensors=[*experiment.sensor.values()],
        actuators=[*experiment.actuator.values()],
        frequency=experiment.frequency,
        observe=experiment.observe,
        noise=experiment.noise,
        force_levels=[1.0, 3.0],
    )
    engine = bp.engines.Importance(draws=60)
    result = bp.infer(experiment, experiment.nominal_measurement(), engine=engine)
    observed = result["observed_data"]["measured"]
    np.testing.assert_array_equal(observed["frequency"], bar.PAPER_LINES)
    np.testing.assert_array_equal(observed["force_level"], [1.0, 3.0])
    assert observed["force_level"].attrs == {"units": "N"}
    assert observed.dims == ("sensor", "actuator", "force_level", "frequency")
    np.testing.assert_array_equal(observed.values[:, :, 0], observed.values[:, :, 1])


@pytest.mark.parametrize(
    ("noise", "known"),
    [
        (bp.noise.Gaussian(0.05), True),
        (bp.noise.Gaussian(dist.LogUniform(0.01, 0.1)), False),
        (bp.noise.FromCoherence(2.0), True),
        (bp.noise.FromCoherence(dist.LogUniform(0.5, 2.0)), False),
    ],
)
def test_a_known_deviation_is_on_record(noise, known):
    data = bar.experiment.data(bar.measurement)
    deviation = noise.deviation(data)
    assert (deviation is not None) == known
    if isinstance(noise, bp.noise.Gaussian) and known:
        np.testing.assert_array_equal(deviation, np.full(data.z.shape, 0.05))
    elif known:
        np.testing.assert_allclose(deviation, 2 * data.deviation, rtol=1e-14)


def test_the_deviation_is_observed(small):
    np.testing.assert_array_equal(small["constant_data"]["deviation"].values, 0.05)


@pytest.mark.parametrize("name", methods("importance", *LONG_ONES))
def test_other_numbers_are_not_compiled_again(name, monkeypatch):
    engine, marginal = SMALL[name]
    bp.infer(*experiment_and_measurement(), engine=engine, marginal=marginal)
    before = _compiled._jitted.cache_info().misses
    traced = []
    monkeypatch.setattr(bp.Experiment, "predict", lambda *_: traced.append(1))
    bp.infer(*experiment_and_measurement(noise=0.06), engine=engine, marginal=marginal)
    assert not traced and _compiled._jitted.cache_info().misses == before


@pytest.mark.parametrize(
    ("words", "attributes"),
    [({"engine": "map"}, ("MAP", "Latent")), ({"marginal": "enumeration"}, None)],
)
def test_engines_and_marginals_are_called_by_their_names(words, attributes):
    experiment, measurement = experiment_and_measurement()
    if attributes is None:
        with pytest.raises(ValueError, match=r"none is unknown\. Declare one"):
            bp.infer(experiment, measurement, **words)
        return
    posterior = bp.infer(experiment, measurement, **words)
    assert (posterior.attrs["engine"], posterior.attrs["marginal"]) == attributes


@pytest.mark.parametrize("words", [{"engine": "guess"}, {"marginal": "guess"}])
def test_another_name_is_an_error_that_lists_them(words):
    known = {"engine": "grid, importance, map, nuts, smc", "marginal": "enumeration, kde"}
    (kind,) = words
    with pytest.raises(ValueError, match=f"'guess' was given, .* the {kind}s: {known[kind]}"):
        bp.infer(*experiment_and_measurement(), **words)
