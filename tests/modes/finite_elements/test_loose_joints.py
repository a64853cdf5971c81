"""Joints of frames: where they are, what passes through them, and frames with a sprung one."""

import itertools

import jax
import numpy as np
import numpyro.distributions as dist
import pytest
import scipy.linalg

import bayes_placement as bp
from bayes_placement import effects, finite_elements
from bayes_placement.modes.finite_elements import interpolation, soft_supports
from tests.simulator import space_frames
from tests.small_models import Plate, free_beam, solid

BAR = space_frames.RoundBar(0.008)
PORTAL = [(0.0, 0.0, 0.0), (0.0, 0.6, 0.0), (0.8, 0.6, 0.0), (0.8, 0.0, 0.0)]
SKEW = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.5), (0.7, 0.2, 0.6), (0.8, 0.5, 0.1)]
COUNT = 5  # elements of a member


def along(corners, bar=BAR, count=COUNT):
    """Members from corner to corner: arguments of Matrices, and elements."""
    parts = [space_frames.line(np.array(a), b, count) for a, b in itertools.pairwise(corners)]
    position = np.concatenate([nodes[:-1] for nodes, _ in parts] + [parts[-1][0][-1:]])
    elements = np.concatenate([ends + count * number for number, (_, ends) in enumerate(parts)])
    return space_frames.matrices(position, elements, bar), elements


def clamped(model, *nodes, directions=(1, 2, 3, 4, 5, 6), moving=(1, 2, 3, 4, 5, 6), **options):
    """Matrices with some directions held at some nodes, and all but those that move anywhere."""
    node, direction = model["dof"].T
    held = np.isin(node, nodes) & np.isin(direction, directions) | ~np.isin(direction, moving)
    return finite_elements.Matrices(**model, fixed=np.flatnonzero(held), **options)


def portal(**options):
    """Portal of COUNT elements a member, that moves in its plane, clamped at both feet."""
    model, elements = along(PORTAL)
    return clamped(model, 1, 3 * COUNT + 1, moving=(1, 2, 6), **options), elements


def plane_rows(model):
    """Rows of a model in the plane x, y alone."""
    rows = np.flatnonzero(np.isin(model["dof"][:, 1], (1, 2, 6)))
    parts = {name: model[name].tocsr()[rows][:, rows] for name in ("stiffness", "mass")}
    return parts | dict(position=model["position"], dof=model["dof"][rows])


def skew(clamps=(1, 3 * COUNT + 1)):
    """Three members in space, none along another."""
    model, elements = along(SKEW)
    return clamped(model, *clamps), elements


FRAMES = {
    "in space": lambda: skew()[0],
    "free": lambda: skew(())[0],
    "in a plane": lambda: portal()[0],
    "of plane rows": lambda: clamped(plane_rows(along(PORTAL)[0]), 1, 3 * COUNT + 1),
}


@pytest.mark.parametrize("name", FRAMES)
def test_a_joint_transmits_what_its_element_does(name):
    matrices = FRAMES[name]()
    joints = finite_elements.joints(matrices)
    assert len(joints) == {"in space": 12, "free": 6}.get(name, 4)
    for joint in joints.values():
        nodes = np.unique(matrices.dof[np.abs(joint.moment) > 0, 0])
        start, end = matrices.position[nodes[np.argsort(nodes != joint.node)] - 1]
        force = np.zeros((2, 2, 6))
        both = np.flatnonzero(np.isin(matrices.dof[:, 0], nodes))
        other = np.array(matrices.dof[both, 0] != joint.node, dtype=int)
        force[:, other, matrices.dof[both, 1] - 1] = np.stack([joint.moment, joint.momentum])[
            :, both
        ]
        # The moment that the turned end bears tells about which axis it was turned.
        stiffness, mass = space_frames.element(start, end, BAR)
        axis = np.linalg.solve(stiffness[3:6, 3:6], force[0, 0, 3:])
        np.testing.assert_allclose(np.linalg.norm(axis), 1.0)
        for matrix, column in zip((stiffness, mass), force, strict=True):
            expected = matrix[:, 3:6] @ axis
            np.testing.assert_allclose(column.ravel(), expected, atol=1e-5 * abs(expected).max())
        np.testing.assert_allclose(joint.stiffness, axis @ stiffness[3:6, 3:6] @ axis)
        turned = np.flatnonzero((matrices.dof[:, 0] == joint.node) & (matrices.dof[:, 1] > 3))
        np.testing.assert_allclose(joint.turn[turned], axis[matrices.dof[turned, 1] - 4], atol=1e-9)


def ends_of(joints):
    return [name.partition(" about")[0] for name in joints]


