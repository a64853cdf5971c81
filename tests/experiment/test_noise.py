"""Distributions of the output error against those of SciPy, masks, and the kernel variance."""

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy import stats

from bayes_placement import noise
from bayes_placement._shared.sites import unknowns

GENERATOR = np.random.default_rng(12)
PREDICTED = GENERATOR.standard_normal((2, 3, 4))
PARTS = GENERATOR.standard_normal((2, 3, 2, 4))  # real and imaginary


def data_for(predicted, deviation=None, gaps=()):
    z = predicted + 0.3 * np.random.default_rng(2).standard_normal(predicted.shape)
    measured = np.ones(predicted.shape, dtype=bool)
    for pair in gaps:
        measured[pair] = False
    level = None if deviation is None else jnp.asarray(deviation)
    return noise.Data(jnp.asarray(np.where(measured, z, 0.0)), measured, level)


def log_density(error, predicted, data, kernel=0.0):
    density = jax.jit(lambda centre, z: error.distribution(centre, data, kernel).log_prob(z))
    return np.asarray(density(predicted, data.z))


@pytest.mark.parametrize(
    "sigma",
    [
        0.2,
        np.linspace(0.1, 0.4, 4),
        np.array([0.1, 0.3])[:, None, None],
        np.linspace(0.1, 0.5, 24).reshape(2, 3, 4),
    ],
    ids=["one", "per line", "per sensor", "each"],
)
def test_gaussian_errors_are_independent(sigma):
    data = data_for(PREDICTED)
    expected = stats.norm.logpdf(data.z, PREDICTED, np.broadcast_to(sigma, (2, 3, 4)))
    np.testing.assert_allclose(log_density(noise.Gaussian(sigma), PREDICTED, data), expected)


def test_both_parts_of_a_complex_frf_have_the_same_level():
    sigma = np.linspace(0.1, 0.5, 24).reshape(2, 3, 4)
    data = data_for(PARTS)
    expected = stats.norm.logpdf(data.z, PARTS, sigma[:, :, None, :])
    np.testing.assert_allclose(log_density(noise.Gaussian(sigma), PARTS, data), expected)


def test_a_level_for_each_part_is_kept_as_it_is():
    sigma = np.linspace(0.1, 0.5, 48).reshape(2, 3, 2, 4)
    data = data_for(PARTS)
    expected = stats.norm.logpdf(data.z, PARTS, sigma)
    np.testing.assert_allclose(log_density(noise.Gaussian(sigma), PARTS, data), expected)


@pytest.mark.parametrize(
    ("error", "names"),
    [
        (noise.Gaussian(dist.HalfNormal(0.1)), [("sigma", "unit of z")]),
        (noise.Covariance(np.eye(4), factor=dist.LogNormal(0.0, 1.0)), [("factor", "1")]),
        (noise.FromCoherence(dist.LogNormal(0.0, 0.5)), [("factor", "1")]),
        (noise.FromVariance(dist.LogNormal(0.0, 0.5)), [("factor", "1")]),
        (noise.Gaussian(0.1), []),
    ],
)
def test_an_unknown_level_is_an_unknown(error, names):
    assert [(unknown.name, unknown.unit) for unknown in unknowns(error)] == names


def covariance():
    lags = np.abs(np.subtract.outer(np.arange(4), np.arange(4)))
    return 0.09 * np.exp(-lags / 2.0) * np.outer([1, 2, 1, 3], [1, 2, 1, 3])


@pytest.mark.parametrize("predicted", [PREDICTED, PARTS], ids=["real", "complex"])
def test_covariance_is_a_joint_normal_distribution_along_the_lines(predicted):
    data = data_for(predicted)
    density = log_density(noise.Covariance(covariance(), factor=1.5), predicted, data)
    joint = stats.multivariate_normal(np.zeros(4), 1.5**2 * covariance())
    np.testing.assert_allclose(density, joint.logpdf(np.asarray(data.z) - predicted), rtol=1e-10)


