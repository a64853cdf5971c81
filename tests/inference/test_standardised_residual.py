"""Residuals over their deviations have the likelihood of the noise, of every kind."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement.inference.output_residuals import (
    LEAST_RATIO,
    LOGARITHMIC_ERROR,
    standardised_residual,
)
from tests.criticism import small

LINES = small.LINES.size
NEAR = 0.5 ** np.abs(np.subtract.outer(np.arange(LINES), np.arange(LINES)))


@pytest.mark.parametrize(
    "noise",
    [
        bp.noise.Gaussian(0.3),
        bp.noise.Gaussian(np.array([0.1, 0.3]).reshape(2, 1, 1, 1)),
        bp.noise.FromCoherence(1.7),
        bp.noise.Relative(0.02, 0.1),
        bp.noise.Covariance(0.04 * NEAR),
        bp.noise.Covariance(0.04 * NEAR, factor=1.3),
    ],
    ids=lambda noise: type(noise).__name__,
)
def test_the_likelihood_is_that_of_the_noise(noise):
    bar = small.experiment()
    experiment = bp.Experiment(
        bar.structure,
        sensors=[*bar.sensor.values()],
        actuators=[*bar.actuator.values()],
        frequency=small.LINES,
        observe=bar.observe,
        noise=noise,
    )
    data = experiment.data(small.measured())
    normal, density = compiled(_log_densities)(experiment.fix(small.TRUTH), data)
    np.testing.assert_allclose(normal, density, rtol=1e-9)


def test_a_logarithmic_residual_is_the_complex_logarithm_of_prediction_over_measurement():
    experiment = small.experiment().fix(small.TRUTH)
    measured = small.measured()
    turned = np.exp(1j * np.linspace(-3.1, 3.1, measured.frf.size)).reshape(measured.frf.shape)
    data = experiment.data(dataclasses.replace(measured, frf=3.0 * turned * measured.frf))
    residual, _ = compiled(standardised_residual)(experiment, data, True)
    expected = np.log(np.asarray(experiment.frf()) / (data.z[..., 0, :] + 1j * data.z[..., 1, :]))
    parts = np.stack([expected.real, expected.imag], axis=-2).ravel() / LOGARITHMIC_ERROR
    np.testing.assert_allclose(residual, parts, rtol=1e-9, atol=1e-12)
    assert np.ptp(expected.imag) > 5  # phases of all quadrants


def test_what_was_not_measured_or_is_not_predicted_has_a_finite_logarithmic_residual():
    experiment = small.experiment().fix(small.TRUTH)
    data = experiment.data(small.measured())
    z, is_measured = np.array(data.z), np.array(data.measured)
    z[0, ..., 3], is_measured[0, ..., 3] = 0.0, False
    z[1, ..., 5] = 1e40  # beside which the prediction vanishes
    arrays = jnp.asarray(z), jnp.asarray(is_measured)
    changed = eqx.tree_at(lambda tree: (tree.z, tree.measured), data, arrays)
    residual, _ = compiled(standardised_residual)(experiment, changed, True)
    shaped = np.asarray(residual).reshape(z.shape)
    assert np.all(shaped[0, ..., 3] == 0)
    least = [np.log(LEAST_RATIO) / LOGARITHMIC_ERROR, 0.0]
    np.testing.assert_allclose(shaped[1, ..., 5].reshape(-1, 2), [least], rtol=1e-12)


def _log_densities(known, data):
    """Of the standardised residuals, and of the noise."""
    residual, logs = standardised_residual(known, data, False)
    density = known.noise.distribution(known.predict(), data).log_prob(data.z)
    normal = -0.5 * jnp.sum(residual**2) - logs - 0.5 * data.z.size * jnp.log(2 * jnp.pi)
    return normal, jnp.sum(density)
