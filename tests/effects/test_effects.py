"""Default priors of effects, effects that cannot act or are refused, an effect of the user."""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro.distributions as dist
import pytest

import bayes_placement as bp
from bayes_placement import effects
from bayes_placement._shared.compiled import compiled
from bayes_placement._shared.ranges import reach
from bayes_placement._shared.sites import Role, unknowns
from bayes_placement.effects import Attachment
from bayes_placement.experiment.frf import receptance
from bayes_placement.modes.modes import Modes
from bayes_placement.modes.points import Points

LENGTH, AREA = 1.3, 1e-3
BAR = {"length": LENGTH, "area": AREA, "youngs_modulus": 1e9, "density": 9000.0}
BEAM = BAR | {"second_moment": 4e-8}
MASS = 9000.0 * AREA * LENGTH


def experiment(kind="beam", ends="fixed-free", **changes):
    line = getattr(bp.beams, kind)(8, **(BEAM if kind == "beam" else BAR), ends=ends)
    arguments = {
        "sensors": [
            bp.Sensor("s1", at=bp.positions.Segment(0.3, within=0.02)),
            bp.Sensor("s2", at=0.9),
        ],
        "actuators": [bp.Actuator("a1", at=0.5)],
        "frequency": [5.0, 20.0, 80.0],
        "observe": bp.observe.Complex("acceleration"),
        "noise": bp.noise.Gaussian(0.1),
        **changes,
    }
    return bp.Experiment(bp.Structure(line, damping=bp.damping.Modal(0.02)), **arguments)


class Bare(Modes):
    """One mode of which nothing is known but its shape."""

    axes: tuple[int, ...] = eqx.field(static=True, default=(3,))
    rigid_body_modes: int = eqx.field(static=True, default=0)

    def angular_frequency(self):
        return jnp.array([30.0])

    def shapes(self, position, derivative=0):
        return jnp.sin(position)[None, None]

    def static_flexibility(self, position, other):
        return None

    def bounds(self):
        return 0.0, 1.0


# ------------------------------------------------------------------------------ default priors


@pytest.fixture(scope="module")
def suggested():
    """By name, for a cantilever with several force levels."""
    every = effects.library(experiment(force_levels=[1.0, 5.0])).effects
    return {
        name: [effect for effect in every if effect.name == name]
        for name in {e.name for e in every}
    }


def test_every_effect_is_suggested_where_it_can_act(suggested):
    assert len(suggested) == 38
    free = effects.library(experiment(ends="free-free"))
    assert not {"compliant_support", "cubic_stiffness"} & set(free.kinds)
    bar = effects.library(experiment("bar", "fixed-fixed"))
    assert not {"axial_preload", "shear_and_rotary_inertia"} & set(bar.kinds)
    supports = [effect for effect in bar.effects if effect.name == "compliant_support"]
    assert {support.motion for support in supports} == {"translation"}
    assert free.kinds[0] == "point_mass"


def test_masses_are_shares_of_the_mass(suggested):
    added, removed = suggested["point_mass"]
    np.testing.assert_allclose([added.mass.low, added.mass.high], [1e-5 * MASS, MASS], rtol=0.02)
    assert float(removed.mass.icdf(0.0)) == pytest.approx(-0.1 * MASS, rel=0.02)
    assert (added.at.low, added.at.high) == (0.0, LENGTH)
    assert suggested["sensor_mass"][0].mass.high < 0.31 * MASS
    assert suggested["tuned_absorber"][0].frequency.low == pytest.approx(5.0)
    assert suggested["tuned_absorber"][0].frequency.high == pytest.approx(80.0)


def test_stiffnesses_are_scaled_to_the_band(suggested):
    scale = MASS * (2 * np.pi) ** 2 * 5.0 * 80.0
    [spring], [dashpot] = suggested["ground_spring"], suggested["ground_dashpot"]
    assert spring.stiffness.low < scale < spring.stiffness.high
    assert dashpot.viscosity.low < 0.1 * scale / (2 * np.pi * 20.0) < dashpot.viscosity.high
    [cubic] = suggested["cubic_stiffness"]
    amplitude = np.abs(
        compiled(bp.Experiment.receptance)(experiment(force_levels=[1.0, 5.0]).nominal())
    )
    at_resonance = cubic.stiffness.low**0.5 * cubic.stiffness.high**0.5 * (5 * amplitude.max()) ** 2
    np.testing.assert_allclose(at_resonance, scale, rtol=0.05)