def thicker(radius):
    """A straight member whose second half is thicker, free to move in its plane; clamped."""
    parts = [along([(0, 0, 0), (0.5, 0, 0), (1, 0, 0)], bar)[0] for bar in (BAR, radius)]
    rows = np.arange(len(parts[0]["dof"]))
    half = 6 * (COUNT + 1)
    whole = dict(parts[0])
    for name in ("stiffness", "mass"):
        thin, thick = (
            along([(0, 0, 0), (0.5, 0, 0)], bar)[0][name].toarray() for bar in (BAR, radius)
        )
        whole[name] = np.zeros((rows.size, rows.size))
        whole[name][:half, :half] += thin
        whole[name][half - 6 :, half - 6 :] += thick
    return clamped(whole, 1, moving=(1, 2, 6))


def tee():
    """A column, on which two halves of a beam meet a third member, in a plane."""
    model, elements = along([(-0.5, 0.5, 0), (0, 0.5, 0), (0.5, 0.5, 0)])
    column, ends = along([(0, 0, 0), (0, 0.5, 0)])
    position = np.concatenate([model["position"], column["position"][:-1]])
    ends = np.where(ends == COUNT, COUNT, ends + 2 * COUNT + 1)
    whole = space_frames.matrices(position, np.concatenate([elements, ends]), BAR)
    return clamped(whole, 2 * COUNT + 2, moving=(1, 2, 6)), np.concatenate([elements, ends])


def test_joints_are_where_elements_meet_otherwise_than_in_line():
    joints = finite_elements.joints(portal()[0])
    assert list(joints) == [f"node {COUNT * corner + 1} about z" for corner in range(4)]
    pinned = clamped(along(PORTAL)[0], 1, 16, directions=(1, 2), moving=(1, 2, 6))
    assert ends_of(finite_elements.joints(pinned)) == ["node 6", "node 11"]
    bent = along([(0, 0, 0), (0.5, 0, 0), (1.0, 0.1, 0)])[0]
    assert ends_of(finite_elements.joints(clamped(bent, 1, moving=(1, 2, 6)))) == ["node 1"]
    at_column = [f"node 6 to {other}" for other in (5, 7, 16)]
    assert ends_of(finite_elements.joints(tee()[0])) == [*at_column, "node 12"]


@pytest.mark.parametrize(("ratio", "more"), [(1.03, []), (1.1, ["node 6"])])
def test_a_joint_is_where_the_section_changes(ratio, more):
    joints = finite_elements.joints(thicker(space_frames.RoundBar(ratio * BAR.radius)))
    assert ends_of(joints) == ["node 1", *more]


def test_a_clamp_of_two_members_has_a_joint_of_each():
    matrices = clamped(along(PORTAL)[0], 6, moving=(1, 2, 6))
    assert ends_of(finite_elements.joints(matrices)) == ["node 6 to 5", "node 6 to 7", "node 11"]


def without_twist(model):
    """A plate whose twist is left out: its nodes have rotations, and rigid motions cost nothing."""
    rows = np.flatnonzero(model["dof"][:, 1] != 7)
    parts = {name: model[name].tocsr()[rows][:, rows] for name in ("stiffness", "mass")}
    return parts | dict(position=model["position"], dof=model["dof"][rows])


def under_tension():
    """A beam under tension: its turning costs energy."""
    model = free_beam()
    position, dof = model["position"], model["dof"]
    elements = np.stack([np.arange(len(position) - 1), np.arange(1, len(position))], axis=1)
    rows = 6 * (dof[:, 0] - 1) + dof[:, 1] - 1
    grid = finite_elements.ModalModel.from_arrays(
        position=position,
        shape=np.ones((len(position), 6, 1)),
        natural_frequency=[1.0],
        modal_mass=1.0,
    )
    tension = interpolation.frame_geometric_stiffness(grid, elements)[rows][:, rows]
    size = model["stiffness"].diagonal().max() / tension.diagonal().max()
    return model | dict(stiffness=model["stiffness"] + 0.1 * size * tension)


def with_too_little():
    """A frame from which a member is taken that it does not have."""
    model, _ = along(PORTAL)
    strut, _ = space_frames.element(model["position"][2], model["position"][7], BAR)
    rows = np.concatenate([6 * node + np.arange(6) for node in (2, 7)])
    stiffness = model["stiffness"].toarray()
    stiffness[np.ix_(rows, rows)] -= strut
    return model | dict(stiffness=stiffness)


OTHERS = {
    "frame with too little": with_too_little,
    "solid": lambda: solid((2, 2, 2), (1.0, 1.0, 1.0)),
    "plate": lambda: {
        name: value for name, value in Plate((4, 3), (0.4, 0.3)).model().items() if name != "fixed"
    },
    "plate without twist": lambda: without_twist(Plate((4, 3), (0.4, 0.3)).model()),
    "beam under tension": under_tension,
}


