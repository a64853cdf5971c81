"""Positions to try for a transducer, and the experiment with a transducer at one of them."""

from collections.abc import Hashable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike
from jaxtyping import Array, Float

from .._shared.arguments import check_annotated
from .._shared.compiled import compiled
from .._shared.errors import InputError
from .._shared.sites import unknowns
from ..experiment.experiment import Experiment
from ..experiment.transducers import Transducer
from ..modes.finite_elements.outline import outline
from ..modes.modes import Modes
from ..positions.at import RecordedPosition
from ..positions.bounds import in_space
from ..positions.places import Position
from ..positions.tolerances import Tolerance
from ..positions.vectors import PointsInSpace, Recorded, Vector, triple

Recordings: TypeAlias = dict[str, float | Float[np.ndarray, "3"]]
"""Recorded position [m] of each transducer that is placed, by name."""

Stack: TypeAlias = tuple[Position, dict[str, ArrayLike]]
"""Positions and nominal values of candidates of one form, each number an array of them."""


class Candidates(NamedTuple):
    """Positions at which one transducer is tried."""

    name: str
    """Its name."""
    recorded: np.ndarray
    """Recorded positions [m], [candidate] or [candidate, 3]."""
    positions: list[Position]
    """Its position at each of them: numbers and distributions."""
    nominal: list[dict[str, float | int]]
    """Nominal value of its unknown coordinates, by name, at each of them."""

    def points(self) -> np.ndarray:
        """Recorded positions [candidate, coordinate] [m]."""
        return self.recorded.reshape(len(self.positions), -1)

    def forms(self) -> np.ndarray:
        """Number of the form of each candidate; those of one form differ only in values."""
        numbers: dict[Hashable, int] = {}
        return np.array(
            [numbers.setdefault(_form(position), len(numbers)) for position in self.positions]
        )

    def subset(self, numbers: np.ndarray) -> "Candidates":
        """Return the candidates of some numbers, in their order, repeated where a number is."""
        positions, nominal = (
            [values[number] for number in numbers] for values in (self.positions, self.nominal)
        )
        return Candidates(self.name, self.recorded[numbers], positions, nominal)

    def followed_by(self, other: "Candidates") -> "Candidates":
        """Return these candidates followed by others."""
        return Candidates(
            self.name,
            np.concatenate([self.recorded, other.recorded]),
            self.positions + other.positions,
            self.nominal + other.nominal,
        )

    def stacked(self, numbers: np.ndarray) -> Stack:
        """Return candidates of one form as arrays of their numbers."""
        chosen = self.subset(numbers)
        positions = jax.tree.map(lambda *leaves: np.stack(leaves), *chosen.positions)
        names = chosen.nominal[0]
        return positions, {name: np.array([at[name] for at in chosen.nominal]) for name in names}


def candidates(experiment: Experiment, places: Mapping[str, object]) -> list[Candidates]:
    """Candidates of each transducer at places [m], clipped to the structure, with its tolerance."""
    if not places:
        raise InputError(
            "No places to try were given; those of at least one transducer are needed: "
            '{"s1": np.linspace(0.04, 0.96, 47)}.'
        )
    return [_candidates(experiment, name, choices) for name, choices in places.items()]


def _candidates(experiment: Experiment, name: str, choices: Any) -> Candidates:
    stated = transducer(experiment, name)
    if isinstance(choices, Tolerance):
        raise InputError(
            f'{stated.kind} "{name}" was given {choices}, a region; a list of places to '
            f'try is needed: {{"{name}": [0.25, 0.5]}}. search=design.Evolutionary() searches all '
            "of a region."
        )
    check_annotated(f"places of {name}", choices, Sequence[object])
    modes = experiment.structure.modes
    placements = [stated.placement_at(_place(at), modes) for at in choices]
    if not placements:
        raise InputError(
            f'{stated.kind} "{name}" was given no place to try; at least one is needed: '
            f'{{"{name}": [0.25, 0.5]}}.'
        )
    return _as_candidates(experiment, name, placements)


def present_position(experiment: Experiment, name: str) -> Candidates:
    """The position that the experiment states for a transducer, as the only candidate."""
    stated = transducer(experiment, name)
    return _as_candidates(experiment, name, [RecordedPosition(stated.position, stated.recorded)])