def test_a_diagonal_covariance_is_gaussian():
    data = data_for(PREDICTED)
    joint = log_density(noise.Covariance(np.diag([0.01, 0.04, 0.09, 0.16])), PREDICTED, data)
    apart = log_density(noise.Gaussian(np.array([0.1, 0.2, 0.3, 0.4])), PREDICTED, data)
    np.testing.assert_allclose(joint, apart.sum(axis=-1), rtol=1e-12)


def test_covariance_refuses_missing_pairs():
    data = data_for(PREDICTED, gaps=[(1, 2)])
    with pytest.raises(ValueError, match=r"noise.Covariance needs every sensor measured"):
        noise.Covariance(covariance()).distribution(jnp.asarray(PREDICTED), data)


def test_from_coherence_takes_each_level_from_the_data():
    deviation = GENERATOR.uniform(0.1, 0.5, PREDICTED.shape)
    data = data_for(PREDICTED, deviation)
    density = log_density(noise.FromCoherence(2.0), PREDICTED, data)
    np.testing.assert_allclose(density, stats.norm.logpdf(data.z, PREDICTED, 2 * deviation))


@pytest.mark.parametrize("data", [None, data_for(PREDICTED)], ids=["simulation", "no coherence"])
def test_from_coherence_needs_coherence(data):
    with pytest.raises(ValueError, match=r"reads its level from the coherence and the averages"):
        noise.FromCoherence().distribution(jnp.asarray(PREDICTED), data)


@pytest.mark.parametrize("kind", [noise.FromVariance, noise.FromScatter])
def test_a_level_is_taken_from_the_data(kind):
    deviation = GENERATOR.uniform(0.1, 0.5, PREDICTED.shape)
    data = data_for(PREDICTED, deviation)
    error = kind(2.0)
    density = log_density(error, PREDICTED, data)
    np.testing.assert_allclose(density, stats.norm.logpdf(data.z, PREDICTED, 2 * deviation))
    np.testing.assert_allclose(error.deviation(data), 2 * deviation)
    assert kind(dist.LogUniform(0.5, 2.0)).deviation(data) is None


@pytest.mark.parametrize("data", [None, data_for(PREDICTED)], ids=["simulation", "no variance"])
@pytest.mark.parametrize(
    ("kind", "words"),
    [(noise.FromVariance, "variance that a measurement"), (noise.FromScatter, "scatter of lines")],
)
def test_a_level_that_is_not_in_the_data_is_asked_for(kind, words, data):
    with pytest.raises(ValueError, match=rf"reads its level from the {words}"):
        kind().distribution(jnp.asarray(PREDICTED), data)


def test_what_a_noise_reads_from_a_measurement():
    stated = noise.FromVariance()
    assert stated.reads_measurement and stated.reads_variance and not stated.reads_coherence
    assert noise.FromCoherence().reads_measurement and not noise.FromCoherence().reads_variance
    assert noise.FromScatter().reads_measurement and not noise.FromScatter().reads_variance
    assert not noise.Gaussian(0.1).reads_measurement


def test_only_from_coherence_reads_coherence():
    assert noise.FromCoherence().reads_coherence
    assert not noise.Gaussian(0.1).reads_coherence
    assert not noise.Covariance(np.eye(4)).reads_coherence


LEVEL = GENERATOR.uniform(0.1, 0.5, PREDICTED.shape)
KERNEL = GENERATOR.uniform(0.01, 0.2, PREDICTED.shape)


@pytest.mark.parametrize(
    "error", [noise.Gaussian(LEVEL), noise.FromCoherence(), noise.FromVariance()]
)
def test_a_kernel_adds_its_variance(error):
    data = data_for(PREDICTED, LEVEL)
    density = log_density(error, PREDICTED, data, jnp.asarray(KERNEL))
    expected = stats.norm.logpdf(data.z, PREDICTED, np.sqrt(LEVEL**2 + KERNEL))
    np.testing.assert_allclose(density, expected)


