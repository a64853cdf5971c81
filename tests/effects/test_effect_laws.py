"""effect laws: one table, effects by laws, and what must hold for every one of them."""

import dataclasses
import functools
from collections import OrderedDict

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from bayes_placement import (
    Actuator,
    Experiment,
    Sensor,
    Structure,
    beams,
    damping,
    effects,
    noise,
    observe,
)
from bayes_placement.effects import EFFECTS as REGISTERED
from bayes_placement.effects import InstrumentEffect
from bayes_placement.effects.instruments import Instruments
from bayes_placement.experiment.recording import Drive, recorded

LENGTH = 1.3
BAR = {"length": LENGTH, "area": 1e-3, "youngs_modulus": 1e9, "density": 9000.0}
BEAM = BAR | {"second_moment": 4e-8}
MODES = 12

# No symmetric place, no resonance hit exactly: symmetric targets hide sign bugs.
PLACES = np.array([0.17, 0.61, 1.19])
OMEGA = 2 * np.pi * np.array([4.0, 21.0, 77.0, 160.0])
BOTH = jnp.asarray(np.concatenate([OMEGA, -OMEGA]))
AHEAD = slice(0, OMEGA.size)
AT = 0.47

# Name: an effect of a strength at a place, and a strength at which it is clearly felt.
EFFECTS = {
    "point_mass": (lambda a, x: effects.point_mass(x, a), 3.0),
    "ground_spring": (lambda a, x: effects.ground_spring(x, a), 3e4),
    "ground_dashpot": (lambda a, x: effects.ground_dashpot(x, a), 200.0),
    "tuned_absorber": (lambda a, x: effects.tuned_absorber(x, a, 20.0, 0.05), 1.5),
    "local_stiffness_loss": (lambda a, x: effects.local_stiffness_loss(x, 0.06, a), 0.6),
    "hysteretic_damping": (lambda a, x: effects.hysteretic_damping(0.06, share=a), 0.8),
    "viscoelastic_modulus": (lambda a, x: effects.viscoelastic_modulus(a, 2e-3), 0.3),
    "compliant_support": (lambda a, x: effects.compliant_support(a), 0.02),
    "compliant_support moved": (
        lambda a, x: effects.compliant_support(a, motion="translation"),
        1e-3,
    ),
    "axial_preload": (lambda a, x: effects.axial_preload(a), 200.0),
    "shear_and_rotary_inertia": (lambda a, x: effects.shear_and_rotary_inertia(share=a), 1.0),
    "cubic_stiffness": (lambda a, x: effects.cubic_stiffness(x, a), 1e9),
    "residual_modes": (lambda a, x: effects.residual_modes(a * np.ones((3, 3))), 1e-5),
    "sensor_mass": (lambda a, x: effects.sensor_mass(a), 0.5),
    "time_delay": (lambda a, x: effects.time_delay(a), 1e-3),
    "gain_error": (lambda a, x: effects.gain_error("s2", a), 0.3),
    "mount_resonance": (lambda a, x: effects.mount_resonance("s2", a, 0.1), 250.0),
    "misplaced_sensor": (lambda a, x: effects.misplaced_sensor("s2", a), 0.2),
    "reversed_sensor": (lambda a, x: effects.reversed_sensor("s2", a), 1.0),
    "swapped_sensors": (lambda a, x: effects.swapped_sensors("s1", "s3", a), 1.0),
}
STRUCTURAL = [
    name for name, (make, _) in EFFECTS.items() if not isinstance(make(0.5, AT), InstrumentEffect)
]
PASSIVE = [name for name in STRUCTURAL if name != "cubic_stiffness"]
# What they are on a line is in the table; on finite element models see effects/test_on_models.py.
ON_MODELS = {"member_preload", "region_stiffness_loss", "soft_support"}
table = pytest.mark.parametrize("name", EFFECTS)


@functools.cache
def structure(ends="fixed-free", kind="beam", modes=MODES):
    quantities = BEAM if kind == "beam" else BAR
    line = getattr(beams, kind)(modes, **quantities, ends=ends)
    return Structure(line, damping=damping.Modal([0.01, 0.03, 0.02]))


def response(base, several, places=PLACES, omega=BOTH, mounted="fixed"):
    """Receptance [sensor, actuator, frequency], read and driven at the same places."""
    chain = [one for one in several if isinstance(one, InstrumentEffect)]
    for one in several:
        if one not in chain:
            base = base + one
    sides = [
        OrderedDict(
            (f"{letter}{i}", kind(f"{letter}{i}", at=x).on(base.modes))
            for i, x in enumerate(places, start=1)
        )
        for letter, kind in (("s", Sensor), ("a", Actuator))
    ]
    force = jnp.full(omega.shape, 3.0)
    return recorded(base, Instruments(*sides), chain, Drive(omega, force, mounted))


def one_effect(name):
    make = EFFECTS[name][0]
    return lambda strength, place, places=PLACES: response(
        structure(), [make(strength, place)], places
    )