def test_tension_reaches_towards_buckling(suggested):
    critical = np.pi**2 * 1e9 * 4e-8 / (2 * LENGTH) ** 2
    tension = suggested["axial_preload"][0].tension
    np.testing.assert_allclose(reach(tension), [-0.8 * critical, 10 * critical], rtol=1e-2)


STRENGTHS = {
    "axial_preload": "tension",
    "time_delay": "delay",
    "channel_delay": "delay",
    "frequency_drift": "drift",
    "gain_error": "error",
    "point_mass": "mass",
    "tuned_absorber": "mass",
    "ground_spring": "stiffness",
}


@pytest.mark.parametrize("kind", STRENGTHS)
def test_each_decade_of_a_strength_is_as_probable(kind, suggested):
    """Otherwise another kind is claimed in the place of a weak effect of this one."""
    prior = getattr(suggested[kind][0], STRENGTHS[kind])
    # The logarithm of 1 + error is log-uniform, as its error is only where it is small.
    strong = 0.1 if kind == "gain_error" else reach(prior)[1]
    upper, lower = -np.diff(prior.cdf(strong * np.array([1.0, 0.1, 0.01])))
    assert 0.01 < lower == pytest.approx(upper, rel=0.1)


def test_each_sensor_and_each_support_is_a_candidate(suggested):
    for kind in ("misplaced_sensor", "reversed_sensor"):
        assert [effect.sensor for effect in suggested[kind]] == ["s1", "s2"]
    assert [effect.transducer for effect in suggested["gain_error"]] == ["s1", "s2", "a1"]
    shift = suggested["misplaced_sensor"][0].shift
    np.testing.assert_allclose([shift.low, shift.high], [-0.3, 1.0])
    swaps = [(effect.sensor, effect.other) for effect in suggested["swapped_sensors"]]
    assert swaps == [("s1", "s2")]
    supports = [(effect.end, effect.motion) for effect in suggested["compliant_support"]]
    assert supports == [("left", "rotation"), ("left", "translation")]


def test_every_suggestion_can_be_added_and_felt(suggested):
    base = experiment(force_levels=[1.0, 5.0])
    for candidate, *_ in suggested.values():
        extended = base + candidate
        added = set(extended.unknown) - set(base.unknown)
        # What is either so or not has a strength of one, and nothing to be inferred.
        assert added or getattr(candidate, candidate.absent[0]) == 1.0, candidate.name
        words = {unknown.unit for unknown in extended.unknowns if unknown.name in added}
        assert "" not in words, candidate.name


# ----------------------------------------------------------------- adding to an experiment


def test_an_effect_is_named_by_its_path():
    extended = experiment() + effects.point_mass(
        bp.positions.Segment(1.25, within=0.1), dist.Uniform(0.1, 1.0), name="magnet"
    )
    extended = extended + effects.gain_error("s1", dist.Uniform(-0.5, 0.5))
    units = {unknown.name: unknown.unit for unknown in extended.unknowns}
    assert units["structure.effects.magnet.mass"] == "kg"
    assert units["instrument_effects.gain_error.error"] == "1"
    assert extended.unknown["instrument_effects.gain_error.error"].role is Role.PARAMETER
    place = extended.structure.effects["magnet"].at
    np.testing.assert_allclose([place.low, place.high], [1.15, LENGTH])
    assert [effect.name for effect in extended.effects] == ["magnet", "gain_error"]
    assert extended.without("magnet").without("gain_error").effects == []


def test_reversed_and_swapped_sensors():
    base = experiment()
    plain = np.asarray(compiled(bp.Experiment.receptance)(base.nominal()))
    turned = base + effects.reversed_sensor("s2")
    swapped = base + effects.swapped_sensors("s1", "s2")
    receptance = compiled(bp.Experiment.receptance)(turned.nominal())
    np.testing.assert_allclose(receptance, plain * np.array([1, -1])[:, None, None], rtol=1e-12)
    receptance = compiled(bp.Experiment.receptance)(swapped.nominal())
    np.testing.assert_allclose(receptance, plain[::-1], rtol=1e-12)


