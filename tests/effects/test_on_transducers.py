"""Effects on one sensor, actuator or hit, and on exciters: closed forms, reciprocity, priors."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest
from numpy.testing import assert_allclose
from scipy.signal import fftconvolve

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.errors import InputError
from bayes_placement.effects import Scales
from bayes_placement.inference.coordinates import Coordinates
from bayes_placement.inference.engines.levenberg_marquardt import LARGEST

LENGTH = 1.0
LINES = np.array([7.0, 21.0, 40.0, 63.0, 88.0])
OMEGA = 2 * np.pi * LINES
RATIO = 0.02
AT = {"s1": 0.31, "s2": 0.87, "a1": 0.55, "a2": 0.13, "a3": 0.74}


def beam(modulus=7e10):
    return bp.beams.beam(
        6, length=LENGTH, area=1e-3, second_moment=1e-8, youngs_modulus=modulus, density=2700.0
    )


def experiment(
    sensors=("s1", "s2"),
    actuators=("a1", "a2"),
    *,
    modulus=7e10,
    mounted="roving",
    at=None,
    quantity="displacement",
):
    places = AT | (at or {})
    return bp.Experiment(
        bp.Structure(beam(modulus), damping=bp.damping.Modal(RATIO)),
        sensors=[bp.Sensor(name, at=places[name]) for name in sensors],
        actuators=[bp.Actuator(name, at=places[name]) for name in actuators],
        frequency=LINES,
        observe=bp.observe.Complex(quantity),
        noise=bp.noise.Gaussian(1.0),
        sensors_mounted=mounted,
    )


def frf(setup):
    return np.asarray(compiled(bp.Experiment.frf)(setup.nominal()))


@pytest.fixture(scope="module")
def plain():
    return frf(experiment())


# ------------------------------------------------------------------------------ records


def test_a_gain_error_of_an_actuator_multiplies_its_column(plain):
    response = frf(experiment() + effects.gain_error("a2", 8.81))
    assert_allclose(response, plain * np.array([1.0, 9.81])[:, None], rtol=1e-13)


def test_a_reversed_hit_changes_the_sign_of_its_column(plain):
    response = frf(experiment() + effects.reversed_channel("a1"))
    assert_allclose(response, plain * np.array([-1.0, 1.0])[:, None], rtol=1e-13)
    response = frf(experiment() + effects.reversed_channel("s2"))
    assert_allclose(response, frf(experiment() + effects.reversed_sensor("s2")), rtol=1e-13)


def test_a_delay_of_one_channel_turns_its_phase(plain):
    delay = 1.3e-3
    turned = np.exp(-1j * OMEGA * delay)
    for name, row in (("s2", np.array([1, 0])[:, None]), ("a1", np.array([0, 1]))):
        response = frf(experiment() + effects.channel_delay(name, delay))
        assert_allclose(response, plain * np.where(row[..., None], 1.0, turned), rtol=1e-13)


def test_swapped_hits_are_recorded_under_each_other_s_name(plain):
    response = frf(experiment() + effects.swapped_actuators("a1", "a2"))
    assert_allclose(response, plain[:, ::-1], rtol=1e-12)


def test_a_misplaced_hit_is_a_hit_elsewhere():
    response = frf(experiment() + effects.misplaced_actuator("a2", 0.2))
    assert_allclose(response, frf(experiment(at={"a2": AT["a2"] + 0.2})), rtol=1e-12)


def test_a_misplaced_hit_is_a_misplaced_sensor_of_the_reciprocal_test():
    ours = experiment(("s1", "s2"), ("a1",)) + effects.misplaced_actuator("a1", -0.2)
    places = {"s1": AT["a1"], "a1": AT["s1"], "a2": AT["s2"]}
    other = experiment(("s1",), ("a1", "a2"), at=places) + effects.misplaced_sensor("s1", -0.2)
    assert_allclose(frf(ours), np.swapaxes(frf(other), 0, 1), rtol=1e-9)


# ------------------------------------------------------------------------------ exciters


@pytest.mark.parametrize("mounted", [pytest.param("roving", marks=pytest.mark.long), "fixed"])
def test_the_mass_of_an_exciter_is_a_mass_where_it_drives(mounted, plain):
    mass = 0.3
    response = frf(experiment(mounted=mounted) + effects.actuator_mass(mass))
    for column, name in enumerate(("a1", "a2")):
        loaded = frf(experiment() + effects.point_mass(AT[name], mass))
        assert_allclose(response[:, column], loaded[:, column], rtol=1e-9)
    assert np.abs(response / plain - 1).max() > 0.1


def test_a_stinger_is_spring_dashpot_and_mass_where_it_drives():
    stiffness, frequency, ratio = 2e4, 30.0, 0.1
    natural = 2 * np.pi * frequency
    response = frf(experiment() + effects.stinger(stiffness, frequency, ratio))
    for column, name in enumerate(("a1", "a2")):
        grounded = experiment()
        grounded = grounded + effects.ground_spring(AT[name], stiffness)
        grounded = grounded + effects.ground_dashpot(AT[name], 2 * ratio * stiffness / natural)
        grounded = grounded + effects.point_mass(AT[name], stiffness / natural**2)
        assert_allclose(response[:, column], frf(grounded)[:, column], rtol=1e-8)


# ------------------------------------------------------------------------------ window, drift


# Without the static flexibility of further modes, which the sums below lack as well.
FEW = bp.beams.beam(
    6,
    length=LENGTH,
    area=1e-3,
    second_moment=1e-8,
    youngs_modulus=7e10,
    density=2700.0,
    static_correction=False,
)


@functools.cache
def few():
    """Natural angular frequencies, and residues between s1 and a1."""
    shapes = [np.asarray(FEW.shapes(jnp.asarray(AT[name])))[0] for name in ("s1", "a1")]
    return 2 * np.pi * np.asarray(FEW.natural_frequency), np.prod(shapes, axis=0)


def windowed(rate, quantity="displacement"):
    """FRF between s1 and a1 through an exponential window."""
    setup = bp.Experiment(
        bp.Structure(FEW, damping=bp.damping.Modal(RATIO)),
        sensors=[bp.Sensor("s1", at=AT["s1"])],
        actuators=[bp.Actuator("a1", at=AT["a1"])],
        frequency=LINES,
        observe=bp.observe.Complex(quantity),
        noise=None,
    )
    return frf(setup + effects.exponential_window(rate))[0, 0]


@pytest.mark.parametrize("quantity", ["displacement", "acceleration"])
def test_a_window_is_that_of_the_signals(quantity):
    """Force and response of a hit of 4 ms, windowed in time and transformed line by line."""
    rate, width, step = 4.0, 4e-3, 2e-5
    time = np.arange(0.0, 4.0, step)
    force = np.where(time < width, np.sin(np.pi * time / width) ** 2, 0.0)
    naturals, residues = few()
    damped = naturals * np.sqrt(1 - RATIO**2)
    impulse = np.zeros(time.size)
    for residue, natural, ringing in zip(residues, naturals, damped, strict=True):
        impulse += residue / ringing * np.exp(-RATIO * natural * time) * np.sin(ringing * time)
    response = fftconvolve(force, impulse)[: time.size] * step
    if quantity == "acceleration":
        response = np.gradient(np.gradient(response, step), step)
    kernel = np.exp(-1j * OMEGA[:, None] * time - rate * time)
    expected = (kernel @ response) / (kernel @ force)
    size = np.abs(expected).max()
    assert_allclose(windowed(rate, quantity) / size, expected / size, atol=2e-4)
    assert np.abs(windowed(0.0, quantity) - expected).max() > 0.05 * size


def test_a_window_moves_the_poles_and_adds_to_each_damping_ratio():
    rate = 3.0
    natural, residues = few()
    poles = -RATIO * natural + 1j * natural * np.sqrt(1 - RATIO**2) - rate
    moved, ratios = np.abs(poles), -poles.real / np.abs(poles)
    assert_allclose(ratios - RATIO, rate / natural, rtol=0.01)
    loss = 2j * ratios * moved * OMEGA[:, None]
    expected = np.sum(residues / (moved**2 - OMEGA[:, None] ** 2 + loss), axis=1)
    assert_allclose(windowed(rate), expected, rtol=1e-9)


@pytest.mark.parametrize("name", ["s2", "a1"])
def test_drifted_runs_are_those_of_a_stiffer_structure(name, plain):
    drift = -0.013
    stiffer = frf(experiment(modulus=7e10 * (1 + drift) ** 2))
    response = frf(experiment() + effects.frequency_drift(name, drift))
    expected = plain.copy()
    if name == "s2":
        expected[1] = stiffer[1]
    else:
        expected[:, 0] = stiffer[:, 0]
    assert_allclose(response, expected, rtol=1e-9)


def test_window_drift_delay_and_gain_act_together():
    additions = [
        effects.exponential_window(2.0),
        effects.frequency_drift("a1", 0.01),
        effects.gain_error("s1", 0.1),
        effects.channel_delay("a2", 1e-3),
    ]
    forward = backward = experiment()
    for effect in additions:
        forward = forward + effect
    for effect in additions[::-1]:
        backward = backward + effect
    np.testing.assert_array_equal(frf(forward), frf(backward))


# ------------------------------------------------------------------------------ suggestions


def kinds(setup):
    return set(effects.library(setup).kinds)


def test_hits_of_a_roved_hammer_are_tried_one_by_one():
    hits = experiment(("s1",), ("a1", "a2", "a3"))
    variants = {
        kind: [effect.setting(hits.structure.modes, (hits + effect).instruments) for effect in
               ((hits + candidate).instrument_effects[kind] for candidate in
                effects.library(hits, [kind]).effects)]
        for kind in ("gain_error", "reversed_channel", "channel_delay", "misplaced_actuator",
                     "swapped_actuators", "frequency_drift")
    }  # fmt: skip
    hits_in_order = ["actuator a1", "actuator a2", "actuator a3"]
    assert variants["gain_error"] == ["sensor s1", *hits_in_order]
    assert variants["reversed_channel"] == hits_in_order
    assert variants["channel_delay"] == hits_in_order
    assert variants["misplaced_actuator"] == hits_in_order
    assert variants["frequency_drift"] == hits_in_order
    assert variants["swapped_actuators"] == [
        "actuators a1 and a2", "actuators a1 and a3", "actuators a2 and a3",
    ]  # fmt: skip
    # A hammer holds nothing.
    assert not {"stinger", "actuator_mass"} & kinds(hits)


def test_one_channel_on_either_side_has_no_other_to_differ_from():
    single = experiment(("s1",), ("a1",))
    assert [effect.side for effect in effects.library(single, ["gain_error"]).effects] == ["sensor"]
    doubtful = {"reversed_channel", "channel_delay", "swapped_actuators", "frequency_drift"}
    assert not doubtful & kinds(single)
    assert {"stinger", "actuator_mass", "misplaced_actuator"} <= kinds(single)


def test_sensors_that_stay_mounted_share_their_runs():
    fixed = effects.library(experiment(mounted="fixed"), ["frequency_drift"]).effects
    assert [effect.side for effect in fixed] == ["actuator", "actuator"]
    roved = effects.library(experiment(), ["frequency_drift"]).effects
    assert [effect.side for effect in roved] == ["sensor", "sensor", "actuator", "actuator"]


def test_a_factor_of_a_wrong_unit_is_within_reach():
    [error, *_] = (effect.error for effect in effects.library(experiment(), ["gain_error"]).effects)
    drawn = np.asarray(error.sample(jax.random.PRNGKey(0), (20_000,)))
    assert drawn.min() > -1
    # As much probability for a factor within 1 % as for one beyond 3.
    within = [np.mean(np.abs(np.log(1 + drawn)) < np.log(factor)) for factor in (1.01, 3.0)]
    assert within == pytest.approx([0.311, 0.799], abs=0.018)
    coordinate = Coordinates({"error": error}).vector({"error": 1000.0 - 1})
    assert 2 < float(coordinate[0]) < LARGEST  # the farthest that a fit goes


# ------------------------------------------------------------------------------ refusals


def test_names_on_either_side_are_found_and_others_refused():
    pair = experiment(("s1",), ("a1", "a2"))
    added = (pair + effects.gain_error("a2", 0.1)).instrument_effects["gain_error"]
    assert (added.side, int(added.transducer)) == ("actuator", 1)
    with pytest.raises(InputError, match=r'on "s9" was added, but the experiment has the sensors'):
        pair + effects.gain_error("s9", 0.1)
    with pytest.raises(InputError, match=r'on actuator "s1" was added'):
        pair + effects.gain_error("s1", 0.1, side="actuator")
    with pytest.raises(InputError, match=r'on actuator "h9" was added'):
        pair + effects.misplaced_actuator("h9", 0.1)
    with pytest.raises(InputError, match=r"the direction 2 was given, but the actuator has the"):
        pair + effects.reversed_channel("a1", direction=2)


def test_a_name_of_both_sides_is_the_sensor_unless_said():
    setup = bp.Experiment(
        bp.Structure(beam(), damping=bp.damping.Modal(RATIO)),
        sensors=[bp.Sensor("p1", at=0.3)],
        actuators=[bp.Actuator("p1", at=0.3), bp.Actuator("p2", at=0.8)],
        frequency=LINES,
        observe=bp.observe.Complex("displacement"),
        noise=bp.noise.Gaussian(1.0),
    )
    sides = [
        (setup + effects.gain_error("p1", dist.Normal(0, 1), **stated))
        .instrument_effects["gain_error"]
        .side
        for stated in ({}, {"side": "actuator"})
    ]
    assert sides == ["sensor", "actuator"]
    assert len(effects.gain_error.suggest(Scales(setup))) == 3
