"""General laws of receptances hold for every effect of the registry, on a cantilever."""

import dataclasses
import functools
import itertools
from collections import OrderedDict
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro.distributions import Distribution, LogUniform, Uniform
from scipy.special import ndtri

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
from bayes_placement.effects import EFFECTS, InstrumentEffect, Scales
from bayes_placement.effects.effect import AtPlace
from bayes_placement.effects.instruments import Instruments
from bayes_placement.experiment.recording import Drive, recorded
from bayes_placement.experiment.with_effects_applied import with_effects_applied
from bayes_placement.inference.coordinates import Coordinates
from tests.effects import models_in_space

LENGTH = 1.3
BEAM = {
    "length": LENGTH,
    "area": 1e-3,
    "second_moment": 4e-8,
    "youngs_modulus": 1e9,
    "density": 9000.0,
}
MODES = 12

# No symmetric place, no resonance hit exactly: symmetric targets hide sign bugs.
PLACES = np.array([0.17, 0.61, 1.19])
OMEGA = 2 * np.pi * np.array([4.0, 21.0, 77.0, 160.0])
BOTH = jnp.asarray(np.concatenate([OMEGA, -OMEGA]))
AHEAD = slice(0, OMEGA.size)
AT = 0.47
FORCE = 3.0
STRONG = 0.7  # share of the prior of a strength that is weaker


@functools.cache
def structure(ends="fixed-free", modes=MODES):
    line = beams.beam(modes, **BEAM, ends=ends)
    return Structure(line, damping=damping.Modal([0.01, 0.03, 0.02]))


def experiment(base):
    return Experiment(
        base,
        sensors=[Sensor(f"s{i}", at=float(x)) for i, x in enumerate(PLACES, start=1)],
        actuators=[Actuator(f"a{i}", at=float(x)) for i, x in enumerate(PLACES, start=1)],
        frequency=OMEGA / (2 * np.pi),
        observe=observe.Complex("displacement"),
        noise=noise.Gaussian(1e-9),
        force_levels=[FORCE],
    )


# ------------------------------------------------------------------------------ the table


class Row(NamedTuple):
    """An effect with numbers in the place of its priors, and the strength that they make likely."""

    effect: Any
    strength: Any

    def at(self, strength, place):
        """The effect of a strength at a place, if it has one."""
        effect = replaced(self.effect, self.effect.absent[0], strength)
        return replaced(effect, "at", place) if "at" in effect.place_fields else effect

    @property
    def absent(self) -> float:
        return self.effect.absent[1]


def replaced(effect, field, value):
    return eqx.tree_at(lambda tree: getattr(tree, field), effect, value, is_leaf=is_prior)


def is_prior(leaf):
    return isinstance(leaf, Distribution)


def quantile(distribution, share):
    if not is_prior(distribution):
        return distribution
    coordinates = Coordinates({"value": distribution})
    score = np.full((1, coordinates.dimension), ndtri(share))
    (value,) = coordinates.named(score)["value"]
    return value if np.ndim(value) else float(value)


def row(candidate):
    """All at the middle of their priors; the strength far from absence."""
    field, absent = candidate.absent
    prior = getattr(candidate, field)
    strength = quantile(prior, 1 - STRONG if np.isinf(absent) else STRONG)
    numbers = jax.tree.map(lambda leaf: quantile(leaf, 0.5), candidate, is_leaf=is_prior)
    return Row(replaced(numbers, field, strength), strength)


MOUNT = effects.Spring(2e3) - effects.Dashpot(9.0) | effects.Mass(0.2)
CLAMP = effects.LossySpring(90.0, 0.2)
TWICE = Uniform(0.0, 2.0)
OWN = {
    "attached": effects.attached(AT, MOUNT, TWICE),
    "over": effects.over(AT, 0.4, MOUNT, TWICE),
    "inserted": effects.inserted(AT, CLAMP, TWICE),
    "modulus": effects.modulus(effects.LossySpring(0.2, 0.3), TWICE),
    "beyond_prior": effects.beyond_prior(
        "structure.modes.youngs_modulus", Uniform(1e9, 1.5e9), end=1e9
    ),
    # On none of the lines is there hum of 50 or 60 Hz: these are close to 80 and 160 Hz.
    "mains_hum": effects.mains_hum(
        *("s2", LogUniform(1e-2, 10.0), Uniform(-3.0, 2.0), 40.0, 4.0),
        quantity="velocity",
        side="sensor",
    ),
}
"""Effects of which none is suggested on the cantilever."""


