"""Effects of either sign: a removal undoes an addition and is identified as a removal."""

import jax
import numpy as np
import numpyro.distributions as dist
import pytest
from numpy.testing import assert_allclose
from scipy.stats import norm

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.ranges import log_uniform_of_either_sign, negative_log_uniform, reach
from bayes_placement.inference.coordinates import Coordinates
from tests.criticism import small
from tests.effects import models_in_space

LINES = np.array([7.0, 21.0, 40.0, 63.0, 88.0])
AT = 0.37


def experiment(*additions, ratio=0.02):
    beam = bp.beams.beam(
        8, length=1.0, area=1e-3, second_moment=1e-8, youngs_modulus=7e10, density=2700.0
    )
    structure = bp.Structure(beam, damping=bp.damping.Modal(ratio))
    for effect in additions:
        structure = structure + effect
    return bp.Experiment(
        structure,
        sensors=[bp.Sensor("s1", at=0.8)],
        actuators=[bp.Actuator("a1", at=0.6)],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Gaussian(0.1),
    )


def natural(structure):
    return structure.proper_modes().angular_frequency()


def frf(setup):
    return np.asarray(compiled(bp.Experiment.frf)(setup))


@pytest.mark.parametrize(
    ("added", "removed"),
    [
        (effects.point_mass(AT, 0.2), effects.point_mass(AT, -0.2, name="hole")),
        (effects.ground_spring(AT, 3e4), effects.ground_spring(AT, -3e4, name="softer")),
        pytest.param(
            effects.local_stiffness_loss(AT, 0.05, 0.4),
            # Flexibility grows by loss / (1 - loss) and falls by gain / (1 + gain).
            effects.local_stiffness_loss(AT, 0.05, -2.0, name="patch"),
            marks=pytest.mark.long,
        ),
    ],
    ids=["mass", "spring", "stiffness"],
)
def test_what_is_removed_undoes_what_was_added(added, removed):
    plain, changed = frf(experiment()), frf(experiment(added))
    assert np.abs(changed / plain - 1).max() > 0.02
    assert_allclose(frf(experiment(added, removed)), plain, rtol=1e-9)


def test_a_stiffer_stretch_raises_natural_frequencies():
    base, patched = (
        np.asarray(compiled(natural)(experiment(*additions).structure))
        for additions in ((), (effects.local_stiffness_loss(AT, 0.05, -1.0),))
    )
    assert np.all(patched > base * (1 - 1e-12))
    assert patched[0] > 1.001 * base[0]


@pytest.mark.parametrize(
    ("kind", "ends", "modes"),
    [
        ("beam", "free-free", 3),
        ("beam", "free-free", 40),
        ("beam", "fixed-free", 20),
        ("bar", "fixed-free", 8),
    ],
)
def test_the_stiffest_stretch_that_is_tried_has_natural_frequencies(kind, ends, modes):
    second = {"second_moment": 1e-8} if kind == "beam" else {}
    line = getattr(bp.beams, kind)(
        modes, length=1.7, area=1e-3, youngs_modulus=7e10, density=2700.0, ends=ends, **second
    )
    setup = bp.Experiment(
        bp.Structure(line, damping=bp.damping.Modal(0.02)),
        sensors=[bp.Sensor("s1", at=0.8)],
        actuators=[bp.Actuator("a1", at=0.6)],
        frequency=LINES,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Gaussian(0.1),
    )
    _, stiffer = effects.library(setup, ["local_stiffness_loss"]).effects
    extent, loss = float(stiffer.extent.icdf(1.0)), float(stiffer.loss.icdf(0.0))
    assert loss == pytest.approx(-1.0)

    def stretched(at):
        return natural(setup.structure + effects.local_stiffness_loss(at, extent, loss))

    places = np.linspace(float(stiffer.at.low), float(stiffer.at.high), 41)
    frequencies = np.asarray(jax.jit(jax.vmap(stretched))(places))
    base = np.asarray(compiled(type(line).angular_frequency)(line))
    assert np.all(frequencies >= base * (1 - 1e-9))
    assert np.all(frequencies.max(axis=0)[-1] > 1.001 * base[-1])


def test_a_stiffer_region_is_minus_a_loss():
    scene = models_in_space.plate()
    plain = scene.experiment()
    region = effects.library(plain, ["region_stiffness_loss"]).effects
    half = len(region) // 2
    assert half >= 1
    numbers = [int(effect.region) for effect in region]
    assert numbers[:half] == numbers[half:]
    stiffer = plain.structure + effects.region_stiffness_loss(np.asarray(0), -0.5)
    softer = plain.structure + effects.region_stiffness_loss(np.asarray(0), 0.5)
    changes = [
        np.asarray(compiled(natural)(patched))
        / np.asarray(compiled(natural)(plain.nominal().structure))
        for patched in (stiffer, softer)
    ]
    assert np.all(changes[0] > 1 - 1e-9)
    assert np.all(changes[1] < 1 + 1e-9)


