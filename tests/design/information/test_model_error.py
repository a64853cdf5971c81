"""Maps with a model error, which is drawn as the placement is, or refused."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import information
from bayes_placement._shared.errors import InfeasibleError
from bayes_placement.design.information._sampling import prior_knowledge
from models import bar

PLACES = {"s1": [0.25], "a1": [0.6]}
SMALL = information.KernelGain(draws=256, placement_draws=256)


def with_errors(size):
    only = bp.model_error.Embedded(
        frequency=size, damping=None, shape=None, gain=None, stiffness_and_mass=None
    )
    return bar.placed(0.3, 0.3, None).with_model_error(only)


def gain(experiment, estimator=SMALL, **settings):
    learnt = bp.information_map(experiment, PLACES, estimator=estimator, key=1, **settings)
    return float(learnt["information_gain"].squeeze()), float(
        learnt["information_gain_se"].squeeze()
    )


@pytest.mark.long
def test_errors_are_drawn_besides_the_placement_and_leave_less_to_learn():
    exact, error = gain(bar.placed(0.3, 0.3, None))
    small, _ = gain(with_errors(1e-7))
    large, _ = gain(with_errors(dist.LogUniform(0.05, 0.06)))
    assert small == pytest.approx(exact, abs=5 * error)
    assert large < exact - 5 * error


@pytest.mark.parametrize("estimator", [information.Exact(), information.ExpectedGain()])
def test_other_estimates_refuse_a_model_error(estimator):
    noisy = bar.placed(0.3, 0.3, bp.noise.Gaussian(0.05)).with_model_error(
        bp.model_error.Embedded()
    )
    with pytest.raises(InfeasibleError, match="draws the errors"):
        gain(noisy, estimator)


def test_errors_of_modes_stay_known_and_those_at_a_moved_sensor_do_not():
    experiment = bar.placed(0.3, 0.3, None).with_model_error(bp.model_error.Embedded())
    draws = {
        unknown.name: np.random.default_rng(0).standard_normal((50, *unknown.distribution.shape()))
        for unknown in experiment.unknowns
    }
    names = prior_knowledge(experiment, draws, ["s1"]).names
    assert "model_error.frequency.standard" in names
    assert "model_error.shape.standard.actuator.a1" in names
    assert "model_error.shape.standard.sensor.s1" not in names