def rows():
    """Each effect that can act on the cantilever, once for each motion of a support."""
    base = experiment(structure())
    table = {}
    for word, kind in EFFECTS.items():
        candidates = [OWN[word]] if word in OWN else kind.suggest(Scales(base))
        variants = [row(candidate) for candidate in candidates]
        motions = {getattr(case.effect, "motion", ""): case for case in reversed(variants)}
        table |= {f"{word} {motion}".strip(): case for motion, case in reversed(motions.items())}
    return table


ROWS = rows()
STRUCTURAL = [name for name, case in ROWS.items() if not isinstance(case.effect, InstrumentEffect)]
OF_AMPLITUDE = [
    name for name, case in ROWS.items() if isinstance(case.effect, effects.AmplitudeAttachment)
]
ATTACHED = [name for name, case in ROWS.items() if isinstance(case.effect, effects.Attachment)]
PASSIVE = [name for name in STRUCTURAL if name not in OF_AMPLITUDE]
table = pytest.mark.parametrize("name", ROWS)
LONG, LONGEST = [pytest.mark.long], [pytest.mark.long, pytest.mark.longest]


def response(base, additions, places=PLACES, omega=BOTH, mounted="fixed"):
    """Receptance [sensor, actuator, frequency], read and driven at the same places."""
    on_instruments = [effect for effect in additions if isinstance(effect, InstrumentEffect)]
    for effect in additions:
        if effect not in on_instruments:
            base = base + effect
    sides = [
        OrderedDict(
            (f"{letter}{i}", kind(f"{letter}{i}", at=x).on(base.modes))
            for i, x in enumerate(places, start=1)
        )
        for letter, kind in (("s", Sensor), ("a", Actuator))
    ]
    force = jnp.full(omega.shape, FORCE)
    return recorded(base, Instruments(*sides), on_instruments, Drive(omega, force, mounted))


def one_effect(name):
    return lambda strength, place, places=PLACES: response(
        structure(), [ROWS[name].at(strength, place)], places
    )


@functools.cache
def compiled(name):
    return jax.jit(one_effect(name))


@functools.cache
def affected(name):
    return np.asarray(compiled(name)(ROWS[name].strength, AT, PLACES))


@functools.cache
def without(ends="fixed-free"):
    # Places are no constants here, of which a compiler may compute the shapes in another way.
    return np.asarray(jax.jit(lambda places: response(structure(ends), [], places))(PLACES))


def test_every_effect_of_the_registry_is_tested():
    tested = {name.split()[0] for name in ROWS} | {*models_in_space.suggested()}
    assert tested == {*EFFECTS}
    assert {case.effect.name for case in ROWS.values()} <= tested
    assert ("compliant_support rotation" in ROWS) and ("compliant_support translation" in ROWS)


# ------------------------------------------------------------------------------ the laws


# Their strength makes numbers of the modes inputs of the program, by which a compiler divides in
# another way than by constants; `test_dimension_error` and `test_beyond_prior` compare them with a
# structure of which these are inputs.
OF_MODES = ("dimension_error", "beyond_prior")


@pytest.mark.parametrize("name", [name for name in ROWS if name not in OF_MODES])
def test_zero_strength_is_the_identity_bit_for_bit(name):
    absent = ROWS[name].absent * np.ones_like(ROWS[name].strength)
    np.testing.assert_array_equal(compiled(name)(absent, AT, PLACES), without())
    assert np.abs(affected(name) / without() - 1).max() > 1e-3