def test_a_place_that_shifts_stays_on_the_structure():
    far = experiment() + effects.misplaced_sensor("s2", 0.99 * LENGTH)
    tip = experiment(sensors=[bp.Sensor("s1", at=0.3), bp.Sensor("s2", at=LENGTH)])
    shifted, expected = (
        compiled(bp.Experiment.receptance)(setup.nominal()) for setup in (far, tip)
    )
    np.testing.assert_allclose(shifted[1], expected[1], rtol=1e-10)


# ------------------------------------------------------------------------------ what is refused


def refused(message):
    return pytest.raises(ValueError, match=message)


def test_effects_in_wrong_places_are_refused():
    beam, bar = experiment(), experiment("bar", "fixed-free")
    with refused(r'"time_delay" was added to a structure.*experiment \+ effect'):
        beam.structure + effects.time_delay(1e-3)
    with refused(r'"point_mass" was added twice.*name="point_mass_2"'):
        beam + effects.point_mass(0.1, 1.0) + effects.point_mass(0.2, 1.0)
    with refused(r"An effect of the name 'point.mass' was given; a name without a dot"):
        beam + effects.point_mass(0.5, 0.1, name="point.mass")
    with refused(r'"gain_error" was added twice'):
        beam + effects.gain_error("s1", 0.1) + effects.gain_error("s2", 0.1)
    with refused(r'"point_mass": place 1.4 m lies outside the structure \(0 to 1.3 m\)'):
        beam + effects.point_mass(1.4, 1.0)
    with refused(r'"local_stiffness_loss": place -0.1 m lies outside'):
        beam + effects.local_stiffness_loss(-0.1, 0.05, 0.5)
    with refused(r"Segment\(1.5, within=0.1\) m has no point on the structure"):
        beam + effects.ground_spring(bp.positions.Segment(1.5, within=0.1), 1e3)
    with refused(r"the rotation of the right end was given.*the rotation of the left end"):
        beam + effects.compliant_support(1e-3, end="right")
    with refused(r"This structure holds nothing"):
        experiment(ends="free-free") + effects.compliant_support(1e-3)
    with refused(r"axial_preload was added to a bar"):
        jax.eval_shape(lambda: (bar + effects.axial_preload(10.0)).nominal().receptance())
    with refused(r"shear_and_rotary_inertia was added to a bar"):
        jax.eval_shape(lambda: (bar + effects.shear_and_rotary_inertia()).nominal().receptance())


def test_effects_on_what_the_experiment_has_not_are_refused():
    base = experiment()
    with refused(r'on "s9" was added, but the experiment has the sensors s1, s2 and'):
        base + effects.gain_error("s9", 0.1)
    with refused(r'on sensor "s9"'):
        base + effects.mount_resonance("s9", 100.0, 0.1)
    with refused(r'on sensor "s9"'):
        base + effects.swapped_sensors("s1", "s9")
    two = [bp.Sensor("s1", at=0.3, directions=(3, -3)), bp.Sensor("s2", at=0.9)]
    with refused(r'sensors "s1" and "s2" were given, but they have 2 and 1 channels'):
        experiment(sensors=two) + effects.swapped_sensors("s1", "s2")
    with refused(r'no effect "rust" to leave out.*has point_mass'):
        (base + effects.point_mass(0.3, 1.0)).without("rust")
    with refused(r"no effect 'point_mas'. Did you mean 'point_mass'\?"):
        effects.library(base, ["point_mas"])
    with refused(r"no effect 'mass'. Did you mean 'point_mass' or .*'sensor_mass'.*\?"):
        effects.library(base, ["mass"])
    with refused(r"no effect 'rust'. The effects are point_mass"):
        effects.library(base, ["rust"])


def test_what_depends_on_the_amplitude_needs_the_force_and_is_alone():
    sprung = experiment() + effects.cubic_stiffness(0.5, 1e8)
    with refused(r"no force is known; .*: Experiment\(..., force_levels="):
        jax.eval_shape(lambda: sprung.nominal().receptance())
    two = experiment(force_levels=[1.0]) + effects.cubic_stiffness(0.5, 1e8)
    two = two + effects.gap(0.7, 1e8, 1e-6, name="other")
    with refused(r"2 attachments that depend on the .*, cubic_stiffness and other; at most one is"):
        jax.eval_shape(lambda: two.nominal().receptance())


