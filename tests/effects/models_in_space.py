"""Finite element models in space with their modes and exact receptances.

A skew frame and a plate made here; a portal and a plate read from files of other programs.
"""

import functools
import itertools
from collections import OrderedDict
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from scipy import sparse
from scipy.linalg import null_space

import bayes_placement as bp
from bayes_placement import finite_elements
from bayes_placement.effects import InstrumentEffect
from bayes_placement.effects.instruments import Instruments
from bayes_placement.experiment.recording import Drive, recorded
from bayes_placement.modes.finite_elements import interpolation, soft_supports
from tests.simulator import space_frames
from tests.simulator.element_models import weights
from tests.small_models import Plate

RATIO = 0.01
RIGID = 1e7  # stiffness, over that of the model, of ways in which a support does not move
CORNERS = {"left column": (0.1, 0.0, 0.5), "beam": (0.7, 0.2, 0.6)}
FEET = {"left foot": (0.0, 0.0, 0.0), "right foot": (0.8, 0.5, 0.1)}


class Scene(NamedTuple):
    """A model, and where it is read and driven."""

    matrices: Any
    modes: Any
    seats: list[Any]  # place and recorded directions
    place: Any
    frequency: Any
    members: Any
    soft: Any
    joints: Any

    @property
    def axes(self):
        return self.modes.axes

    def structure(self):
        return bp.Structure(self.modes, damping=bp.damping.Modal(RATIO))

    def experiment(self):
        sensors, actuators = ([*side.values()] for side in self.transducers())
        return bp.Experiment(
            self.structure(),
            sensors=sensors,
            actuators=actuators,
            frequency=self.frequency,
            observe=bp.observe.Complex("displacement"),
            noise=None,
        )

    def transducers(self):
        return [
            OrderedDict(
                (f"{letter}{i}", kind(f"{letter}{i}", at=at, directions=along).on(self.modes))
                for i, (at, along) in enumerate(self.seats, start=1)
            )
            for letter, kind in (("s", bp.Sensor), ("a", bp.Actuator))
        ]

    def response(self, additions, mounted="fixed", force=None):
        """Receptance by the package; read and driven at the same places, along the same axes."""
        chain = [effect for effect in additions if isinstance(effect, InstrumentEffect)]
        base = self.structure()
        for effect in additions:
            if not isinstance(effect, InstrumentEffect):
                base = base + effect
        omega = jnp.asarray(2 * np.pi * self.frequency)
        return recorded(base, Instruments(*self.transducers()), chain, Drive(omega, force, mounted))

    def reading(self, at, direction):
        """Weights of the rows in the displacement of a place."""
        table = weights(self.reader, [at], len(self.matrices.dof))[0]
        unit = np.array(direction, float) / np.linalg.norm(direction)
        return unit[np.array(self.axes) - 1] @ table

    @property
    def reader(self):
        return self.modes.interpolation

    def channels(self):
        """Weights of the rows in each channel."""
        axis = np.eye(3)
        return np.array(
            [
                self.reading(at, np.sign(axis_number) * axis[abs(axis_number) - 1])
                for at, along in self.seats
                for axis_number in along
            ]
        )


def changed(scene, stiffness=None, soft=None):
    """The matrices with a stiffness added, and springs in the place of some supports."""
    matrices = scene.matrices
    size, free = len(matrices.dof), []
    springs = sparse.lil_array((size, size))
    for name, compliance in (soft or {}).items():
        rows, motion, pattern, _ = scene.soft[name]
        ways, fixed = np.linalg.pinv(motion), null_space(motion.T)
        stiff = RIGID * matrices.stiffness.diagonal()[rows].max()
        springs_of_rows = ways.T @ pattern @ ways / compliance + stiff * fixed @ fixed.T
        springs[np.ix_(rows, rows)] = springs_of_rows
        free.extend(rows)
    return bp.finite_elements.Matrices(
        matrices.stiffness + sparse.csc_array(springs) + (0 if stiffness is None else stiffness),
        matrices.mass,
        matrices.position,
        matrices.dof,
        node=matrices.node,
        fixed=np.setdiff1d(matrices.fixed, free),
    )


def exact(scene, matrices, points, *, loss_factor=0.0, damped=150):
    """Receptance between weighted rows by a solution at each line; damping of its own modes."""
    rows = np.flatnonzero(np.abs(points).sum(axis=0))
    free = len(matrices.dof) - len(matrices.fixed)
    ratio = 0.0 if loss_factor else RATIO
    modes = None if loss_factor else matrices.modes(count=min(damped, free - 12))
    receptance = matrices.receptance(
        rows, rows, scene.frequency, modes=modes, damping_ratio=ratio, loss_factor=loss_factor
    )
    return np.einsum("pi,ijf,qj->pqf", points[:, rows], receptance, points[:, rows])


def attached(plain, channels, stiffness):
    """Receptance of the first channels once the others are held by dynamic stiffnesses."""
    dynamic_stiffness = np.zeros((plain.shape[-1], len(plain)), complex)
    dynamic_stiffness[:, channels:] = np.transpose(stiffness)
    receptance = np.moveaxis(plain, -1, 0)
    dense = np.linalg.solve(
        np.eye(len(plain)) + receptance * dynamic_stiffness[:, None, :], receptance
    )
    return np.moveaxis(dense[:, :channels, :channels], 0, -1)


def suggested():
    """Each effect of the registry that suggests something for the frame or the plate, by name."""
    suggestions = {}
    for scene in (frame(), plate()):
        experiment = scene.experiment()
        for word, kind in bp.effects.EFFECTS.items():
            variants = kind.suggest(bp.effects.Scales(experiment))
            suggestions |= {word: (scene, variants[0])} if variants else {}
    return suggestions