@pytest.mark.parametrize("mounted", ["roving", "fixed"])
def test_no_mass_is_the_identity_however_sensors_are_mounted(mounted):
    def read(mass, places):
        return response(structure(), [effects.sensor_mass(mass)], places, mounted=mounted)

    receptance = jax.jit(read)
    np.testing.assert_array_equal(receptance(0.0, PLACES), without())
    assert np.abs(receptance(0.5, PLACES) / without() - 1).max() > 1e-2


@pytest.mark.parametrize("ends", ["free-free", pytest.param("pinned-fixed", marks=LONGEST)])
def test_zero_strengths_are_the_identity_on_other_structures(ends):
    """All effects on the structure at once, each of which is one alone on the cantilever."""
    kinds_by_name = effects.library(experiment(structure(ends)), [*EFFECTS]).effects
    candidates = [row(effect) for effect in [*kinds_by_name, *OWN.values()]]
    kinds = {case.effect.name: case for case in candidates}
    for name in (*OF_MODES, *OF_AMPLITUDE[1:]):  # at most one depends on the amplitude
        del kinds[name]
    structural = [case for case in kinds.values() if not isinstance(case.effect, InstrumentEffect)]
    assert len(structural) >= len({ROWS[name].effect.name for name in STRUCTURAL}) - 5

    def read(strengths, places):
        pairs = zip(structural, strengths, strict=True)
        return response(
            structure(ends), [candidate.at(value, AT) for candidate, value in pairs], places
        )

    absent = [candidate.absent for candidate in structural]
    np.testing.assert_array_equal(jax.jit(read)(absent, PLACES), without(ends))


@pytest.mark.parametrize("name", PASSIVE)
def test_receptance_is_symmetric(name):
    size = np.abs(affected(name)).max(axis=(0, 1))
    swapped = np.swapaxes(affected(name), 0, 1)
    np.testing.assert_allclose(affected(name) / size, swapped / size, atol=1e-13)


@table
def test_negative_frequencies_are_conjugate(name):
    ahead, behind = np.split(affected(name), 2, axis=-1)
    np.testing.assert_allclose(behind, np.conj(ahead), rtol=1e-13)


@pytest.mark.parametrize("name", PASSIVE)
def test_passive_effects_dissipate(name):
    # Any set of forces together: the imaginary part is negative semi-definite.
    eigenvalues = np.linalg.eigvalsh(np.moveaxis(affected(name)[..., AHEAD].imag, -1, 0))
    assert np.all(eigenvalues.max(axis=1) < 1e-12 * np.abs(eigenvalues).max(axis=1))