def combinations(moved: Sequence[Candidates]) -> np.ndarray:
    """All combinations of candidates [cell, transducer]."""
    counts = [len(candidates.positions) for candidates in moved]
    return np.stack(np.unravel_index(np.arange(np.prod(counts)), counts), axis=1)


def _as_candidates(
    experiment: Experiment, name: str, placements: Sequence[RecordedPosition]
) -> Candidates:
    path = ".".join([_side(experiment, name), name, "position"])
    nominal = [
        {
            f"{path}.{unknown.name}".rstrip("."): np.asarray(at.at_record(unknown.name)).item()
            for unknown in unknowns(at.position)
        }
        for at in placements
    ]
    recorded = np.array([at.recorded for at in placements])
    return Candidates(name, recorded, [at.position for at in placements], nominal)


def _form(position: Position) -> Hashable:
    shapes = tuple(np.shape(leaf) for leaf in jax.tree.leaves(position))
    return jax.tree.structure(position), shapes


def _place(at: Any) -> Tolerance | Recorded:
    if isinstance(at, Tolerance):
        return at
    check_annotated("a place to try", at, float | Vector)
    if np.shape(at) not in ((), (3,)):
        raise InputError(
            f"A place to try of {np.size(at)} coordinates was given; one number on a line or three "
            'along x, y and z [m] in space are needed, since each is a place: {"s1": [0.25, 0.5]}.'
        )
    return float(at) if np.ndim(at) == 0 else triple(at)


def transducer(experiment: Experiment, name: str) -> Transducer:
    """Transducer of this name."""
    transducers = {**experiment.sensor, **experiment.actuator}
    if name not in transducers:
        raise InputError(
            f'Places of "{name}" were given, but the experiment has no such transducer. It has '
            f"{', '.join(transducers)}."
        )
    return transducers[name]


def _side(experiment: Experiment, name: str) -> str:
    return "sensor" if name in experiment.sensor else "actuator"


def placed(experiment: Experiment, positions: Mapping[str, Position | None]) -> Experiment:
    """Return the experiment with some transducers at other positions, by name."""
    return with_transducers(
        experiment,
        {
            name: eqx.tree_at(
                lambda tree: tree.position,
                transducer(experiment, name),
                position,
                is_leaf=lambda leaf: leaf is None,
            )
            for name, position in positions.items()
        },
    )


def with_transducers(experiment: Experiment, changed: Mapping[str, Transducer]) -> Experiment:
    """Return the experiment with some transducers in the place of those of the same names."""
    sides = {name: _side(experiment, name) for name in changed}
    return eqx.tree_at(
        lambda tree: [getattr(tree, side)[name] for name, side in sides.items()],
        experiment,
        list(changed.values()),
    )


UNMOVED = 1e-9
"""Share of the greatest mode shape below which a point does not move."""


def positions_on(experiment: Experiment, count: int) -> list[Recorded]:
    """Positions all over a structure [m]: evenly along a line, nodes far apart in space."""
    modes = experiment.structure.modes
    bounds = modes.bounds()
    if not in_space(bounds):
        low, high = bounds
        return list(np.linspace(low, high, count + 2)[1:-1])
    points, _ = outline(modes)
    nodes = np.unique(points[~np.isnan(points).any(axis=1)], axis=0)
    motion = _greatest_motion(experiment, nodes)
    moving = nodes[motion > UNMOVED * motion.max()]  # at the others nothing can be measured
    return [triple(at) for at in far_apart(moving, count)]


def _greatest_motion(experiment: Experiment, points: PointsInSpace) -> Float[np.ndarray, "point"]:
    """Greatest mode shape [kg^-1/2] at each point."""
    return np.asarray(compiled(_greatest_of_modes)(experiment.nominal().structure.modes, points))


def _greatest_of_modes(modes: Modes, points: Float[Array, "point 3"]) -> Float[Array, "point"]:
    solved = modes.solved()
    return jax.lax.map(lambda at: jnp.abs(solved.shapes(at)).max(), points)


def far_apart(points: PointsInSpace, count: int) -> Float[np.ndarray, "chosen 3"]:
    """Choose points, each of them the one farthest from those before it."""
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1)
    chosen = [int(np.argmax(distance))]
    distance = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return points[chosen]


def can_be_at(experiment: Experiment, transducer: Transducer, at: Recorded | Tolerance) -> bool:
    try:
        transducer.placement_at(at, experiment.structure.modes)
    except InputError:
        return False
    return True