@functools.cache
def compiled(name):
    return jax.jit(one_effect(name))


@functools.cache
def found(name):
    return np.asarray(compiled(name)(EFFECTS[name][1], AT, PLACES))


@functools.cache
def without():
    # Places are no constants here, of which a compiler may compute the shapes in another way.
    return np.asarray(jax.jit(lambda places: response(structure(), [], places))(PLACES))


def absent(name) -> float:
    return EFFECTS[name][0](0.5, AT).absent[1]


def test_the_table_has_every_effect():
    names = {name.split()[0] for name in EFFECTS}
    made = {make(0.5, AT).name for make, _ in EFFECTS.values()}
    assert names == made == {*REGISTERED} - ON_MODELS
    assert len(names) == 19


@table
def test_zero_strength_is_the_identity_bit_for_bit(name):
    np.testing.assert_array_equal(compiled(name)(absent(name), AT, PLACES), without())
    assert np.abs(found(name) / without() - 1).max() > 1e-3


@pytest.mark.parametrize("mounted", ["roving", "fixed"])
def test_no_mass_is_the_identity_however_sensors_are_mounted(mounted):
    def read(mass, places):
        return response(structure(), [effects.sensor_mass(mass)], places, mounted=mounted)

    several = jax.jit(read)
    np.testing.assert_array_equal(several(0.0, PLACES), without())
    assert np.abs(several(0.5, PLACES) / without() - 1).max() > 1e-2


@pytest.mark.parametrize("name", STRUCTURAL)
@pytest.mark.parametrize("ends", ["free-free", "pinned-fixed"])
def test_zero_strength_is_the_identity_on_other_structures(name, ends):
    one = structure(ends)
    side = {"end": "right", "motion": "rotation"} if ends == "pinned-fixed" else None
    if name.startswith("compliant") and side is None:
        pytest.skip("nothing holds a free beam")

    def read(strength):
        effect = EFFECTS[name][0](strength, AT)
        if name.startswith("compliant"):
            effect = effects.compliant_support(strength, **side)
        return response(one, [effect])

    np.testing.assert_array_equal(jax.jit(read)(absent(name)), jax.jit(lambda: response(one, []))())


@pytest.mark.parametrize("name", PASSIVE)
def test_receptance_is_symmetric(name):
    size = np.abs(found(name)).max(axis=(0, 1))
    turned = np.swapaxes(found(name), 0, 1)
    np.testing.assert_allclose(found(name) / size, turned / size, atol=1e-13)


@table
def test_negative_frequencies_are_conjugate(name):
    ahead, behind = np.split(found(name), 2, axis=-1)
    np.testing.assert_allclose(behind, np.conj(ahead), rtol=1e-13)


@pytest.mark.parametrize("name", PASSIVE)
def test_passive_effects_dissipate(name):
    # Any set of forces together: the imaginary part is negative semi-definite.
    eigenvalues = np.linalg.eigvalsh(np.moveaxis(found(name)[..., AHEAD].imag, -1, 0))
    assert np.all(eigenvalues.max(axis=1) < 1e-12 * np.abs(eigenvalues).max(axis=1))


def test_a_cubic_spring_dissipates_at_every_driving_point():
    assert np.all(np.diagonal(found("cubic_stiffness")[..., AHEAD]).imag < 0)


@pytest.mark.parametrize("name", STRUCTURAL)
def test_seen_from_the_other_end_nothing_changes(name):
    def turned(strength):
        effect = EFFECTS[name][0](strength, LENGTH - AT)
        if name.startswith("compliant"):
            effect = effects.compliant_support(strength, end="right", motion=effect.motion)
        return response(structure("free-fixed"), [effect], LENGTH - PLACES, BOTH[AHEAD])

    expected = found(name)[..., AHEAD]
    seen = jax.jit(turned)(EFFECTS[name][1])
    np.testing.assert_allclose(seen, expected, atol=1e-9 * np.abs(expected).max())


@table
def test_vmap_equals_loop_and_slopes_are_those_of_finite_differences(name):
    strength, steps = EFFECTS[name][1], 1e-5 * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    strengths, places = strength * (1 + steps[:, 0]), AT + steps[:, 1]
    function = one_effect(name)

    def along(strength, place):
        slopes = jax.jvp(function, (strength, place), (strength, 0.0))[1]
        return (
            function(strength, place),
            slopes,
            jax.jvp(function, (strength, place), (0.0, 1.0))[1],
        )

    values, by_strength, by_place = jax.jit(jax.vmap(along))(strengths, places)
    np.testing.assert_allclose(values[0], found(name), rtol=1e-8)
    size = np.abs(found(name)).max()
    for slopes, (up, down) in ((by_strength, (1, 2)), (by_place, (3, 4))):
        differences = (values[up] - values[down]) / 2e-5
        np.testing.assert_allclose(slopes[0] / size, differences / size, rtol=1e-4, atol=2e-6)


