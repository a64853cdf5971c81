"""The output error of a planned measurement, as stated or as measured before."""

import equinox as eqx
import numpy as np
import numpy.testing as npt
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement.design.next_measurement import planned

LINES = np.array([40.0, 120.0, 260.0])
COHERENCE, AVERAGES = 0.95, 16
COMPLEX, LOGARITHM = bp.observe.Complex("velocity"), bp.observe.LogAmplitude("velocity")


def experiment(noise, observe=LOGARITHM):
    modes = bp.beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
    return bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.02, 0.06))),
        sensors=[bp.Sensor("s1", at=0.25), bp.Sensor("s2", at=0.6)],
        actuators=[bp.Actuator("a1", at=0.3)],
        frequency=LINES,
        observe=observe,
        noise=noise,
    )


def measured(coherence=COHERENCE):
    """Measurement of the nominal structure, with coherence."""
    plain = experiment(bp.noise.Gaussian(0.1))
    frf = np.asarray(compiled(bp.Experiment.frf)(plain.nominal()))
    return bp.Measurement.from_arrays(
        frf,
        LINES,
        sensors=plain.sensor_channels,
        actuators=plain.actuator_channels,
        quantity="mobility",
        coherence=np.broadcast_to(coherence, frf.shape),
        averages=AVERAGES,
    )


def relative(coherence):
    """Standard deviation of log10 of the amplitude: half of the variance lies along the FRF."""
    return np.sqrt((1 - coherence) / (AVERAGES * coherence) / 2) / np.log(10)


@pytest.mark.parametrize("noise", [None, bp.noise.Gaussian(0.1)])
def test_an_error_that_is_stated_stays(noise):
    stated = experiment(noise)
    plan = planned(stated, measured())
    assert bool(eqx.tree_equal(plan.noise, noise)) and plan.observe == stated.observe
    assert [unknown.name for unknown in plan.unknowns] == ["structure.damping.ratio"]


def test_an_unknown_level_becomes_its_mean_and_all_else_stays_unknown():
    plan = planned(experiment(bp.noise.Gaussian(dist.Uniform(0.1, 0.4)), COMPLEX))
    assert float(plan.noise.sigma) == pytest.approx(0.25)
    assert plan.observe == COMPLEX
    assert [unknown.name for unknown in plan.unknowns] == ["structure.damping.ratio"]


@pytest.mark.parametrize("observe", [COMPLEX, LOGARITHM])
def test_coherence_of_an_earlier_measurement_tells_the_relative_error(observe):
    plan = planned(experiment(bp.noise.FromCoherence(), observe), measured())
    assert plan.observe == LOGARITHM
    assert type(plan.noise) is bp.noise.Gaussian
    assert plan.noise.sigma == pytest.approx(relative(COHERENCE), rel=1e-9)


@pytest.mark.parametrize("observe", [COMPLEX, LOGARITHM])
def test_the_factor_on_the_coherence_counts(observe):
    plan = planned(experiment(bp.noise.FromCoherence(factor=3.0), observe), measured())
    assert plan.noise.sigma == pytest.approx(3 * relative(COHERENCE), rel=1e-9)


@pytest.mark.parametrize("observe", [COMPLEX, LOGARITHM])
def test_the_median_is_taken_over_lines_and_sensors(observe):
    """A few lines of poor coherence, at antiresonances, do not tell of the others."""
    coherence = np.array([[[0.2, 0.95, 0.95]], [[0.95, 0.999, 0.95]]])
    plan = planned(experiment(bp.noise.FromCoherence(), observe), measured(coherence))
    assert plan.noise.sigma == pytest.approx(relative(0.95), rel=1e-9)


@pytest.mark.parametrize("observe", [COMPLEX, LOGARITHM])
def test_what_was_not_measured_does_not_count(observe):
    complete = measured(np.array([[[0.9, 0.9, 0.9]], [[0.99, 0.99, 0.99]]]))
    frf = complete.frf.copy()
    frf[1] = np.nan
    partly = bp.Measurement.from_arrays(
        frf,
        LINES,
        sensors=complete.sensors,
        actuators=complete.actuators,
        quantity="mobility",
        coherence=complete.coherence,
        averages=AVERAGES,
    )
    plan = planned(experiment(bp.noise.FromCoherence(), observe), partly)
    assert plan.noise.sigma == pytest.approx(relative(0.9), rel=1e-9)


@pytest.mark.parametrize("noise", [None, bp.noise.FromCoherence(), bp.noise.Gaussian(0.1)])
def test_a_standard_deviation_that_is_given_is_taken(noise):
    plan = planned(experiment(noise, COMPLEX), measured(), 0.02)
    assert plan.noise.sigma == 0.02 and plan.observe == LOGARITHM


def test_scatter_of_repeated_measurements_is_as_planned():
    """Errors as the coherence tells them, drawn here, scatter log10 of the amplitude as planned."""
    sigma = planned(experiment(bp.noise.FromCoherence(), COMPLEX), measured()).noise.sigma
    size = np.sqrt((1 - COHERENCE) / (AVERAGES * COHERENCE) / 2)
    real, imaginary = size * np.random.default_rng(2).standard_normal((2, 40_000))
    scatter = np.std(np.log10(np.abs(1 + real + 1j * imaginary)))
    npt.assert_allclose(scatter, sigma, rtol=0.02)


def test_what_is_planned_can_be_placed():
    plan = planned(experiment(bp.noise.FromCoherence(), COMPLEX), measured())
    table = bp.information_map(plan, {"s1": [0.25, 0.4]}, estimator=bp.information.Exact(draws=32))
    assert np.isfinite(table["information_gain"]).all()


def test_an_error_read_from_coherence_needs_a_measurement():
    with pytest.raises(ValueError, match=r"noise\.FromCoherence\(\).* not measured yet.*sigma=0"):
        planned(experiment(bp.noise.FromCoherence()))


def test_a_factor_that_is_unknown_is_refused():
    noise = bp.noise.FromCoherence(factor=dist.Uniform(1.0, 2.0))
    with pytest.raises(ValueError, match=r"unknown even with the measurement.*sigma=0\.01"):
        planned(experiment(noise), measured())
