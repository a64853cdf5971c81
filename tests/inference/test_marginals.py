"""Integrals over the placement compared with each other, brute force and sampling."""

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.special import logsumexp
from scipy.stats import gaussian_kde, norm

import bayes_placement as bp
from bayes_placement._shared.sites import substitute
from bayes_placement.inference import unconstrained
from bayes_placement.inference.infer import InferenceWarning
from bayes_placement.inference.marginals import kde
from models import bar

KEY = jax.random.PRNGKey(4)
RATIOS = {"structure.damping.ratio.1": 0.031, "structure.damping.ratio.2": 0.048}


def two_sensors(noise, within=0.03):
    """Return an experiment without any symmetry, every position of which is unknown."""
    place = bp.positions.Segment
    return bp.Experiment(
        bar.bar(),
        sensors=[
            bp.Sensor("s1", at=place(0.22, within=within)),
            bp.Sensor("s2", at=place(0.61, within=within)),
        ],
        actuators=[bp.Actuator("a1", at=place(0.34, within=within))],
        frequency=np.array([60.0, 160.0, 300.0, 420.0]),
        observe=bp.observe.LogAmplitude("velocity"),
        noise=noise,
    )


def at_ratios(experiment):
    return substitute(experiment, RATIOS)


def log_likelihood(experiment, marginal, data):
    model = marginal.model(experiment, data, KEY)
    priors = {unknown.name: unknown.distribution for unknown in marginal.sampled(experiment)}
    target = unconstrained.UnconstrainedModel(model, priors)
    return float(jax.jit(lambda flat: target.log_likelihood(flat))(target.flatten(RATIOS)))


@pytest.fixture(scope="module")
def wide():
    """An experiment whose noise is wide enough for every method, and its data."""
    experiment = two_sensors(bp.noise.Gaussian(0.2))
    return experiment, experiment.data(experiment.nominal_measurement())


def brute_force(experiment, data, points):
    """Log of the integral over a full tensor of midpoints of all three positions."""
    priors = {
        unknown.name: unknown.distribution
        for unknown in experiment.unknowns
        if unknown.name.endswith("position")
    }
    steps = (np.arange(points) + 0.5) / points
    grids = np.meshgrid(
        *(prior.icdf(jnp.asarray(steps)) for prior in priors.values()), indexing="ij"
    )
    values = {name: jnp.asarray(grid.ravel()) for name, grid in zip(priors, grids, strict=True)}
    fixed = at_ratios(experiment)

    def term(places):
        concrete = substitute(fixed, places)
        return jnp.sum(concrete.noise.distribution(concrete.predict(), data).log_prob(data.z))

    terms = np.asarray(jax.jit(jax.vmap(term))(values))
    return logsumexp(terms) - np.log(terms.size)


def test_nested_quadrature_is_the_full_tensor(wide):
    experiment, data = wide
    nested = log_likelihood(experiment, bp.marginals.Quadrature(nodes=24), data)
    assert nested == pytest.approx(brute_force(experiment, data, 24), abs=2e-3)


def test_quadrature_converges_once_it_says_that_it_is_resolved(wide):
    experiment, data = wide
    coarse, fine = (
        log_likelihood(experiment, bp.marginals.Quadrature(nodes=n), data) for n in (12, 96)
    )
    assert coarse == pytest.approx(fine, abs=1e-6)


def test_kde_becomes_the_integral_where_noise_is_wide():
    # One place unknown, noise ten times the kernels: the estimate is a plain Monte Carlo average.
    experiment = bar.placed(0.25, 0.30, bp.noise.Gaussian(0.5))
    data = experiment.data(experiment.nominal_measurement())
    exact = log_likelihood(experiment, bp.marginals.Quadrature(nodes=48), data)
    for kernel in ("soize", "silverman"):
        marginal = bp.marginals.KDE(placement_draws=20_000, kernel=kernel)
        assert log_likelihood(experiment, marginal, data) == pytest.approx(exact, abs=0.02)


def test_noise_by_draws_agrees_with_the_closed_form():
    # Two lines: in ten dimensions hardly a draw of the noise lands near a kernel.
    experiment = bar.placed(0.25, 0.30, bp.noise.Gaussian(0.1), frequency=[100.0, 300.0])
    data = experiment.data(experiment.nominal_measurement())
    closed = log_likelihood(experiment, bp.marginals.KDE(placement_draws=200), data)
    by_draws = bp.marginals.KDE(placement_draws=200, noise_draws=20_000)
    assert log_likelihood(experiment, by_draws, data) == pytest.approx(closed, abs=0.03)