@pytest.mark.parametrize("name", OTHERS)
def test_what_is_no_frame_has_no_joints(name):
    matrices = finite_elements.Matrices(**OTHERS[name](), fixed=[0, 1])
    assert finite_elements.joints(matrices) == {}


def sprung(matrices, elements, joints, compliance):
    """Stiffness and mass of the rows that may move, and these: one more row for each spring."""
    size = len(matrices.dof)
    whole = np.zeros((2, size + len(joints), size + len(joints)))
    for ends in elements:
        motion = np.zeros((12, len(whole[0])))
        motion[np.arange(12), (6 * ends[:, None] + np.arange(6)).ravel()] = 1.0
        numbers = list(matrices.node[ends])
        for row, joint in enumerate(joints, start=size):
            if {joint.node, joint.other} == set(numbers):
                motion[:, row] = -motion[:, :size] @ joint.turn
        for part, of_element in zip(
            whole, space_frames.element(*matrices.position[ends], BAR), strict=True
        ):
            part += motion.T @ of_element @ motion
    whole[0, range(size, len(whole[0])), range(size, len(whole[0]))] += 1 / compliance
    free = np.setdiff1d(np.arange(len(whole[0])), matrices.fixed)
    return whole[:, free][:, :, free], free


def coarse():
    """Each member one element, which both its joints share."""
    model, elements = along(PORTAL, count=1)
    return clamped(model, 1, 4, moving=(1, 2, 6)), elements


SPRUNG = {
    "in space": (skew, ["node 6"], (2, 8), 3000.0),
    "in space, two": (skew, ["node 6", "node 11"], (2, 8), 3000.0),
    "in a plane": (portal, ["node 6"], (2, 8), 4000.0),
    "free": (lambda: skew(()), ["node 6"], (2, 8), 3000.0),
    "of one node": (tee, ["node 6 to 5", "node 6 to 7"], (2, 8), 4000.0),
    "of one element": (coarse, ["node 1", "node 2"], (1, 2), 15000.0),
}


