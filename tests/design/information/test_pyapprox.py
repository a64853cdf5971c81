"""Expected information gain compared with PyApprox: its cantilever, and a beam of ours.

Its benchmark `build_cantilever_beam_oed_benchmark` is a plane elastic cantilever by finite elements
under two unknown loads of standard normal law; five deflections along it may be measured, with an
error of 0.01. It states the expected gain of any of them in closed form. Our nested Monte Carlo is
given its deflections and must find the same.

Our own cantilever has an unknown Young's modulus and damping, on which responses depend
nonlinearly. PyApprox computes the expected gain of it by its own quadrature of the evidence
(`create_kl_oed_objective`) from our responses at its points; our map must find the same.
"""

import jax
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import information
from bayes_placement.design.information.estimator import jackknife_error
from tests.design.information.linear import linear_experiment

pytest.importorskip(
    "pyapprox_benchmarks",
    reason='the check against PyApprox needs pip install "pyapprox-benchmarks[fem]", and PyTorch',
)

ALL = (0, 1, 2, 3, 4)


@pytest.fixture(scope="module")
def backend():
    from pyapprox.util.backends.numpy import NumpyBkd

    return NumpyBkd()


@pytest.fixture(scope="module")
def published(backend):
    from pyapprox_benchmarks.expdesign.cantilever_beam import build_cantilever_beam_oed_benchmark

    return build_cantilever_beam_oed_benchmark(backend)


def estimated(estimator, experiment):
    plan = estimator.plan(experiment, 0)
    gain = jax.jit(lambda: plan(experiment, experiment.nominal_values()))()
    return float(gain.estimate), float(jackknife_error(np.asarray(gain.jackknife)))


@pytest.mark.parametrize("measured", [(0,), (4,), (0, 4), ALL])
def test_the_published_cantilever(published, measured):
    chosen = list(measured)
    weights = np.zeros((len(ALL), 1))
    weights[chosen] = 1.0
    truth = published.exact_eig(weights)
    forms = np.asarray(published.design_matrix())[chosen].T
    experiment = linear_experiment(forms, np.ones(2), published.noise_std())
    estimator = information.ExpectedGain(
        draws=2**18, placement_draws=1, data_draws=256, replicates=8
    )
    learnt, error = estimated(estimator, experiment)
    assert error < 0.03
    assert abs(learnt - truth) < 3 * error


LAWS = {
    "structure.modes.youngs_modulus": (70e9, 2e9),
    "structure.damping.ratio": (0.02, 0.003),
}
PLACES, SIGMA = np.array([0.45, 0.8, 1.0]), 0.05


def cantilever(place):
    """Our beam, read at a place."""
    section = {"length": 1.0, "area": 1e-3, "density": 2700.0, "second_moment": 2e-8}
    youngs_modulus, ratio = (dist.Normal(*moments) for moments in LAWS.values())
    beam = bp.beams.beam(6, **section, youngs_modulus=youngs_modulus, ends="fixed-free")
    return bp.Experiment(
        bp.Structure(beam, damping=bp.damping.Modal(ratio)),
        sensors=[bp.Sensor("s1", at=place)],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=np.array([10.0, 18.0, 70.0, 85.0, 110.0, 118.0]),
        observe=bp.observe.LogAmplitude("velocity"),
        noise=bp.noise.Gaussian(SIGMA),
    )


def by_pyapprox(experiment, backend, seeds=8):
    """Expected gain and its standard error."""
    from pyapprox.expdesign import create_kl_oed_objective
    from pyapprox.interface.functions.fromcallable.function import FunctionFromCallable
    from pyapprox.probability.joint.independent import IndependentJoint
    from pyapprox.probability.univariate.gaussian import GaussianMarginal

    outputs = experiment.frequency.size

    @jax.jit
    def responses(samples):
        def response(values):
            return experiment.fix(dict(zip(LAWS, values, strict=True))).predict().ravel()

        return jax.vmap(response, in_axes=1, out_axes=1)(samples)

    def respond(samples):
        return np.asarray(responses(samples))

    prior = IndependentJoint(
        [GaussianMarginal(*moments, backend) for moments in LAWS.values()], backend
    )
    gains = []
    for seed in range(seeds):
        objective = create_kl_oed_objective(
            prior,
            FunctionFromCallable(outputs, len(LAWS), respond, backend),
            np.full(outputs, SIGMA**2),
            backend,
            outer_sampler_type="mc",
            nouter_approx=1000,
            ninner_approx=2500,
            outer_seed=seed,
        )
        gains.append(objective.expected_information_gain(np.ones((outputs, 1))))
    return np.mean(gains), np.std(gains, ddof=1) / np.sqrt(seeds)


def test_a_cantilever_of_ours(backend):
    estimator = information.ExpectedGain(
        draws=2048, placement_draws=1, data_draws=1024, replicates=8
    )
    learnt = bp.information_map(cantilever(1.0), {"s1": PLACES}, estimator=estimator)
    for place in PLACES:
        ours = learnt.sel(s1=place)
        theirs, error = by_pyapprox(cantilever(place), backend)
        assert theirs > 0.5 and error < 0.03 and float(ours["information_gain_se"]) < 0.03
        assert abs(float(ours["information_gain"]) - theirs) < 3 * np.hypot(
            float(ours["information_gain_se"]), error
        )
    assert float(learnt["information_gain"].max()) > float(learnt["information_gain"].min()) + 0.3