def kernels(density, experiment):
    """Outputs at the placements that were drawn, centres of their kernels, and variances."""

    def of_draws():
        places = density._placements(experiment)
        outputs = jax.vmap(lambda v: substitute(experiment, v).predict())(places)
        return outputs, *density._kernels(experiment, places)

    return [np.asarray(values) for values in jax.jit(of_draws)()]


def test_variances_of_kernel_and_noise_add():
    sigma = 0.02
    experiment = bar.placed(0.25, 0.30, bp.noise.Gaussian(sigma), frequency=[100.0, 300.0])
    data = experiment.data(experiment.nominal_measurement())
    density = kde.KernelDensity(data, KEY, 20)
    placed = at_ratios(experiment)
    _, centres, variance = kernels(density, placed)
    # Neither variance is negligible.
    assert np.all((variance > sigma**2 / 4) & (variance < 4 * sigma**2))
    terms = norm.logpdf(data.z, centres, np.sqrt(variance + sigma**2)).reshape(20, -1).sum(axis=1)
    exact = logsumexp(terms) - np.log(20)
    seen = jax.jit(lambda: density.log_likelihood(placed))()
    assert float(seen) == pytest.approx(exact, rel=1e-9)


def test_the_width_of_kernels_is_that_of_scipy():
    draws = np.random.default_rng(0).standard_normal((3, 50))
    expected = gaussian_kde(draws, "silverman").factor
    assert kde.silverman_width(50, 3) == pytest.approx(expected, rel=1e-12)


def test_soize_kernels_keep_mean_and_variance_of_the_draws():
    experiment = at_ratios(bar.placed(0.25, 0.30, None))
    data = experiment.data(experiment.nominal_measurement())
    for kernel, keeps in (("soize", True), ("silverman", False)):
        density = kde.KernelDensity(data, KEY, 400, kernel, None, True)
        z, centres, variance = kernels(density, experiment)
        smoothed = np.var(centres, axis=0) + variance
        np.testing.assert_allclose(np.mean(centres, axis=0), np.mean(z, axis=0))
        assert np.allclose(smoothed, np.var(z, axis=0, ddof=1) * 399 / 400, rtol=1e-2) is keeps or (
            keeps and np.allclose(smoothed, np.var(z, axis=0, ddof=1), rtol=1e-2)
        )


def test_a_kernel_estimate_is_a_density_in_one_dimension():
    experiment = at_ratios(bar.placed(0.25, 0.30, None, frequency=[150.0]))
    grid = np.linspace(-6.0, 0.0, 4001)
    template = experiment.data(experiment.nominal_measurement())
    density = kde.KernelDensity(template, KEY, 300, "soize", None, True)
    _, centres, variance = kernels(density, experiment)
    values = norm.pdf(grid[:, None], np.ravel(centres), np.sqrt(np.ravel(variance))).mean(axis=1)
    assert np.trapezoid(values, grid) == pytest.approx(1.0, abs=1e-6)
    at_data = norm.pdf(float(template.z[0, 0, 0]), np.ravel(centres), np.sqrt(np.ravel(variance)))
    seen = jax.jit(lambda: density.log_likelihood(experiment))()
    assert float(seen) == pytest.approx(np.log(at_data.mean()))


def test_common_draws_make_the_likelihood_smooth_and_fresh_draws_do_not():
    experiment = bar.placed(0.25, 0.30, bp.noise.Gaussian(0.02))
    data = experiment.data(experiment.nominal_measurement())
    roughness = {}
    for common in (True, False):
        marginal = bp.marginals.KDE(placement_draws=100, common=common)
        priors = {unknown.name: unknown.distribution for unknown in marginal.sampled(experiment)}
        target = unconstrained.UnconstrainedModel(marginal.model(experiment, data, KEY), priors)
        line = jnp.stack([jnp.full(2, u) for u in np.linspace(-0.01, 0.01, 21)])
        values = np.asarray(jax.jit(jax.vmap(target.log_likelihood))(line))
        np.testing.assert_array_equal(values, jax.jit(jax.vmap(target.log_likelihood))(line))
        roughness[common] = np.std(np.diff(values, 2))
    assert roughness[True] < 1e-3 * roughness[False]


@pytest.mark.long
def test_placements_drawn_back_follow_the_latent_posterior():
    experiment = at_ratios(two_sensors(bp.noise.Gaussian(0.02)))
    measurement = experiment.nominal_measurement()
    data = experiment.data(measurement)
    marginal = bp.marginals.Quadrature(nodes=64)
    resolve = jax.jit(
        jax.vmap(lambda key: marginal.placement(experiment, data, key)(experiment, key))
    )
    drawn, _ = resolve(jax.random.split(KEY, 4000))
    latent = bp.infer(experiment, measurement, engine=bp.engines.SMC(particles=1000))["estimates"]
    for name, values in drawn.items():
        estimate = latent.sel(unknown=name)
        error = np.hypot(estimate["mean_error"], np.std(values) / np.sqrt(4000))
        assert abs(np.mean(values) - estimate["mean"]) < 5 * error
        error = np.hypot(estimate["sd_error"], estimate["sd"] / 90)
        assert abs(np.std(values) - estimate["sd"]) < 5 * error


