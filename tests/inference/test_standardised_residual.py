"""Residuals over their deviations have the likelihood of the noise, of every kind."""

import jax.numpy as jnp
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._compiled import compiled
from bayes_placement.inference.standardised_residual import standardised_residual
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


def _log_densities(known, data):
    """Of the standardised residuals, and of the noise."""
    residual, logs = standardised_residual(known, data, False)
    density = known.noise.distribution(known.predict(), data).log_prob(data.z)
    normal = -0.5 * jnp.sum(residual**2) - logs - 0.5 * data.z.size * jnp.log(2 * jnp.pi)
    return normal, jnp.sum(density)
