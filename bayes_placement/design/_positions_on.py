"""Positions all over a structure at which a sensor or an actuator can be mounted."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._shared.compiled import compiled
from .._shared.errors import InputError
from ..experiment.experiment import Experiment
from ..experiment.transducers import Transducer
from ..modes.finite_elements.outline import outline
from ..positions.bounds import in_space
from ..positions.vectors import PointsInSpace

UNMOVED = 1e-9
"""Share of the greatest mode shape below which a point does not move."""


def positions_on(experiment: Experiment, count: int) -> list[Any]:
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
    return [tuple(map(float, at)) for at in far_apart(moving, count)]


def _greatest_motion(experiment: Experiment, points: PointsInSpace) -> Float[np.ndarray, "point"]:
    """Greatest mode shape [kg^-1/2] at each point."""
    return np.asarray(compiled(_greatest_of_modes)(experiment.nominal().structure.modes, points))


def _greatest_of_modes(modes: Any, points: Any) -> Any:
    solved = modes.solved()
    return jax.lax.map(lambda at: jnp.abs(solved.shapes(at)).max(), jnp.asarray(points))


def far_apart(points: PointsInSpace, count: int) -> Float[np.ndarray, "chosen 3"]:
    """Choose points, each of them the one farthest from those before it."""
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1)
    chosen = [int(np.argmax(distance))]
    distance = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return points[chosen]


def can_be_at(experiment: Experiment, transducer: Transducer, at: Any) -> bool:
    try:
        transducer.placement_at(at, experiment.structure.modes)
    except InputError:
        return False
    return True