@pytest.mark.parametrize("name", ["tuned_absorber"])
def test_jit_equals_no_jit(name):
    plain = one_effect(name)(EFFECTS[name][1], AT)
    np.testing.assert_allclose(plain, found(name), rtol=1e-9)


COMBINED = [
    ("point_mass", "local_stiffness_loss", "sensor_mass"),
    ("axial_preload", "shear_and_rotary_inertia", "compliant_support"),
    ("hysteretic_damping", "viscoelastic_modulus", "ground_spring", "cubic_stiffness"),
    ("gain_error", "time_delay", "mount_resonance", "residual_modes"),
]


@pytest.mark.parametrize("names", COMBINED, ids=" ".join)
def test_the_order_of_adding_is_of_no_consequence(names):
    def read(ordered):
        experiment = Experiment(
            structure(),
            sensors=[Sensor(f"s{i}", at=float(x)) for i, x in enumerate(PLACES, start=1)],
            actuators=[Actuator(f"a{i}", at=float(x)) for i, x in enumerate(PLACES, start=1)],
            frequency=OMEGA / (2 * np.pi),
            observe=observe.Complex("displacement"),
            noise=noise.Gaussian(1e-9),
            force_levels=[3.0],
        )
        for name in ordered:
            make, strength = EFFECTS[name]
            experiment = experiment + make(strength, AT)
        return jax.jit(lambda: experiment.receptance())()

    np.testing.assert_array_equal(read(names), read(names[::-1]))


def test_attachments_one_after_the_other_are_those_of_a_dense_solve():
    names = ["point_mass", "ground_spring", "ground_dashpot", "tuned_absorber"]
    places = [0.23, 0.47, 0.61, 1.3]
    several = [EFFECTS[n][0](EFFECTS[n][1], x) for n, x in zip(names, places, strict=True)]
    mass = 0.5
    one_by_one = jax.jit(
        lambda: response(structure(), [*several, effects.sensor_mass(mass)], omega=BOTH[AHEAD])
    )()
    plain = jax.jit(lambda: response(structure(), [], [*PLACES, *places], BOTH[AHEAD]))()
    added = np.zeros((OMEGA.size, 7), complex)
    added[:, :3] = -(OMEGA[:, None] ** 2) * mass
    added[:, 3:] = np.array([one.dynamic_stiffness(jnp.asarray(OMEGA)) for one in several]).T
    whole = np.moveaxis(np.asarray(plain), -1, 0)
    dense = np.linalg.solve(np.eye(7) + whole * added[:, None, :], whole)[:, :3, :3]
    size = np.abs(dense).max()
    np.testing.assert_allclose(np.moveaxis(one_by_one, -1, 0), dense, atol=1e-12 * size)


@pytest.mark.parametrize(
    "name", ["point_mass", "ground_spring", "ground_dashpot", "tuned_absorber"]
)
def test_two_halves_at_one_place_make_one(name):
    make, strength = EFFECTS[name]

    def halves(strength):
        one = make(strength / 2, AT)
        return response(structure(), [one, dataclasses.replace(one, name="the other")])

    seen = jax.jit(halves)(strength)
    np.testing.assert_allclose(seen, found(name), atol=1e-12 * np.abs(found(name)).max())


def test_two_cracks_of_half_the_flexibility_make_one():
    # Flexibility grows by loss / (1 - loss); two halves lie side by side within the extent.
    half = (0.6 / 0.4) / 2
    loss = half / (1 + half)
    several = [effects.local_stiffness_loss(AT, 0.06, loss, name=name) for name in ("one", "other")]
    seen = jax.jit(lambda: response(structure(), several))()
    expected = found("local_stiffness_loss")
    np.testing.assert_allclose(seen, expected, atol=1e-6 * np.abs(expected).max())


CONVERGING = [
    "point_mass",
    "local_stiffness_loss",
    "compliant_support",
    "compliant_support moved",
    "axial_preload",
    "sensor_mass",
]


@pytest.mark.parametrize("name", CONVERGING)
def test_results_do_not_depend_on_the_number_of_modes(name):
    natural = np.asarray(structure(modes=120).modes.natural_frequency)
    band = np.linspace(0.4 * natural[0], np.sqrt(natural[5] * natural[6]), 300)

    def read(modes):
        one = EFFECTS[name][0](EFFECTS[name][1], AT)
        omega = jnp.asarray(2 * np.pi * band)
        return np.asarray(jax.jit(lambda: response(structure(modes=modes), [one], omega=omega))())

    exact = read(120)
    size = np.sqrt(np.mean(np.abs(exact) ** 2, axis=-1, keepdims=True))
    errors = [np.sqrt(np.mean(np.abs((read(modes) - exact) / size) ** 2)) for modes in (20, 30)]
    assert errors[0] < 1e-3
    assert errors[1] < 2e-4