def test_correlated_noise_can_be_integrated_over_placement():
    lines = 4
    matrix = 0.04 * (0.5 ** np.abs(np.subtract.outer(np.arange(lines), np.arange(lines))))
    experiment = two_sensors(bp.noise.Covariance(matrix))
    data = experiment.data(experiment.nominal_measurement())
    nested = log_likelihood(experiment, bp.marginals.Quadrature(nodes=24), data)
    assert nested == pytest.approx(brute_force(experiment, data, 24), abs=2e-3)


@pytest.mark.long
def test_a_sensor_may_have_a_noise_level_of_its_own():
    levels = np.array([0.1, 0.3]).reshape(2, 1, 1)
    experiment = two_sensors(bp.noise.Gaussian(levels))
    data = experiment.data(experiment.nominal_measurement())
    nested = log_likelihood(experiment, bp.marginals.Quadrature(nodes=24), data)
    assert nested == pytest.approx(brute_force(experiment, data, 24), abs=2e-3)


@pytest.mark.long
def test_too_few_nodes_are_said():
    experiment = bar.placed(0.25, 0.30, bp.noise.Gaussian(0.003))
    measurement = experiment.nominal_measurement()
    options = {"engine": bp.engines.Grid(nodes=8), "marginal": bp.marginals.Quadrature(nodes=16)}
    with pytest.warns(InferenceWarning) as raised:
        bp.infer(experiment, measurement, **options)
    assert any("over the placement is not resolved" in str(warning.message) for warning in raised)


@pytest.mark.long
def test_kernels_wider_than_the_noise_are_said():
    experiment = bar.placed(0.25, 0.30, bp.noise.Gaussian(0.003))
    measurement = experiment.nominal_measurement()
    options = {
        "engine": bp.engines.Importance(draws=100),
        "marginal": bp.marginals.KDE(placement_draws=100),
    }
    with pytest.warns(InferenceWarning) as raised:
        bp.infer(experiment, measurement, **options)
    assert any("times as wide as the output error" in str(warning.message) for warning in raised)


def experiment_with(sensors, actuators, noise):
    return bp.Experiment(
        bar.bar(),
        sensors=sensors,
        actuators=actuators,
        frequency=[100.0],
        observe=bp.observe.LogAmplitude("velocity"),
        noise=noise,
    )


def model(marginal, experiment):
    return marginal.model(experiment, experiment.data(experiment.nominal_measurement()), KEY)


def test_quadrature_without_noise_is_an_error():
    with pytest.raises(ValueError, match=r"Quadrature integrates a density .* noise=None lacks"):
        model(bp.marginals.Quadrature(), bar.placed(0.25, 0.30, None))


def test_quadrature_over_many_positions_is_an_error():
    place = bp.positions.Segment
    setup = experiment_with(
        [bp.Sensor(f"s{n}", at=place(0.1 * n, within=0.04)) for n in (1, 2, 3)],
        [bp.Actuator(f"a{n}", at=place(0.2 * n, within=0.04)) for n in (1, 2, 3)],
        bp.noise.Gaussian(0.1),
    )
    with pytest.raises(ValueError, match=r"would compute 2e\+07 responses for each h"):
        model(bp.marginals.Quadrature(nodes=64), setup)


def test_quadrature_over_a_distribution_without_inverse_is_an_error():
    odd = experiment_with(
        [bp.Sensor("s1", at=dist.Beta(2.0, 3.0))],
        [bp.Actuator("a1", at=0.3)],
        bp.noise.Gaussian(0.1),
    )
    with pytest.raises(ValueError, match=r"inverse distribution function .* Beta lacks"):
        model(bp.marginals.Quadrature(), odd)


def test_kernels_without_unknown_placement_are_an_error():
    known = bar.placed(0.25, 0.30, bp.noise.Gaussian(0.1)).fix(
        {"sensor.s1.position": 0.25, "actuator.a1.position": 0.3}
    )
    with pytest.raises(ValueError, match="no position or angle is a distribution"):
        model(bp.marginals.KDE(), known)


def test_wrong_settings_of_kernels_are_errors():
    with pytest.raises(ValueError, match="has no kernel 'box'"):
        bp.marginals.KDE(kernel="box")
    with pytest.raises(ValueError, match="needs at least two draws"):
        bp.marginals.KDE(placement_draws=1)
