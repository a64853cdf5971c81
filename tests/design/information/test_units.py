"""Receptances of 1e-30 and 1e30, and more outputs than Sobol points have."""

import jax
import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement import information
from bayes_placement.design.information import _sampling
from models import bar
from tests.design.information.linear import linear_experiment

SMALL = information.KernelGain(draws=64, placement_draws=50)
PLACES = {"s1": [0.2, 0.25, 0.4]}
OBSERVATIONS = {
    "amplitudes": bp.observe.LogAmplitude("velocity"),
    "complex": bp.observe.Complex("displacement"),
}


def learnt(observe, sigma, unit):
    """Map of the bar in a unit of force in which receptances are so many times as large."""
    size = {"length": 1.0, "area": 1e-3, "ends": "fixed-fixed"}
    modes = bp.beams.bar(5, youngs_modulus=1e9 / unit, density=9000.0 / unit, **size)
    base = bar.placed(0.3, 0.3, None)
    experiment = bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal([bar.PRIOR, 0.04])),
        sensors=list(base.sensor.values()),
        actuators=list(base.actuator.values()),
        frequency=base.frequency,
        observe=observe,
        noise=bp.noise.Gaussian(sigma),
    )
    return bp.information_map(experiment, PLACES, estimator=SMALL)["information_gain"].values


@pytest.mark.parametrize("unit", [1e-20, 1e20])
@pytest.mark.parametrize("kind", OBSERVATIONS)
def test_information_does_not_depend_on_the_unit(kind, unit):
    observe = OBSERVATIONS[kind]
    sigma = 0.02 if kind == "amplitudes" else 1e-9
    plain = learnt(observe, sigma, 1.0)
    assert plain.min() > 0.04 and np.ptp(plain) > 0.05
    scaled = learnt(observe, sigma * (unit if kind == "complex" else 1.0), unit)
    np.testing.assert_allclose(scaled, plain, rtol=1e-4)


def test_sobol_points_go_on_as_independent_draws():
    scores = _sampling.scores("sobol", 1, 8, 21_203, 0)
    assert scores.shape == (1, 8, 21_203) and np.isfinite(scores).all()
    coarse = _sampling.scores("sobol", 1, 8, 21_201, 0)
    np.testing.assert_array_equal(scores[..., :21_201], coarse)
    further = scores[..., 21_201:]
    assert len(np.unique(further)) == further.size and 0.3 < further.std() < 2


@pytest.mark.long
@pytest.mark.longest
def test_more_outputs_than_sobol_points_have_coordinates():
    """The lines beyond the first three tell nothing, so the gain is that of three."""
    forms = np.zeros((2, 10_700))  # two parts each
    forms[:, :3] = [[1.0, 0.4, -0.3], [0.2, 0.9, 0.5]]
    scales, sigma = np.array([0.7, 1.5]), 0.4
    experiment = linear_experiment(forms, scales, sigma)
    estimator = information.ExpectedGain(draws=128, placement_draws=1, data_draws=64, replicates=2)
    plan = estimator.plan(experiment, 0)
    gain = jax.jit(lambda: plan(experiment, experiment.nominal_values()))()
    slopes = (scales[:, None] * forms[:, :3]).T / sigma
    truth = 0.5 * np.linalg.slogdet(np.eye(3) + slopes @ slopes.T)[1]
    assert float(gain.estimate) == pytest.approx(truth, abs=0.3)
