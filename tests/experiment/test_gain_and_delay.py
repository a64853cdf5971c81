"""Gain and delay of a transducer: factors of its FRFs, unknowns like others, exact by default."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from scipy.stats import multivariate_normal

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.errors import InputError
from bayes_placement._shared.sites import Role
from bayes_placement.design.information import kernel_gain
from bayes_placement.inference import unconstrained
from bayes_placement.io import case
from tests.io.case.test_folder import changed, written

BEAM = bp.beams.beam(
    4, length=1.0, area=1e-3, second_moment=1e-8, youngs_modulus=7e10, density=2700.0
)
FREQUENCY = np.array([5.0, 12.0, 30.0, 55.0, 80.0])
OMEGA = 2 * jnp.pi * jnp.asarray(FREQUENCY)
RATIO = "structure.damping.ratio"
SPREAD = {"s1": 0.08, "s2": 0.05, "a1": 0.06}
"""Standard deviation of the log of each gain."""
SIGMA = 0.02
COMPLEX = bp.observe.Complex("acceleration")
KEY = jax.random.PRNGKey(2)


def experiment(changes, observe=COMPLEX, ratio=0.03, sigma=SIGMA):
    """Two sensors and two actuators, each with the changes of its name."""
    place = {"s1": 0.4, "s2": 0.9, "a1": 0.65, "a2": 0.15}

    def transducer(kind, name):
        return kind(name, at=place[name], **changes.get(name, {}))

    return bp.Experiment(
        bp.Structure(BEAM, damping=bp.damping.Modal(ratio)),
        sensors=[transducer(bp.Sensor, name) for name in ("s1", "s2")],
        actuators=[transducer(bp.Actuator, name) for name in ("a1", "a2")],
        frequency=FREQUENCY,
        observe=observe,
        noise=bp.noise.Gaussian(sigma),
    )


def logarithmic(sigma=SIGMA):
    """An experiment whose outputs are linear in the logs of its gains, all else known."""
    gains = {name: {"gain": dist.LogNormal(0.0, spread)} for name, spread in SPREAD.items()}
    observe = bp.observe.LogAmplitude("acceleration")
    return experiment(gains, observe, ratio=dist.Uniform(0.02, 0.05), sigma=sigma)


def frf(experiment):
    return np.asarray(compiled(bp.Experiment.frf)(experiment))


def test_exact_gain_and_delay_leave_no_trace():
    stated = bp.Sensor("s1", at=0.4, gain=1.0, delay=0.0)
    assert eqx.tree_equal(stated, bp.Sensor("s1", at=0.4))
    assert jax.tree.leaves(stated) == jax.tree.leaves(bp.Sensor("s1", at=0.4))
    assert stated.factor(OMEGA) is None


def test_gains_and_delays_multiply_the_frfs_of_their_channels():
    changes = {"s2": {"gain": 1.1, "delay": 2e-3}, "a1": {"gain": -0.9}, "a2": {"delay": -1e-3}}
    sensors = np.stack([np.ones(5), 1.1 * np.exp(-2e-3j * OMEGA)])
    actuators = np.stack([np.full(5, -0.9), np.exp(1e-3j * OMEGA)])
    expected = frf(experiment({})) * sensors[:, None] * actuators
    np.testing.assert_allclose(frf(experiment(changes)), expected, rtol=1e-13)


def test_all_channels_of_a_transducer_have_its_gain():
    sensor = bp.Sensor("s1", at=(0.0, 0.0, 0.0), directions=(1, -3), gain=2.0)
    assert len(sensor.channels) == 2
    np.testing.assert_array_equal(sensor.factor(OMEGA), np.full(5, 2.0))


def test_a_delay_is_conjugate_at_negative_frequencies():
    sensor = bp.Sensor("s1", at=0.4, delay=2e-3)
    np.testing.assert_allclose(sensor.factor(-OMEGA), np.conj(sensor.factor(OMEGA)))


def test_gains_and_delays_are_unknowns_of_their_own_role():
    changes = {"s1": {"gain": dist.Normal(1.0, 0.01)}, "a2": {"delay": dist.Normal(0.0, 1e-6)}}
    setup = experiment(changes)
    assert [(u.name, u.role, u.unit, u.field) for u in setup.unknowns] == [
        ("sensor.s1.gain", Role.RECORDING, "1", "gain"),
        ("actuator.a2.delay", Role.RECORDING, "s", "delay"),
    ]
    assert [u.is_placement for u in setup.unknowns] == [False, False]
    assert [u.is_of_transducer for u in setup.unknowns] == [True, True]
    assert "sensor.s1.gain     Normal(1, 0.01)   1     recording" in str(setup)
    assert setup.nominal_values() == {"sensor.s1.gain": 1.0, "actuator.a2.delay": 0.0}


def test_a_transducer_that_is_mounted_or_placed_keeps_its_gain_and_delay():
    place = bp.positions.Segment(0.4, within=0.01)
    sensor = bp.Sensor("s1", at=place, gain=dist.Normal(1.0, 0.01), delay=1e-5).on(BEAM)
    for changed_sensor in (sensor.mounted(2.0, BEAM), sensor.on(BEAM)):
        assert changed_sensor.gain is sensor.gain
        assert changed_sensor.delay == 1e-5


@pytest.mark.parametrize("gain", [0.0, np.nan, np.inf])
def test_a_gain_that_is_no_factor_is_refused(gain):
    with pytest.raises(InputError, match=r'Sensor "s1": gain=.* other than 0 .*dist.Normal'):
        bp.Sensor("s1", at=0.4, gain=gain)


def test_a_delay_that_is_not_finite_is_refused():
    with pytest.raises(InputError, match=r'Actuator "a1": delay=inf .*a finite time'):
        bp.Actuator("a1", at=0.4, delay=np.inf)


def closed_form(sigma):
    """Data of gains that are wrong, and the log evidence given the damping in closed form.

    With gain exp(u) of each transducer, z = z0 + (u_sensor + u_actuator) / log 10 + noise.
    """
    setup = logarithmic(sigma)
    wrong = {"sensor.s1.gain": 1.09, "sensor.s2.gain": 0.96, "actuator.a1.gain": 1.1}
    measured = setup.fix({RATIO: 0.034} | wrong).nominal_measurement()
    exact = setup.fix({RATIO: 0.034} | dict.fromkeys(wrong, 1.0))
    z0 = np.asarray(compiled(bp.Experiment.predict)(exact))
    shifts = np.zeros((3, *z0.shape))
    shifts[0, 0], shifts[1, 1], shifts[2, :, 0] = 1.0, 1.0, 1.0
    spread = np.array([*SPREAD.values()]) / np.log(10)
    loading = (spread[:, None] * shifts.reshape(3, -1)).T
    covariance = loading @ loading.T + sigma**2 * np.eye(z0.size)
    z = np.asarray(setup.data(measured).z)
    return measured, multivariate_normal(z0.ravel(), covariance).logpdf(z.ravel())


def log_likelihood(marginal, measured, sigma):
    """Log likelihood at the true damping, gains integrated."""
    setup = logarithmic(sigma)
    data = setup.data(measured)
    model = marginal.model(setup, data, KEY)
    distributions = {unknown.name: unknown.distribution for unknown in marginal.sampled(setup)}
    assert [*distributions] == [RATIO]
    target = unconstrained.UnconstrainedModel(model, distributions)
    return float(jax.jit(lambda flat: target.log_likelihood(flat))(target.flatten({RATIO: 0.034})))


def test_quadrature_integrates_gains_in_closed_form():
    measured, expected = closed_form(SIGMA)
    value = log_likelihood(bp.marginals.Quadrature(nodes=96), measured, SIGMA)
    assert value == pytest.approx(expected, abs=1e-6)


def test_kernels_estimate_the_integral_over_gains():
    # Noise thirty times as wide as the kernels, so that they do not broaden it.
    measured, expected = closed_form(0.8)
    value = log_likelihood(bp.marginals.KDE(placement_draws=20_000), measured, 0.8)
    assert value == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize(
    "engine",
    [
        pytest.param(bp.engines.MAP(), marks=pytest.mark.long),
        pytest.param(bp.engines.SMC(particles=1000), marks=[pytest.mark.long, pytest.mark.longest]),
    ],
)
def test_engines_find_the_evidence_of_gains(engine):
    # The outputs are linear in the logs of the gains, so Laplace's approximation is exact.
    measured, expected = closed_form(SIGMA)
    estimates = bp.infer(logarithmic().fix({RATIO: 0.034}), measured, engine=engine)["estimates"]
    error = np.nan_to_num(float(estimates["log_evidence_error"])) + 0.002
    assert abs(float(estimates["log_evidence"]) - expected) < 5 * error
    assert [*estimates["unknown"].values] == [
        name for name in logarithmic().unknown if name != RATIO
    ]


def test_products_of_modes_are_not_used_where_a_gain_is_unknown():
    known = experiment({}, ratio=dist.Uniform(0.02, 0.05))
    assert kernel_gain._factorise(known)
    assert not kernel_gain._factorise(logarithmic())


def test_a_case_states_the_gain_and_delay_tolerances(tmp_path):
    content = changed("sensors[0].gain_tolerance", 0.01)
    content = changed("actuators[0].delay_tolerance_s", 1e-6, content)
    setup = case.read(written(tmp_path, content)).experiment
    assert setup.unknown["sensor.s1.gain"].distribution.scale == 0.01
    assert setup.unknown["actuator.a1.delay"].distribution.scale == 1e-6
    assert setup.sensor["s2"].gain is None


def test_a_negative_tolerance_of_a_gain_is_refused(tmp_path):
    content = changed("sensors[0].gain_tolerance", -0.01)
    with pytest.raises(InputError, match=r"sensors\[0\].gain_tolerance of \"s1\" is -0.01"):
        case.read(written(tmp_path, content))