@pytest.mark.parametrize("compliance", [1e-5, 1e-3, 1.0])
@pytest.mark.parametrize("name", SPRUNG)
def test_a_sprung_joint_responds_as_a_dense_model_does(name, compliance):
    frame, nodes, places, up_to = SPRUNG[name]
    matrices, elements = frame()
    reading = interpolation.frame(matrices, elements)
    soft = {"foot": soft_supports.rotations(matrices, 1)} if name == "in space" else {}
    joints = finite_elements.joints(matrices)
    modes = finite_elements.modes(matrices, reading, up_to=up_to, soft=soft, joints=joints)
    where = [[word for word in joints if word.startswith(node + " ")][-1] for node in nodes]
    (stiffness, mass), free = sprung(
        matrices, elements, [joints[word] for word in where], compliance
    )
    squares, shape = scipy.linalg.eigh(stiffness, mass)
    rigid, natural = modes.rigid_body_modes, np.sqrt(np.maximum(squares, 0.0))
    base = loose = bp.Structure(modes, damping=bp.damping.Modal(0.005))
    for word in where:
        loose = loose + effects.loose_joint(word, compliance, name=f"at_{where.index(word)}")
    found = 2 * np.pi * np.asarray(jax.jit(lambda: loose.proper_modes().natural_frequency)())
    drawn = 2 * np.pi * np.asarray(base.modes.natural_frequency)
    lowest = slice(rigid, rigid + min(5, len(natural) // 2 - 1))
    np.testing.assert_allclose(found[lowest], natural[lowest], rtol=1e-6)
    assert compliance < 1e-4 or (drawn[lowest] / natural[lowest] - 1).max() > 1e-2
    # Near the resonances.
    omega = np.sort(np.outer(natural[lowest], (0.995, 1.0, 1.005)).ravel())
    gain = shape[np.searchsorted(free, [6 * places[0], 6 * places[1] + 1])]
    dynamic = natural**2 + 2j * 0.005 * natural * omega[:, None] - omega[:, None] ** 2
    dynamic[:, :rigid] = -(omega[:, None] ** 2)
    expected = np.einsum("ir,jr,lr->ijl", gain, gain, 1 / dynamic)
    response = response_between(loose, matrices.position[list(places)], omega)
    size = np.sqrt(np.mean(np.abs(expected) ** 2, axis=-1, keepdims=True))
    assert (np.abs(response - expected) / size).max() < 1e-3


def response_between(structure, places, omega):
    """Receptance between one place along x and another along y."""
    experiment = bp.Experiment(
        structure,
        sensors=[bp.Sensor(f"s{i}", at=at, directions=(i,)) for i, at in enumerate(places, 1)],
        actuators=[bp.Actuator(f"a{i}", at=at, directions=(i,)) for i, at in enumerate(places, 1)],
        frequency=omega / (2 * np.pi),
        observe=bp.observe.Complex("displacement"),
        noise=None,
    )
    return experiment.nominal_measurement().frf


def modes_of(matrices, elements, **options):
    reading = interpolation.frame(matrices, elements)
    return finite_elements.modes(matrices, reading, up_to=1000.0, **options)


def test_joints_are_tried_unasked_but_in_regions_and_soft_supports(monkeypatch):
    matrices, elements = portal()
    assert modes_of(matrices, elements).static_shapes.joints == tuple(joints_at(1, 6, 11, 16))
    soft = {
        "foot": soft_supports.springs(matrices, 5),
        "seat": soft_supports.springs(matrices, 6 * 15),
    }
    found = modes_of(matrices, elements, soft=soft).static_shapes
    assert (found.supports, found.joints) == (("foot", "seat"), tuple(joints_at(6, 11, 16)))
    assert modes_of(matrices, elements, joints={}).static_shapes.joints == ()
    named = portal(regions={"all": matrices.stiffness})[0]
    assert modes_of(named, elements).static_shapes.joints == ()
    monkeypatch.setattr(finite_elements.from_matrices, "MOST_JOINTS", 3)
    assert modes_of(matrices, elements).static_shapes.joints == ()


def joints_at(*nodes):
    return [f"node {node} about z" for node in nodes]


def test_a_joint_is_suggested_up_to_a_hinge_and_tells_its_spring():
    matrices, elements = portal()
    soft = {"foot": soft_supports.springs(matrices, 5)}
    modes = modes_of(matrices, elements, soft=soft)
    structure = bp.Structure(modes, damping=bp.damping.Modal(0.01))
    experiment = bp.Experiment(
        structure,
        sensors=[bp.Sensor("s1", at=(0.4, 0.6, 0.0), directions=(2,))],
        actuators=[bp.Actuator("a1", at=(0.4, 0.6, 0.0), directions=(2,))],
        frequency=[20.0],
        observe=bp.observe.Complex("displacement"),
        noise=None,
    )
    suggested = effects.library(experiment, ["loose_joint"]).effects
    member = BAR.youngs_modulus * BAR.moment / 0.7
    assert len(suggested) == 3
    for effect in suggested:
        assert 1.0 < effect.compliance.high * member < 20.0
    corner, on = suggested[0], (structure.modes, effects.Scales(experiment).instruments)
    assert corner.setting(*on) == "joint at node 6 about z"
    np.testing.assert_allclose(corner.location(*on), PORTAL[1])
    assert corner.remark({"compliance": (1 / 1500.2, 1e-6)}) == "a spring of 1500 N m/rad"
    assert corner.remark({"compliance": (1e-6, 1e-6)}) == ""
    with pytest.raises(ValueError, match=r"node 6 about z.*joints=finite_elements\.joints"):
        structure + effects.loose_joint("node 7 about z", 1e-3)


def with_a_loose_corner():
    """Experiment on the portal, and what it measures where a corner is loose."""
    matrices, elements = portal()
    modes = modes_of(matrices, elements)
    asked = bp.Experiment(
        bp.Structure(modes, damping=bp.damping.Modal(dist.Uniform(0.002, 0.03))),
        sensors=[
            bp.Sensor("s1", at=(0.0, 0.25, 0.0), directions=(1,)),
            bp.Sensor("s2", at=(0.33, 0.6, 0.0), directions=(2,)),
        ],
        actuators=[bp.Actuator("a1", at=(0.0, 0.4, 0.0), directions=(1,))],
        frequency=np.arange(5.0, 250.0, 1.5),
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.Relative(0.02, 0.01),
    )
    true = asked + effects.loose_joint("node 11 about z", 1 / 600)
    return asked, true.nominal_measurement()


@pytest.mark.long
def test_a_loose_corner_is_named_with_its_spring():
    words = bp.improve(*with_a_loose_corner()).words()[0]
    assert "loose_joint, joint at node 11 about z" in words
    assert "a spring of 600 N m/rad" in words


def test_what_was_not_tried_is_said_where_joints_were():
    asked, measurement = with_a_loose_corner()
    candidates = effects.library(asked, ["gain_error"])
    words = bp.explain(asked, measurement, candidates=candidates, model_error=None).words()[0]
    assert "No loss of stiffness within a member was tried" in words