@functools.cache
def frame():
    """Three members in space, none along another, clamped at both feet."""
    corners = [FEET["left foot"], *CORNERS.values(), FEET["right foot"]]
    parts = [space_frames.line(np.array(a), b, 4) for a, b in itertools.pairwise(corners)]
    position = np.concatenate([nodes[:-1] for nodes, _ in parts] + [parts[-1][0][-1:]])
    elements = np.concatenate([ends + 4 * number for number, (_, ends) in enumerate(parts)])
    bar = space_frames.RoundBar(0.008)
    model = space_frames.matrices(position, elements, bar)
    names = ["left column", "beam", "right column"]
    regions = {
        name: space_frames.matrices(position, elements[4 * i : 4 * i + 4], bar)["stiffness"]
        for i, name in enumerate(names)
    }
    fixed = np.flatnonzero(np.isin(model["dof"][:, 0], [1, len(position)]))
    matrices = bp.finite_elements.Matrices(**model, fixed=fixed, regions=regions)
    members = {
        name: interpolation.frame_geometric_stiffness(matrices, elements[4 * i : 4 * i + 4])
        for i, name in enumerate(names)
    }
    soft = {
        "left foot": soft_supports.rotations(matrices, 1, along=CORNERS["left column"]),
        "right foot": soft_supports.rotations(matrices, len(position)),
    }
    middles = [0.4 * np.array(a) + 0.6 * np.array(b) for a, b in itertools.pairwise(corners)]
    seats = [(middles[0], (1, 2, 3)), (middles[1], (-2,)), (middles[2], (3, 1))]
    place = 0.7 * np.array(corners[1]) + 0.3 * np.array(corners[2])
    # Without its momentum a joint takes from the stiffness alone.
    joint = finite_elements.joints(matrices)["node 5 about y"]
    joints = {"corner": joint._replace(momentum=0 * joint.momentum)}
    reading = interpolation.frame(matrices, elements)
    return _scene(matrices, reading, seats, place, members, soft, 6, joints)


@functools.cache
def plate():
    """A plate held at all edges."""
    small = Plate((6, 5), (0.4, 0.3))
    halves = {
        "near": small.part(lambda x, y: x < 0.2),
        "corner": small.part(lambda x, y: (x > 0.2) & (y > 0.15)),
    }
    matrices = bp.finite_elements.Matrices(**small.model(), regions=halves)
    seats = [((0.13, 0.07, 0.0), (3,)), ((0.29, 0.21, 0.0), (-3,)), ((0.33, 0.04, 0.0), (3,))]
    return _scene(
        matrices,
        interpolation.plate(matrices, small.mesh.t.T.astype(int)),
        seats,
        np.array([0.22, 0.11, 0.0]),
        {},
        _edges(matrices),
        5,
    )


@functools.cache
def handed_over(folder, name):
    """The portal or the plate, as handed over."""
    folder = folder / "cases" / "models" / name
    grid = bp.io.npz_modes.read_nodes(folder / "nominal.npz")
    files = {f"region {i}": folder / f"K_region_{i:02d}.npz" for i in range(12)}
    system = bp.io.matrix_files.read(folder / "K.npz", folder / "M.npz", regions=files)
    matrices = bp.finite_elements.Matrices(
        system.stiffness,
        system.mass,
        grid.position,
        grid.dof,
        node=grid.node,
        fixed=grid.fixed,
        regions=system.regions,
    )
    elements = np.searchsorted(grid.node, grid.element)
    if name == "portal":
        members = {
            word: interpolation.frame_geometric_stiffness(matrices, ends)
            for word, ends in zip(("left", "crossbar", "right"), np.split(elements, 3), strict=True)
        }
        soft = {
            "left foot": soft_supports.rotations(matrices, 1, along=(0, 0, 1)),
            "right foot": soft_supports.rotations(matrices, 73, along=(0, 0, 1)),
        }
        seats = [((0, 0, 0.72), (1, 2, 3)), ((1.2, 0, 0.66), (1, 2, 3)), ((0.7, 0, 0.9), (-2, 3))]
        reading, place = interpolation.frame(matrices, elements), np.array([0.31, 0.0, 0.9])
        return _scene(matrices, reading, seats, place, members, soft, 8)
    seats = [((0.145, 0.245, 0), (3,)), ((0.31, 0.02, 0), (-3,)), ((0.2, 0.11, 0), (3,))]
    reading, place = interpolation.plate(matrices, elements), np.array([0.24, 0.13, 0.0])
    return _scene(matrices, reading, seats, place, {}, _edges(matrices), 8)


def _edges(matrices):
    low, high = matrices.position.min(axis=0), matrices.position.max(axis=0)
    return {
        "edge y = 0": soft_supports.edge(matrices, low, (high[0], low[1], 0.0)),
        "edge x = a": soft_supports.edge(matrices, (high[0], low[1], 0.0), high),
    }


def _scene(matrices, reading, seats, place, members, soft, lowest, joints=None):
    """Lines from below the first to above some mode, and modes up to five times as high."""
    natural = matrices.modes(count=lowest + 1).natural_frequency
    band = 0.5 * natural[0], 0.5 * (natural[-1] + natural[-2])
    parts = dict(members=members, soft=soft, joints=joints or {})
    modes = finite_elements.modes(matrices, reading, up_to=5 * band[1], **parts)
    frequency = np.geomspace(*band, 9)
    return Scene(matrices, modes, seats, place, frequency, **parts)
