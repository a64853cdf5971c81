"""Effects on finite element models compared with direct solutions of changed matrices."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpyro import distributions as dist
from scipy import sparse

import bayes_placement as bp
from bayes_placement import effects, finite_elements
from bayes_placement._shared.errors import InputError
from bayes_placement._shared.sites import unknowns
from bayes_placement.effects.member_preload import buckling_load
from bayes_placement.effects.scales import Scales
from tests.effects import models_in_space
from tests.effects.models_in_space import attached, changed, exact

CLOSE = 5e-3  # of the root mean square of a channel
# A load on a weakened part dents it in ways of which the lowest modes tell little.
COARSE = {"half a plate": 1e-2, "two parts of a plate": 1e-2}
ALONG = np.array([0.6, 0.0, 0.8])


def scene(name):
    return getattr(models_in_space, name)()


@functools.cache
def plain(name):
    """Receptance of the model as drawn, its channels and the three axes of the place."""
    model = scene(name)
    axes = np.array([model.reading(model.place, axis) for axis in axes_of(model)])
    return exact(model, model.matrices, np.vstack([model.channels(), axes]))


def axes_of(model):
    return np.eye(3)[np.array(model.axes) - 1]


def load(name, member, factor):
    model = scene(name)
    return factor * buckling_load(model.modes, list(model.members).index(member))


def response(name, additions, **settings):
    return np.asarray(jax.jit(lambda: scene(name).response(additions, **settings))())


def close(receptance, expected, without, tolerance=CLOSE):
    # Some channels of a plane frame see nothing, for reasons of symmetry.
    size = np.sqrt(np.mean(np.abs(expected) ** 2, axis=-1, keepdims=True))
    size = np.maximum(size, 1e-3 * size.max())
    np.testing.assert_array_less(np.abs(receptance - expected) / size, tolerance)
    assert (np.abs(without - expected) / size).max() > 50 * tolerance  # the effect is felt


def weaker(name, shares, tensions):
    """Stiffness added by regions that lose a share, a loose joint, and members under tension."""
    model = scene(name)
    lost = model.matrices.regions | {word: bent(joint) for word, joint in model.joints.items()}
    parts = [-share * lost[part] for part, share in shares.items()]
    parts += [tension * model.members[member] for member, tension in tensions.items()]
    return sum(parts, sparse.csc_array((len(model.matrices.dof),) * 2))


def bent(joint):
    """What a joint gives of the stiffness."""
    return sparse.csc_array(np.outer(joint.moment, joint.moment) / joint.stiffness)


# Scene; compliance of supports, share that regions lose, tension of members over its buckling load.
# A joint loses all but 1 / (1 + compliance stiffness).
CHANGES = {
    "a foot": ("frame", {"left foot": 1e-3}, {}, {}),
    "both feet": ("frame", {"left foot": 1e-4, "right foot": 3e-4}, {}, {}),
    "an edge": ("plate", {"edge y = 0": 1e-5}, {}, {}),
    "two edges": ("plate", {"edge y = 0": 1e-6, "edge x = a": 1e-5}, {}, {}),
    "half a beam": ("frame", {}, {"beam": 0.5}, {}),
    "nearly all of a column": ("frame", {}, {"left column": 0.9}, {}),
    "half a plate": ("plate", {}, {"near": 0.5}, {}),
    "two parts of a plate": ("plate", {}, {"near": 0.3, "corner": 0.8}, {}),
    "tension": ("frame", {}, {}, {"beam": 2.0}),
    "compression": ("frame", {}, {}, {"left column": -0.7}),
    "a corner": ("frame", {}, {"corner": 0.99}, {}),
    "a corner and all else": (
        "frame",
        {"left foot": 1e-4},
        {"corner": 0.8, "beam": 0.5},
        {"beam": 2},
    ),
    "a foot and a beam": ("frame", {"left foot": 1e-4}, {"beam": 0.8}, {}),
    "an edge and a corner": ("plate", {"edge x = a": 1e-6}, {"corner": 0.6}, {}),
    "tension and a column": ("frame", {}, {"left column": 0.5}, {"beam": 2.0}),
    "all at once": ("frame", {"left foot": 1e-4}, {"left column": 0.5}, {"left column": 2.0}),
}


def named(name, soft, shares, tensions):
    additions = [effects.soft_support(which, c, name=f"soft {which}") for which, c in soft.items()]
    additions += [weak(scene(name).joints.get(part), part, q) for part, q in shares.items()]
    return additions + [
        effects.member_preload(member, load(name, member, factor), name=f"tense {member}")
        for member, factor in tensions.items()
    ]


def weak(joint, part, share):
    if joint is None:
        return effects.region_stiffness_loss(part, share, name=f"weak {part}")
    compliance = share / (1 - share) / joint.stiffness
    return effects.loose_joint(part, compliance, name=f"weak {part}")


SHORT = [
    "a corner",
    "a foot",
    "an edge",
    "nearly all of a column",
    "compression",
    "tension and a column",
]
LONG = [
    "a corner and all else",
    "both feet",
    "half a plate",
    "a foot and a beam",
    "an edge and a corner",
    "all at once",
]
FURTHER = [pytest.mark.long, pytest.mark.longest]


def marks_of(case):
    return [] if case in SHORT else FURTHER[: 1 if case in LONG else 2]


@pytest.mark.parametrize("case", [pytest.param(name, marks=marks_of(name)) for name in CHANGES])
def test_what_gives_way_responds_as_the_changed_matrices_do(case):
    name, soft, shares, tensions = CHANGES[case]
    model = scene(name)
    newtons = {member: load(name, member, factor) for member, factor in tensions.items()}
    matrices = changed(model, weaker(name, shares, newtons), soft)
    expected = exact(model, matrices, model.channels())
    count = len(model.channels())
    receptance = response(name, named(name, soft, shares, tensions))
    close(receptance, expected, plain(name)[:count, :count], COARSE.get(case, CLOSE))


@pytest.mark.long
@pytest.mark.parametrize("name", ["portal", pytest.param("plate", marks=pytest.mark.longest)])
def test_on_models_handed_over_too(shared_data, name):
    model = models_in_space.handed_over(shared_data, name)
    support, region = next(iter(model.soft)), "region 0"
    added = -0.5 * model.matrices.regions[region]
    additions = [effects.soft_support(support, 1e-4), effects.region_stiffness_loss(region, 0.5)]
    receptance = np.asarray(jax.jit(lambda: model.response(additions))())
    expected = exact(model, changed(model, added, {support: 1e-4}), model.channels())
    close(receptance, expected, exact(model, model.matrices, model.channels()))


# What is attached, and its dynamic stiffness at each angular frequency along each axis.
MASS, SPRING, DASHPOT = 0.4, 3e4, 30.0


def absorber(omega, mass=0.05, frequency=60.0, ratio=0.05):
    tuned = 2 * np.pi * frequency
    spring = mass * (tuned**2 + 2j * ratio * tuned * omega)
    return spring * -mass * omega**2 / (spring - mass * omega**2)


ATTACHED = {
    "point_mass": (
        lambda at: effects.point_mass(at, MASS),
        lambda omega: -MASS * omega[:, None, None] ** 2 * np.eye(3),
    ),
    "ground_spring": (
        lambda at: effects.ground_spring(at, SPRING, direction=tuple(ALONG)),
        lambda omega: SPRING * np.ones_like(omega)[:, None, None] * np.outer(ALONG, ALONG),
    ),
    "ground_dashpot": (
        lambda at: effects.ground_dashpot(at, DASHPOT, direction=tuple(ALONG)),
        lambda omega: 1j * DASHPOT * omega[:, None, None] * np.outer(ALONG, ALONG),
    ),
    "tuned_absorber": (
        lambda at: effects.tuned_absorber(at, 0.05, 60.0, 0.05, direction=tuple(ALONG)),
        lambda omega: absorber(omega)[:, None, None] * np.outer(ALONG, ALONG),
    ),
}


@pytest.mark.parametrize("kind", ATTACHED)
def test_what_is_attached_to_a_frame_acts_along_its_direction(kind):
    make, dynamic_stiffness = ATTACHED[kind]
    model, bare = scene("frame"), plain("frame")
    count = len(model.channels())
    stiffness = dynamic_stiffness(2 * np.pi * model.frequency)
    expected = coupled(bare, count, stiffness)
    receptance = response("frame", [make(tuple(model.place))])
    close(receptance, expected, bare[:count, :count], 1e-3)


def coupled(bare, count, stiffness):
    """Receptance of the first channels with a dynamic stiffness [line, axis, axis] on the rest."""
    by_line = np.moveaxis(bare, -1, 0)
    dynamic_stiffness = np.zeros_like(by_line)
    dynamic_stiffness[:, count:, count:] = stiffness
    solved = np.linalg.solve(np.eye(by_line.shape[-1]) + by_line @ dynamic_stiffness, by_line)
    return np.moveaxis(solved[:, :count, :count], 0, -1)


def test_a_mass_on_a_plate_acts_across_it():
    model, bare = scene("plate"), plain("plate")
    count = len(model.channels())
    inertia = -MASS * (2 * np.pi * model.frequency) ** 2
    expected = attached(bare, count, inertia[None])
    receptance = response("plate", [effects.point_mass(tuple(model.place), MASS)])
    close(receptance, expected, bare[:count, :count])


def test_hysteretic_damping_is_that_of_a_complex_stiffness():
    model = scene("frame")
    count = len(model.channels())
    expected = exact(model, model.matrices, model.channels(), loss_factor=0.05)
    receptance = response("frame", [effects.hysteretic_damping(0.05)])
    close(receptance, expected, plain("frame")[:count, :count])


def test_masses_of_sensors_move_with_them_in_all_directions():
    model, mass = scene("frame"), 0.2
    seats = np.array([model.reading(at, axis) for at, _ in model.seats for axis in np.eye(3)])
    bare = exact(model, model.matrices, np.vstack([model.channels(), seats]))
    count = len(model.channels())
    inertia = -mass * (2 * np.pi * model.frequency) ** 2
    expected = attached(bare, count, np.tile(inertia, (len(seats), 1)))
    receptance = response("frame", [effects.sensor_mass(mass)])
    close(receptance, expected, bare[:count, :count])


# Effects of the registry on parts of a model, which the table of laws on a line does not have.
PARTS = {
    word: suggestion
    for word, suggestion in models_in_space.suggested().items()
    if isinstance(suggestion[1], effects.Hinged)
}


@pytest.mark.parametrize(
    "kind",
    [
        pytest.param(kind, marks=[pytest.mark.long] * (number > 0))
        for number, kind in enumerate(PARTS)
    ],
)
def test_zero_strength_changes_nothing_and_has_a_slope(kind):
    model, effect = PARTS[kind]
    field, absent = effect.absent

    @jax.jit
    def of(value):
        return model.response([dataclasses.replace(effect, **{field: value})])

    np.testing.assert_array_equal(of(absent), jax.jit(lambda: model.response([]))())
    # A strength that is felt, not much; from one side: a negative compliance holds nothing.
    prior = getattr(effect, field)
    step = 1e-4 * float(prior.icdf(0.6))
    slope = jax.jit(lambda: jax.jvp(of, (absent,), (step,))[1])()
    felt = (4 * of(absent + step) - of(absent + 2 * step) - 3 * of(absent)) / 2
    size = np.abs(felt).max()
    assert size > 0
    np.testing.assert_allclose(slope, felt, atol=1e-3 * size)


@pytest.mark.long
def test_the_order_in_which_parts_give_way_is_of_no_consequence():
    additions = [
        effects.region_stiffness_loss("beam", 0.5),
        effects.soft_support("left foot", 1e-4),
    ]
    forward, other = response("frame", additions), response("frame", additions[::-1])
    np.testing.assert_allclose(forward, other, atol=1e-9 * np.abs(forward).max())


def test_a_support_that_is_very_soft_is_as_good_as_released():
    model = scene("frame")
    free = changed(model, soft={"left foot": 1e6})
    base = model.structure() + effects.soft_support("left foot", 1e6)
    frequencies = jax.jit(lambda: base.proper_modes().natural_frequency)()
    np.testing.assert_allclose(frequencies[:6], free.modes(count=6).natural_frequency, rtol=1e-5)


def test_a_structure_that_has_buckled_has_no_natural_frequencies():
    def first(factor):
        effect = effects.member_preload("left column", load("frame", "left column", factor))
        base = scene("frame").structure() + effect
        return jax.jit(lambda: base.proper_modes().natural_frequency)()[0]

    assert first(-0.9) > 0
    assert jnp.isnan(first(-1.1))


def without_static_shapes():
    model = scene("frame")
    return finite_elements.modes(model.matrices, model.reader, up_to=500.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: effects.soft_support("porch", 1e-4), "porch.*left foot.*right foot"),
        (lambda: effects.region_stiffness_loss("porch", 0.1), "porch.*left column.*beam"),
        (lambda: effects.member_preload("porch", 10.0), "porch.*left column.*beam"),
    ],
)
def test_a_part_that_does_not_exist_is_named_with_those_that_do(make, message):
    with pytest.raises(ValueError, match=message):
        scene("frame").structure() + make()


def test_a_support_without_static_shapes_is_refused():
    base = bp.Structure(without_static_shapes(), damping=bp.damping.Modal(0.01))
    with pytest.raises(ValueError, match=r"soft=\{"):
        base + effects.soft_support("left foot", 1e-4)


@pytest.mark.parametrize("by_number", [False, True])
@pytest.mark.parametrize(("name", "support"), [("frame", "right foot"), ("plate", "edge x = a")])
def test_the_unit_of_a_compliance_is_that_of_its_support(name, support, by_number):
    base, expected = scene(name).structure(), "m2/N" if name == "plate" else "rad/(N m)"
    named = list(scene(name).soft).index(support) if by_number else support
    softened = base + effects.soft_support(named, dist.LogUniform(1e-9, 1e-3))
    assert [unknown.unit for unknown in unknowns(softened.effects)] == [expected]
    assert repr(softened.effects["compliant_support"]).count(expected) == 1
    candidates = effects.soft_support.suggest(Scales(scene(name).experiment()))
    assert {unknown.unit for unknown in unknowns(candidates)} == {expected}


def test_the_unit_of_springs_is_that_of_what_was_held():
    matrices = scene("frame").matrices
    rows = matrices.fixed[matrices.dof[matrices.fixed, 0] == 1]
    springs = finite_elements.soft_supports.springs
    seat, hinge = (rows[np.isin(matrices.dof[rows, 1], group)] for group in ((1, 2, 3), (4, 5, 6)))
    units = [springs(matrices, held).compliance_unit for held in (seat, hinge, rows)]
    assert units == ["m/N", "rad/(N m)", "m/N or rad/(N m)"]


def test_a_support_without_a_structure_states_every_unit():
    alone = effects.soft_support("foot", dist.LogUniform(1e-9, 1e-3))
    assert [unknown.unit for unknown in unknowns(alone)] == ["rad/(N m), m/N or m2/N"]


# ------------------------------------------------------------------ ports other than a point


def held(name, rows, stiffness):
    """Receptance of the channels with dynamic stiffnesses [row, line] on rows of the model."""
    model = scene(name)
    channels = model.channels()
    bare = exact(model, model.matrices, np.vstack([channels, rows]))
    return attached(bare, len(channels), stiffness), bare[: len(channels), : len(channels)]


def test_a_strut_between_two_members_acts_along_its_line():
    model = scene("frame")
    ends = np.array(model.seats[0][0]), np.array(model.seats[2][0])
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    row = model.reading(ends[0], along) - model.reading(ends[1], along)
    law = effects.Spring(4e4) | effects.Dashpot(20.0)
    stiffness = 4e4 + 20j * 2 * np.pi * model.frequency
    expected, without = held("frame", row[None], stiffness[None])
    strut = effects.strut(tuple(ends[0]), tuple(ends[1]), law)
    close(response("frame", [strut]), expected, without, 1e-3)


def test_an_inertia_turns_with_its_foot():
    model, foot = scene("plate"), np.array([0.04, 0.0, 0.0])
    across = np.array([0.0, 0.0, 1.0])
    row = (
        model.reading(model.place + foot / 2, across)
        - model.reading(model.place - foot / 2, across)
    ) / 0.04
    stiffness = -0.003 * (2 * np.pi * model.frequency) ** 2
    expected, without = held("plate", row[None], stiffness[None])
    inertia = effects.rotary_inertia(tuple(model.place), 0.003, footprint=tuple(foot))
    close(response("plate", [inertia]), expected, without)


@pytest.mark.long
def test_a_patch_is_heavier_all_over():
    model, edges = scene("plate"), (0.12, 0.1, 0.0)
    node, weight = np.polynomial.legendre.leggauss(9)
    offsets = [(x * edges[0] / 2, y * edges[1] / 2, 0.0) for x in node for y in node]
    rows = np.array([model.reading(model.place + at, (0.0, 0.0, 1.0)) for at in offsets])
    shares = np.outer(weight, weight).ravel() / 4
    stiffness = -0.4 * shares[:, None] * (2 * np.pi * model.frequency) ** 2
    expected, without = held("plate", rows, stiffness)
    patch = effects.segment_mass(tuple(model.place), edges, 0.4)
    close(response("plate", [patch]), expected, without)


def test_a_rotation_in_space_needs_a_footprint():
    inertia = effects.rotary_inertia(tuple(scene("plate").place), 0.003)
    with pytest.raises(InputError, match="without a footprint; the vector between the edges"):
        scene("plate").structure() + inertia