@pytest.mark.parametrize("name", OF_AMPLITUDE)
def test_what_depends_on_the_amplitude_dissipates_at_every_driving_point(name):
    assert np.all(np.diagonal(affected(name)[..., AHEAD]).imag < 0)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            name, marks=[] if name in STRUCTURAL[::2] else LONG if name in STRUCTURAL else LONGEST
        )
        for name in ROWS
    ],
)
def test_vmap_equals_loop_and_slopes_are_those_of_finite_differences(name):
    strength = np.asarray(ROWS[name].strength, float)
    # There, there, and a step to either side in strength and in place.
    steps = 1e-5 * np.array([[0, 0], [0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
    scale = (1 + steps[:, 0]).reshape(-1, *[1] * strength.ndim)
    tangents = np.zeros((6, *strength.shape)), np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])
    tangents[0][0] = strength

    def along(strength, place, *tangents):
        return jax.jvp(one_effect(name), (strength, place), tangents)

    points = strength * scale, AT + steps[:, 1]
    values, slopes = jax.jit(jax.vmap(along))(*points, *tangents)
    np.testing.assert_allclose(values[0], affected(name), rtol=1e-8)
    size = np.abs(affected(name)).max()
    for slope, (up, down) in zip(slopes, ((2, 3), (4, 5)), strict=False):
        differences = (values[up] - values[down]) / 2e-5
        np.testing.assert_allclose(slope / size, differences / size, rtol=1e-4, atol=2e-6)


@pytest.mark.long
def test_jit_equals_no_jit(name="tuned_absorber"):
    plain = one_effect(name)(ROWS[name].strength, AT)
    np.testing.assert_allclose(plain, affected(name), rtol=1e-9)


# ------------------------------------------------------------------------- several effects

GROUPED = 8
# Those that depend on the amplitude come one after the other, so that each has a group of its own.
IN_TURN = sorted(ROWS, key=lambda name: name in OF_AMPLITUDE)
GROUPS = [tuple(IN_TURN[start::GROUPED]) for start in range(GROUPED)]


def in_groups(*marks):
    """Each group compiles all its effects at once: those without marks of theirs are longest."""
    each = itertools.zip_longest(GROUPS, marks, fillvalue=LONGEST)
    cases = [pytest.param(names, marks=own) for names, own in each]
    return pytest.mark.parametrize("names", cases, ids=" ".join)


one_by_default = in_groups([], LONG)


def group(names, place):
    """Effects of different names, as several of one kind must not share one."""
    return [
        dataclasses.replace(ROWS[name].at(ROWS[name].strength, place), name=f"{number}")
        for number, name in enumerate(names)
    ]


@functools.cache
def together(names):
    base = experiment(structure())
    for effect in group(names, AT):
        base = base + effect
    return np.asarray(jax.jit(lambda: base.receptance())())


@one_by_default
def test_the_order_of_adding_is_of_no_consequence(names):
    base = experiment(structure())
    for effect in group(names, AT)[::-1]:
        base = base + effect
    np.testing.assert_array_equal(jax.jit(lambda: base.receptance())(), together(names))


@in_groups(LONGEST, LONG)
def test_applied_beforehand_they_give_the_same_response(names):
    base = experiment(structure())
    for effect in group(names, AT):
        base = base + effect
    expected = together(names)
    seen = jax.jit(lambda: with_effects_applied(base).receptance())()
    np.testing.assert_allclose(seen, expected, rtol=1e-9, atol=1e-13 * np.abs(expected).max())


@one_by_default
def test_seen_from_the_other_end_nothing_changes(names):
    # Places count from the left end: a line that is longer at its right end has no such mirror.
    names = tuple(name for name in names if name != "dimension_error")
    ends = {"left": "right", "right": "left"}
    mirrored = [
        dataclasses.replace(effect, end=ends[effect.end])
        if effect.__dict__.get("end") in ends
        else effect
        for effect in group(names, LENGTH - AT)
    ]
    mirrored = [
        replaced(effect, "shift", -effect.shift) if "shift" in effect.place_fields else effect
        for effect in mirrored
    ]

    def read(places):
        return response(structure("free-fixed"), mirrored, places, BOTH[AHEAD], "roving")

    expected = np.squeeze(together(names))  # without its only force level
    seen = jax.jit(read)(LENGTH - PLACES)
    np.testing.assert_allclose(seen, expected, atol=1e-9 * np.abs(expected).max())


def test_attachments_one_after_the_other_are_those_of_a_dense_solve():
    at_points = [name for name in ATTACHED if type(ROWS[name].effect).points is AtPlace.points]
    places = np.linspace(0.23, 1.3, len(at_points))
    parts = [ROWS[n].at(ROWS[n].strength, x) for n, x in zip(at_points, places, strict=True)]
    mass = 0.5
    one_by_one = jax.jit(
        lambda: response(structure(), [*parts, effects.sensor_mass(mass)], omega=BOTH[AHEAD])
    )()
    plain = jax.jit(lambda: response(structure(), [], [*PLACES, *places], BOTH[AHEAD]))()
    count = len(PLACES) + len(places)
    added = np.zeros((OMEGA.size, count), complex)
    added[:, :3] = -(OMEGA[:, None] ** 2) * mass
    added[:, 3:] = np.array([part.dynamic_stiffness(jnp.asarray(OMEGA)) for part in parts]).T
    matrix = np.moveaxis(np.asarray(plain), -1, 0)
    dense = np.linalg.solve(np.eye(count) + matrix * added[:, None, :], matrix)[:, :3, :3]
    size = np.abs(dense).max()
    np.testing.assert_allclose(np.moveaxis(one_by_one, -1, 0), dense, atol=1e-12 * size)


@pytest.mark.parametrize("name", ATTACHED)
def test_two_halves_at_one_place_make_one(name):
    def halves(strength):
        half = ROWS[name].at(strength / 2, AT)
        return response(structure(), [half, dataclasses.replace(half, name="the other")])

    seen = jax.jit(halves)(ROWS[name].strength)
    np.testing.assert_allclose(seen, affected(name), atol=1e-12 * np.abs(affected(name)).max())


def test_two_cracks_of_half_the_flexibility_make_one():
    # Flexibility grows by loss / (1 - loss); two halves lie side by side within the extent.
    crack = ROWS["local_stiffness_loss"]
    half = crack.strength / (1 - crack.strength) / 2
    cracks = [
        dataclasses.replace(crack.at(half / (1 + half), AT), name=name) for name in ("one", "other")
    ]
    seen = jax.jit(lambda: response(structure(), cracks))()
    expected = affected("local_stiffness_loss")
    np.testing.assert_allclose(seen, expected, atol=1e-6 * np.abs(expected).max())


CONVERGING = {
    "mass and crack": [
        effects.point_mass(AT, 3.0),
        effects.local_stiffness_loss(AT, 0.06, 0.6),
    ],
    "clamp": [effects.compliant_support(0.02)],
    "tension": [effects.axial_preload(200.0)],
    "sensors": [effects.sensor_mass(0.5)],
    "seat": [effects.compliant_support(1e-3, motion="translation")],
}


@pytest.mark.parametrize(
    "case",
    [
        "mass and crack",
        "seat",
        *(pytest.param(n, marks=LONG) for n in ("clamp", "tension", "sensors")),
    ],
)
def test_results_do_not_depend_on_the_number_of_modes(case):
    additions = CONVERGING[case]
    natural = np.asarray(structure(modes=120).modes.natural_frequency)
    band = np.linspace(0.4 * natural[0], np.sqrt(natural[5] * natural[6]), 300)

    def read(modes):
        omega = jnp.asarray(2 * np.pi * band)
        return np.asarray(
            jax.jit(lambda: response(structure(modes=modes), additions, omega=omega))()
        )

    exact = read(120)
    size = np.sqrt(np.mean(np.abs(exact) ** 2, axis=-1, keepdims=True))
    errors = [np.sqrt(np.mean(np.abs((read(modes) - exact) / size) ** 2)) for modes in (20, 30)]
    assert errors[0] < 1e-3
    assert errors[1] < 2e-4


# ------------------------------------------------------------------ effects on actuators


class LoadedActuator(InstrumentEffect):
    """A mass and a spring at the point of drive, and a factor on its record."""

    absent = ("mass", 0.0)
    actuator: Any
    mass: Any
    name: str = eqx.field(static=True, default="loaded_actuator", kw_only=True)
    loads = ("actuator",)

    def load(self, side, number, omega):
        return (self.actuator == number) * -(omega**2) * self.mass

    def recorded(self, frf, omega, instruments):
        return frf * (1 + instruments.of(self.actuator, "actuator")[:, None] * self.mass)

    @classmethod
    def suggest(cls, scales):
        return []


@pytest.mark.parametrize("mounted", ["roving", "fixed"])
def test_effects_act_on_actuators_too(mounted):
    def read(mass, places):
        return response(structure(), [LoadedActuator(1, mass)], places, mounted=mounted)

    loaded = jax.jit(read)
    np.testing.assert_array_equal(loaded(0.0, PLACES), without())
    # It loads the structure in its own runs only, and multiplies its own record only.
    mass = 0.5
    alone = compiled("point_mass")(mass, PLACES[1], PLACES)
    expected = without().copy()
    expected[:, 1] = (1 + mass) * np.asarray(alone)[:, 1]
    np.testing.assert_allclose(loaded(mass, PLACES), expected, rtol=1e-9)