def test_a_kernel_adds_its_variance_to_a_covariance():
    data = data_for(PREDICTED)
    density = log_density(noise.Covariance(covariance()), PREDICTED, data, jnp.asarray(KERNEL))
    for pair in np.ndindex(2, 3):
        joint = stats.multivariate_normal(PREDICTED[pair], covariance() + np.diag(KERNEL[pair]))
        np.testing.assert_allclose(density[pair], joint.logpdf(data.z[pair]), rtol=1e-10)


@pytest.mark.parametrize(
    "error", [noise.Gaussian(LEVEL), noise.FromCoherence(), noise.FromVariance()]
)
def test_what_was_not_measured_has_no_density(error):
    gaps = [(0, 1), (1, 2)]
    data = data_for(PREDICTED, LEVEL, gaps)
    density = log_density(error, PREDICTED, data)
    complete = log_density(error, PREDICTED, data_for(PREDICTED, LEVEL))
    for pair in np.ndindex(2, 3):
        np.testing.assert_allclose(density[pair], 0.0 if pair in gaps else complete[pair])


def test_a_simulation_is_not_masked():
    distribution = noise.Gaussian(0.2).distribution(jnp.asarray(PREDICTED), None)
    assert isinstance(distribution, dist.Normal)
    np.testing.assert_array_equal(distribution.loc, PREDICTED)


def test_data_and_noise_of_some_channels_belong_together():
    data = data_for(PREDICTED, LEVEL, gaps=[(1, 0)])
    channels = {"sensors": slice(1, 2), "actuators": slice(0, 2)}
    chosen = data.of(**channels)
    np.testing.assert_array_equal(chosen.z, data.z[1:2, 0:2])
    np.testing.assert_array_equal(chosen.measured, data.measured[1:2, 0:2])
    np.testing.assert_array_equal(chosen.deviation, LEVEL[1:2, 0:2])
    for error in (noise.Gaussian(LEVEL), noise.Gaussian(0.3), noise.FromCoherence()):
        complete = log_density(error, PREDICTED, data)
        density = log_density(error.of(**channels), PREDICTED[1:2, 0:2], chosen)
        np.testing.assert_allclose(density, complete[1:2, 0:2])


def test_a_level_that_is_the_same_for_all_sensors_stays_so():
    error = noise.Gaussian(np.array([0.1, 0.2, 0.3])[None, :, None])
    chosen = error.of(sensors=slice(1, 2), actuators=slice(1, 2))
    np.testing.assert_array_equal(chosen.sigma, np.full((1, 1, 1), 0.2))


@pytest.mark.parametrize("sigma", [0.0, -0.1, float("nan"), 0])
def test_a_standard_deviation_must_be_positive(sigma):
    with pytest.raises(ValueError, match=r"the standard deviation must be positive.*marginals.KDE"):
        noise.Gaussian(sigma)


@pytest.mark.parametrize("value", [-0.1, 0.0, np.nan, np.inf, np.array([0.1, -0.2]), np.zeros(3)])
def test_noise_that_is_not_positive_is_refused(value):
    for kind, word in (
        (noise.Gaussian, "standard deviation"),
        (noise.FromCoherence, "factor"),
        (noise.FromVariance, "factor"),
        (noise.FromScatter, "factor"),
        (lambda factor: noise.Covariance(np.eye(4), factor), "factor"),
    ):
        with pytest.raises(ValueError, match=rf"was given a {word} of .*; the {word} must be pos"):
            kind(value)


@pytest.mark.parametrize("matrix", [-np.eye(3), np.ones((3, 3)), np.ones((2, 3))])
def test_a_covariance_without_a_density_is_refused(matrix):
    with pytest.raises(ValueError, match=r"matrix of shape \(.*\) that is not square and positive"):
        noise.Covariance(matrix)