def test_a_negative_prior_is_that_of_minus_the_number():
    prior, positive = negative_log_uniform(0.01, 0.3), dist.LogUniform(0.01, 0.3)
    values = np.array([-0.29, -0.1, -0.011])
    assert_allclose(prior.log_prob(values), positive.log_prob(-values))
    drawn = np.asarray(prior.sample(jax.random.PRNGKey(1), (1000,)))
    assert drawn.min() > -0.3
    assert drawn.max() < -0.01
    assert_allclose(reach(prior), (-0.3, -0.01), rtol=1e-4)


def test_springs_may_be_softer_than_assumed_where_there_are_some():
    assert len(effects.library(experiment(), ["ground_spring"]).effects) == 1
    supported = experiment(
        effects.ground_spring(0.1, 400.0), effects.ground_spring(0.9, 600.0, name="b")
    )
    _, softer = effects.library(supported, ["ground_spring"]).effects
    assert float(softer.stiffness.icdf(0.0)) == pytest.approx(-1000.0)


@pytest.mark.long
@pytest.mark.longest
def test_a_removed_mass_is_found_and_said():
    setup = small.experiment()
    library = effects.library(setup, ["point_mass", "ground_spring", "local_stiffness_loss"])
    hole = bp.improve(setup, small.measured(effects.point_mass(0.313, -0.3)), candidates=library)
    assert hole.verdict == ("point_mass",)
    assert "removed at" in hole.sentence()
    mass = hole.steps[-1].parameters["structure.effects.point_mass.mass"]
    assert mass.low < -0.3 < mass.high


@pytest.mark.long
def test_added_stiffness_is_found_and_said():
    lines = np.linspace(8.0, 400.0, 60)

    def beam(noise, *additions):
        base = experiment(*additions, ratio=0.02 if noise is None else dist.Uniform(0.01, 0.03))
        return bp.Experiment(
            base.structure,
            sensors=[bp.Sensor("s1", at=0.83), bp.Sensor("s2", at=0.22)],
            actuators=[bp.Actuator("a1", at=0.61)],
            frequency=lines,
            observe=base.observe,
            noise=noise,
        )

    true = beam(None, effects.local_stiffness_loss(0.313, 0.03, -0.8))
    exact = frf(true)
    random = np.random.default_rng(1)
    size = 0.003 * np.abs(exact) / np.sqrt(2)
    error = random.standard_normal(exact.shape) + 1j * random.standard_normal(exact.shape)
    measured = bp.Measurement.from_arrays(
        exact + size * error,
        lines,
        sensors=true.sensor_channels,
        actuators=true.actuator_channels,
        quantity="accelerance",
    )
    model = beam(bp.noise.Relative(0.003))
    library = effects.library(model, ["point_mass", "ground_spring", "local_stiffness_loss"])
    ledger = bp.improve(model, measured, candidates=library)
    assert ledger.verdict == ("local_stiffness_loss",)
    assert "stiffer, not softer" in ledger.sentence()
    place = ledger.steps[-1].parameters["structure.effects.local_stiffness_loss.at"]
    assert place.low < 0.313 < place.high


def test_density_of_a_number_of_either_sign_falls_as_its_inverse():
    prior = log_uniform_of_either_sign(1e-3, -0.8, 10.0)
    values = np.array([-0.7, -1e-2, -3e-4, 0.0, 2e-3, 0.5, 9.0])
    total = np.arcsinh(10.0 / 1e-3) + np.arcsinh(0.8 / 1e-3)
    assert_allclose(np.exp(prior.log_prob(values)), 1 / np.hypot(values, 1e-3) / total, rtol=1e-10)
    coordinates = Coordinates({"x": prior})
    below = norm.cdf([coordinates.vector({"x": value})[0] for value in values])
    assert_allclose(below, (np.arcsinh(values / 1e-3) + np.arcsinh(0.8 / 1e-3)) / total, rtol=1e-6)
    point = np.array([coordinates.vector({"x": value}) for value in values])
    assert_allclose(coordinates.named(point)["x"], values, rtol=1e-6, atol=1e-12)


def test_a_prior_is_printed_as_it_was_made():
    setup = experiment() + effects.library(experiment(), ["gain_error"]).effects[0]
    assert "-1 + exp(0.001 sinh(Uniform(-9.62917, 9.62917)))" in str(setup)
    setup = experiment(effects.point_mass(AT, negative_log_uniform(1.0, np.e)))
    assert "-1 exp(Uniform(0, 1))" in str(setup)
