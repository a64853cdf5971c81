"""Observed outputs, the error that one of the FRF gives them, and the Jacobian between the two."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement import observe

GENERATOR = np.random.default_rng(8)
SHAPE = (2, 1, 3)
FRF = jnp.asarray(
    10.0 ** GENERATOR.uniform(-6, -3, SHAPE) * np.exp(2j * np.pi * GENERATOR.uniform(size=SHAPE))
)
OMEGA = jnp.array([10.0, 40.0, 300.0])
QUANTITIES = {"displacement": 0, "velocity": 1, "acceleration": 2}


@pytest.mark.parametrize("kind", [observe.LogAmplitude, observe.Complex])
@pytest.mark.parametrize(("quantity", "order"), QUANTITIES.items())
def test_a_quantity_is_a_derivative_of_the_displacement(kind, quantity, order):
    actual = kind(quantity).frf(FRF, OMEGA)
    np.testing.assert_allclose(actual, FRF * (1j * np.asarray(OMEGA)) ** order, rtol=1e-14)


def test_log_amplitude_is_the_decimal_logarithm_of_the_modulus():
    actual = observe.LogAmplitude("velocity").output(FRF)
    np.testing.assert_allclose(actual, np.log10(np.abs(FRF)), rtol=1e-13)


def test_complex_parts_stand_before_the_frequency():
    actual = observe.Complex("displacement").output(FRF)
    assert actual.shape == (2, 1, 2, 3)
    np.testing.assert_array_equal(actual[:, :, 0], FRF.real)
    np.testing.assert_array_equal(actual[:, :, 1], FRF.imag)


@pytest.mark.parametrize("kind", [observe.LogAmplitude, observe.Complex])
def test_deviation_is_what_monte_carlo_finds(kind):
    observation, draws = kind("displacement"), 20_000
    share = np.broadcast_to([0.002, 0.01, 0.02], SHAPE)  # of |U|: small, as first order needs
    variance = (share * np.abs(FRF)) ** 2
    parts = GENERATOR.standard_normal((2, draws, *SHAPE)) * np.sqrt(variance / 2)
    actual = np.asarray(jax.jit(jax.vmap(observation.output))(FRF + parts[0] + 1j * parts[1]))
    expected = np.asarray(observation.deviation(FRF, jnp.asarray(variance)))
    assert expected.shape == actual.shape[1:]
    # Standard error of a standard deviation: sigma / sqrt(2 n).
    error = expected / np.sqrt(2 * draws)
    assert np.all(np.abs(actual.std(axis=0) - expected) < 5 * error)


def measured(observation, receptance=FRF):
    return np.asarray(observation.output(observation.frf(receptance, OMEGA)))


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_outputs_tell_the_receptance_whatever_was_observed(quantity):
    amplitude, complex_parts = observe.LogAmplitude(quantity), observe.Complex(quantity)
    omega = np.asarray(OMEGA)
    actual = amplitude.receptance(measured(amplitude), omega)
    np.testing.assert_allclose(actual, np.abs(FRF), rtol=1e-12)
    actual = complex_parts.receptance(measured(complex_parts), omega)
    np.testing.assert_allclose(actual[:, :, 0] + 1j * actual[:, :, 1], FRF, rtol=1e-12)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_log_jacobian_of_the_log_amplitude_is_that_of_its_modulus(quantity):
    observation = observe.LogAmplitude(quantity)

    def output(modulus):
        receptance = modulus.reshape(SHAPE) * jnp.exp(1j * jnp.angle(FRF))
        return observation.output(observation.frf(receptance, OMEGA)).ravel()

    matrix = jax.jit(jax.jacobian(output))(jnp.abs(FRF).ravel())
    actual = observation.log_jacobian(measured(observation), np.asarray(OMEGA))
    np.testing.assert_allclose(actual.ravel(), np.log(np.abs(np.diag(matrix))), rtol=1e-12)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_log_jacobian_of_complex_outputs_is_that_of_both_parts_together(quantity):
    observation = observe.Complex(quantity)

    def output(parts):
        receptance = (parts[0] + 1j * parts[1]).reshape(SHAPE)
        return observation.output(observation.frf(receptance, OMEGA)).ravel()

    matrix = jax.jit(jax.jacobian(output))(jnp.stack([FRF.real.ravel(), FRF.imag.ravel()]))
    _, expected = np.linalg.slogdet(matrix.reshape(12, 12))
    actual = observation.log_jacobian(measured(observation), np.asarray(OMEGA))
    assert actual.shape == (2, 1, 2, 3)
    np.testing.assert_allclose(actual.sum(), expected, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("kind", [observe.LogAmplitude, observe.Complex])
def test_what_was_not_measured_tells_nothing(kind):
    observation, omega = kind("velocity"), np.asarray(OMEGA)
    outputs = measured(observation).copy()
    outputs[0, ..., 1] = np.nan
    for actual in (
        observation.receptance(outputs, omega),
        observation.log_jacobian(outputs, omega),
    ):
        np.testing.assert_array_equal(np.isnan(actual), np.isnan(outputs))


def test_the_displacement_at_0_hz_has_a_jacobian():
    outputs = np.ones((1, 1, 2, 2))
    actual = observe.Complex("displacement").log_jacobian(outputs, np.array([0.0, 10.0]))
    np.testing.assert_array_equal(actual, np.zeros((1, 1, 2, 2)))


@pytest.mark.parametrize("kind", [observe.LogAmplitude, observe.Complex])
def test_an_unknown_quantity_is_refused(kind):
    with pytest.raises(ValueError, match="quantity='speed' was given; an FRF of displacement,"):
        kind("speed")


WORDS = {"receptance": "displacement", "mobility": "velocity", "accelerance": "acceleration"}


@pytest.mark.parametrize("kind", [observe.LogAmplitude, observe.Complex])
@pytest.mark.parametrize(("frf", "motion"), WORDS.items())
def test_an_frf_and_its_motion_are_one_quantity(kind, frf, motion):
    assert kind(frf) == kind(motion)
    assert kind(frf).label == kind(motion).label


@pytest.mark.parametrize(
    ("kind", "quantity"),
    [
        (observe.LogAmplitude, "velocity"),
        (observe.LogAmplitude, "acceleration"),
        (observe.Complex, "velocity"),
    ],
)
def test_0_hz_is_refused_where_nothing_moves(kind, quantity):
    message = rf"observe.{kind.__name__} needs \|U\| > 0, but frequency 0 Hz gives zero {quantity}"
    with pytest.raises(ValueError, match=message):
        kind(quantity).check(np.array([0.0, 5.0]))


def test_0_hz_is_welcome_where_the_structure_is_bent():
    observe.LogAmplitude("displacement").check(np.array([0.0, 5.0]))


def test_labels_carry_units():
    assert observe.LogAmplitude("velocity").label == "log10 of velocity per force [(m/s)/N]"
    assert observe.Complex("displacement").label == "displacement per force [m/N]"