def test_modes_alone_do_not_tell_the_section():
    bare = bp.Structure(Bare(), damping=bp.damping.Modal(0.02))
    with refused(r"This effect was added to Bare.*Use beams.bar or beams.beam"):
        (bare + effects.local_stiffness_loss(0.5, 0.1, 0.5)).proper_modes()
    # What is attached needs no section, and a plain modal sum no stiffness.
    loaded = bare + effects.point_mass(0.5, 1.0)
    place = Points(jnp.array([0.3]), np.ones((1, 1)))
    value = jax.jit(lambda: receptance(loaded, place, place, jnp.array([20.0])))()[0, 0, 0]
    modal = 1 / (900 - 400 + 2j * 0.02 * 30 * 20 - 400 * np.sin(0.5) ** 2)
    np.testing.assert_allclose(value, np.sin(0.3) ** 2 * modal, rtol=1e-12)


def test_a_quadrature_over_places_is_refused_with_an_effect_on_the_instruments():
    loaded = experiment() + effects.sensor_mass(dist.Uniform(0.0, 0.1))
    data = experiment().data(experiment().nominal_measurement())
    with refused(r'effect "sensor_mass" on its instruments.*Use marginals.Latent\(\)'):
        bp.marginals.Quadrature().model(loaded, data, jax.random.PRNGKey(0))


# ------------------------------------------------------------------------------ one's own


class Inerter(Attachment):
    """A spring in series with an inerter between one place and the ground [N/m, kg]."""

    absent: ClassVar[tuple[str, float]] = ("inertance", 0.0)
    at: Any = eqx.field(metadata={"unit": "m"})
    inertance: Any = eqx.field(metadata={"unit": "kg"})
    stiffness: Any = eqx.field(metadata={"unit": "N/m"})
    name: str = eqx.field(static=True, default="inerter", kw_only=True)

    def dynamic_stiffness(self, omega):
        inerter_stiffness = -(omega**2) * self.inertance
        return inerter_stiffness * self.stiffness / (self.stiffness + inerter_stiffness)

    @classmethod
    def suggest(cls, scales) -> Sequence["Inerter"]:
        priors = dist.LogUniform(1e-2, 10.0), dist.LogUniform(1e2, 1e6)
        return [cls(place, *priors) for place in scales.places()]


def test_an_effect_of_ones_own_is_a_class_of_two_short_methods():
    base = experiment()
    library = effects.library(base, ["point_mass"], further=[Inerter])
    assert library.kinds == ["point_mass", "inerter"]
    extended = base + library.effects[-1]
    names = [unknown.name for unknown in extended.unknowns if "inerter" in unknown.name]
    assert names == [
        f"structure.effects.inerter.{word}" for word in ("at", "inertance", "stiffness")
    ]
    assert [extended.unknown[name].unit for name in names] == ["m", "kg", "N/m"]
    # A very stiff spring leaves the inerter, which is felt as a mass.
    known = dict(zip(names, (0.5, 2.0, 1e15), strict=True))
    places = {"sensor.s1.position": 0.3}
    receptance = compiled(bp.Experiment.receptance)(extended.fix(known | places))
    mass = base.fix(places) + effects.point_mass(0.5, 2.0)
    np.testing.assert_allclose(receptance, compiled(bp.Experiment.receptance)(mass), rtol=1e-6)


@pytest.mark.parametrize(("motion", "unit"), [("rotation", "rad/(N m)"), ("translation", "m/N")])
def test_the_unit_of_a_compliance_is_that_of_its_motion(motion, unit):
    support = effects.compliant_support(dist.Uniform(0.0, 1e-6), motion=motion)
    assert [unknown.unit for unknown in unknowns(support)] == [unit]
    assert repr(support).count(unit) == 1


# ------------------------------------------------------------------------- what is tried


def test_what_is_not_tried_by_default_is_tried_by_its_name(monkeypatch):
    monkeypatch.setattr(effects.time_delay, "tried_by_default", False)
    base = experiment()
    assert "time_delay" not in effects.library(base).kinds
    assert {"point_mass", "gain_error"} <= set(effects.library(base).kinds)
    for kind in ("time_delay", effects.time_delay):
        assert effects.library(base, [kind]).kinds == ["time_delay"]
    assert "time_delay" in effects.library(base, further=[effects.time_delay]).kinds
