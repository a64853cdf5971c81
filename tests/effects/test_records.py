"""Effects of the record that are tried by name: filters of SciPy, sampled signals, closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy import signal

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.errors import InputError
from bayes_placement.effects import Scales
from tests.effects import models_in_space
from tests.effects.test_on_transducers import (
    AT,
    FEW,
    LINES,
    OMEGA,
    RATIO,
    experiment,
    few,
    frf,
)

NEW = ["low_pass", "high_pass", "phase_drift", "cross_axis", "frequency_scale", "mains_hum"]


@pytest.fixture(scope="module")
def plain():
    return frf(experiment())


def over(response, plain):
    """Factor on each FRF."""
    return response / plain


def test_few_of_them_are_tried_unless_they_are_named():
    by_default = {"low_pass", "high_pass", "frequency_scale"}  # commonly forgotten
    assert set(NEW) & set(effects.library(experiment()).kinds) == by_default
    assert set(effects.library(models_in_space.frame().experiment(), NEW).kinds) >= {*NEW[:5]}


# ------------------------------------------------------------------------------ filters


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("kind", ["low_pass", "high_pass"])
def test_filters_are_those_of_butterworth(kind, order, plain):
    corner, to_pass = 130.0, kind.replace("_", "")
    filters = signal.butter(order, 2 * np.pi * corner, to_pass, analog=True)
    _, gain = signal.freqs(*filters, worN=OMEGA)
    filtered = effects.EFFECTS[kind]
    factor = over(frf(experiment() + filtered("s2", corner, order)), plain)
    assert_allclose(factor[1], np.tile(gain, (2, 1)), rtol=1e-12)
    assert_allclose(factor[0], 1.0, rtol=1e-14)
    factor = over(frf(experiment() + filtered(None, corner, order)), plain)
    assert_allclose(factor, np.tile(gain, (2, 2, 1)), rtol=1e-12)


def test_one_filter_in_all_channels_and_the_force_cancels(plain):
    both = experiment() + effects.low_pass(None, 130.0, 2)
    for name in ("a1", "a2"):
        both = both + effects.low_pass(name, 130.0, 2, name=name)
    assert_allclose(frf(both), plain, rtol=1e-12)


def test_a_filter_in_all_sensors_has_no_place():
    setup = experiment() + effects.low_pass(None, 130.0)
    effect, modes = setup.instrument_effects["low_pass"], setup.structure.modes
    assert effect.location(modes, setup.instruments) is None
    assert effect.setting(modes, setup.instruments) == "all sensors"
    with pytest.raises(InputError, match=r"without a sensor; none is needed"):
        experiment() + effects.low_pass(None, 130.0, direction=3)


@pytest.mark.parametrize("kind", ["low_pass", "high_pass"])
def test_filters_are_suggested_for_all_sensors_and_each_transducer(kind):
    settings = [(effect.transducer, effect.order) for effect in suggested(kind)]
    names = [None, "s1", "s2", "a1", "a2"]
    assert settings == [(name, order) for name in names for order in (1, 2)]


def suggested(kind, **changes):
    return effects.EFFECTS[kind].suggest(Scales(experiment(**changes)))


# ------------------------------------------------------------------------------ phase


def test_an_ac_coupling_leads_as_a_phase_drift_of_exponent_minus_one(plain):
    corner = 0.2
    _, gain = signal.freqs(*signal.butter(1, 2 * np.pi * corner, "highpass", True), worN=OMEGA)
    drift = effects.phase_drift("s1", -corner / 30.0, 30.0, -1.0)
    factor = over(frf(experiment() + drift), plain)[0, 0]
    assert_allclose(np.angle(factor), np.angle(gain), rtol=(corner / LINES[0]) ** 2)
    assert_allclose(np.abs(factor), 1.0, rtol=1e-12)


def test_a_phase_drift_in_proportion_to_frequency_is_a_delay_and_one_of_none_is_constant(plain):
    delay = effects.channel_delay("a2", 1.3e-3)
    drift = effects.phase_drift("a2", 2 * np.pi * 25.0 * 1.3e-3, 25.0, 1.0)
    assert_allclose(frf(experiment() + drift), frf(experiment() + delay), rtol=1e-12)
    factor = over(frf(experiment() + effects.phase_drift("s2", 0.3, 25.0)), plain)
    assert_allclose(factor[1], np.exp(-0.3j), rtol=1e-12)
    assert_allclose(factor[0], 1.0, rtol=1e-14)


def test_a_line_at_0_hz_has_no_phase_drift():
    setup = experiment() + effects.phase_drift("s1", 0.3, 25.0, -1.0)
    effect = setup.instrument_effects["phase_drift"]
    factor = effect.channel_factor(jnp.zeros(1), setup.instruments)
    assert_array_equal(factor, np.ones((2, 1, 1)))


# ------------------------------------------------------------------------------ axes


def test_each_channel_of_a_sensor_reads_a_share_of_its_others():
    scene = models_in_space.frame()
    sensor = effects.cross_axis("s1", 0.04).numbered(
        bp.effects.Scales(scene.experiment()).instruments
    )
    without = np.asarray(jax.jit(lambda: scene.response([]))())
    mixed = np.asarray(jax.jit(lambda: scene.response([sensor]))())
    first = without[:3]  # three channels of s1
    assert_allclose(mixed[:3], first + 0.04 * (first.sum(axis=0) - first), rtol=1e-12)
    assert_array_equal(mixed[3:], without[3:])


def test_no_share_of_other_axes_is_the_identity_bit_for_bit_and_has_a_slope():
    scene = models_in_space.frame()
    sensors = bp.effects.Scales(scene.experiment()).instruments

    @jax.jit
    def of(share):
        return scene.response([effects.cross_axis("s1", share).numbered(sensors)])

    assert_array_equal(of(0.0), jax.jit(lambda: scene.response([]))())
    slope = jax.jit(lambda: jax.jvp(of, (0.0,), (1.0,))[1])()
    assert_allclose(slope, of(1.0) - of(0.0), atol=1e-12 * np.abs(slope).max())


def test_cross_axis_is_suggested_where_a_sensor_has_several_axes():
    assert not suggested("cross_axis")
    scene = models_in_space.frame().experiment()
    sensors = [effect.sensor for effect in effects.library(scene, ["cross_axis"]).effects]
    assert sensors == ["s1", "s3"]
    with pytest.raises(InputError, match=r'sensor "s2" was given, but it has one channel; at'):
        scene + effects.cross_axis("s2", 0.1)


# ------------------------------------------------------------------------------ rate


@pytest.mark.parametrize("quantity", ["displacement", "velocity", "acceleration"])
def test_lines_of_a_wrong_rate_are_other_lines(quantity):
    error = -0.07
    scaled = frf(experiment(quantity=quantity) + effects.frequency_scale(error))
    setup = experiment(quantity=quantity)
    elsewhere = bp.Experiment(
        setup.structure,
        sensors=[*setup.sensor.values()],
        actuators=[*setup.actuator.values()],
        frequency=LINES * (1 + error),
        observe=setup.observe,
        noise=setup.noise,
    )
    assert_allclose(scaled, frf(elsewhere), rtol=1e-12)


@pytest.mark.parametrize("reversed_order", [False, True])
@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
def test_a_wrong_rate_is_that_of_the_samples(quantity, reversed_order):
    """Signals of a hit, sampled at another rate than believed, and windowed by believed times."""
    error, rate, width, step = 0.06, 4.0, 4e-3, 2e-5
    time = np.arange(0.0, 4.0, step)
    force = np.where(time < width, np.sin(np.pi * time / width) ** 2, 0.0)
    naturals, residues = few()
    damped = naturals * np.sqrt(1 - RATIO**2)
    impulse = np.zeros(time.size)
    for residue, natural, ringing in zip(residues, naturals, damped, strict=True):
        impulse += residue / ringing * np.exp(-RATIO * natural * time) * np.sin(ringing * time)
    response = signal.fftconvolve(force, impulse)[: time.size] * step
    if quantity == "acceleration":
        response = np.gradient(np.gradient(response, step), step)
    believed = time * (1 + error)  # the samples are closer than believed
    kernel = np.exp(-1j * OMEGA[:, None] * believed - rate * believed)
    expected = (kernel @ response) / (kernel @ force)
    additions = [effects.exponential_window(rate), effects.frequency_scale(error)]
    seen = small(quantity, additions[::-1] if reversed_order else additions)
    size = np.abs(expected).max()
    assert_allclose(seen / size, expected / size, atol=3e-4)
    assert np.abs(small(quantity, additions[:1]) - expected).max() > 0.05 * size


def small(quantity, additions):
    """FRF between s1 and a1 of the few modes."""
    setup = bp.Experiment(
        bp.Structure(FEW, damping=bp.damping.Modal(RATIO)),
        sensors=[bp.Sensor("s1", at=AT["s1"])],
        actuators=[bp.Actuator("a1", at=AT["a1"])],
        frequency=LINES,
        observe=bp.observe.Complex(quantity),
        noise=None,
    )
    for effect in additions:
        setup = setup + effect
    return frf(setup)[0, 0]


# ------------------------------------------------------------------------------ hum


@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
def test_hum_is_added_at_lines_of_the_mains_and_nowhere_else(quantity):
    without = frf(experiment(quantity=quantity))
    hum = effects.mains_hum("s2", 0.3, 0.7, 21.6, 2.0, quantity=quantity)
    added = frf(experiment(quantity=quantity) + hum) - without
    level = np.sqrt(np.mean(np.abs(without[1]) ** 2, axis=-1, keepdims=True))
    close = np.array([0, 1, 0, 1, 1])  # 21, 63 and 88 Hz; 7 and 40 Hz are far from any multiple
    expected = 0.3 * level * np.exp(0.7j) * close
    assert_allclose(added[1], expected, atol=1e-12 * level.max())
    assert_allclose(added[0], 0.0, atol=1e-14 * level.max())


def test_hum_of_a_channel_that_sees_nothing_has_a_finite_slope():
    setup = experiment() + effects.mains_hum("s1", 0.3, frequency=21.0)
    effect, omega = setup.instrument_effects["mains_hum"], jnp.asarray(OMEGA)

    def level(size):
        dead = size * jnp.zeros((2, 2, LINES.size), complex)
        return jnp.abs(effect.recorded(dead, omega, setup.instruments)).sum()

    assert np.isfinite(compiled(jax.grad(level))(1.0))


def test_hum_is_suggested_where_lines_may_have_it():
    assert not suggested("mains_hum")  # lines that are farther apart tell no hum
    setup = experiment()
    lines = np.arange(10.0, 130.0, 4.0)
    finer = bp.Experiment(
        setup.structure,
        sensors=[*setup.sensor.values()],
        actuators=[*setup.actuator.values()],
        frequency=lines,
        observe=bp.observe.Complex("velocity"),
        noise=setup.noise,
    )
    candidates = effects.library(finer, ["mains_hum"]).effects
    found = [(c.transducer, c.frequency, c.width, c.quantity) for c in candidates]
    assert found == [(s, f, 2.0, "velocity") for s in ("s1", "s2") for f in (50.0, 60.0)]
