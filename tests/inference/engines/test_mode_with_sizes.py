"""Model error of unknown size: modes by the evidence, against a sampler of the joint posterior."""

import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.errors import InfeasibleError
from tests.criticism.small import LINES, TRUTH, experiment

SIZE = "model_error.frequency.size"
ERRORS = 0.01 * np.array([1.2, -0.7, 0.4, -1.5, 0.9])


def only_frequency(size):
    absent = dict.fromkeys(("damping", "shape", "gain", "stiffness_and_mass"))
    return bp.model_error.Embedded(frequency=size, **absent)


def measured(true, ratio=0.005):
    """Simulated FRFs with noise in proportion to their amplitude."""
    exact = np.asarray(compiled(bp.Experiment.frf)(true))
    parts = np.random.default_rng(1).standard_normal((2, *exact.shape))
    error = ratio * np.abs(exact) * (parts[0] + 1j * parts[1]) / np.sqrt(2)
    return bp.Measurement.from_arrays(
        exact + error,
        LINES,
        sensors=true.sensor_channels,
        actuators=true.actuator_channels,
        quantity="accelerance",
    )


@pytest.fixture(scope="module")
def case():
    """Natural frequencies off by 1 %, all else known, and the measurement."""
    noise = bp.noise.Relative(0.005)
    known = experiment().fix(TRUTH)
    known = bp.Experiment(
        known.structure,
        sensors=list(known.sensor.values()),
        actuators=list(known.actuator.values()),
        frequency=LINES,
        observe=known.observe,
        noise=noise,
    )
    true = known.with_model_error(only_frequency(1.0))
    true = true.fix({"model_error.frequency.standard": ERRORS})
    return known.with_model_error(only_frequency(dist.LogUniform(1e-5, 0.1))), measured(true)


@pytest.fixture(scope="module")
def by_map(case):
    return bp.infer(*case, engine=bp.engines.MAP(starts=8))


@pytest.mark.long
@pytest.mark.longest
def test_the_size_is_that_of_the_posterior_not_of_the_joint_mode(case, by_map):
    sampled = bp.infer(*case, engine=bp.engines.SMC(particles=1000, populations=2), key=3)
    size = sampled["posterior"][SIZE].values
    mode = float(by_map["estimates"]["mode"].sel(unknown=SIZE))
    assert np.mean(size < mode) == pytest.approx(0.5, abs=0.15)
    drawn = np.log(by_map["posterior"][SIZE].values)
    assert drawn.std() == pytest.approx(np.log(size).std(), rel=0.3)
    evidence = [float(tree["estimates"]["log_evidence"]) for tree in (sampled, by_map)]
    assert evidence[1] == pytest.approx(evidence[0], abs=1.0)


@pytest.mark.long
def test_draws_hold_the_product_of_error_and_size_that_the_data_determine(by_map):
    posterior = by_map["posterior"]
    errors = posterior["model_error.frequency.standard"].values * posterior[SIZE].values[..., None]
    deviation = errors.std((0, 1))
    assert np.all(np.abs(errors.mean((0, 1)) - ERRORS) < 4 * deviation)
    spread_of_sizes = np.log(posterior[SIZE].values).std()
    determined = slice(0, 4)  # the resonance of the last is above the lines
    assert np.all((deviation < 0.1 * spread_of_sizes * np.abs(ERRORS))[determined])


def test_over_other_marginals_map_is_refused(case):
    with pytest.raises(InfeasibleError, match="joint mode"):
        bp.infer(*case, engine="map", marginal=bp.marginals.Quadrature())
