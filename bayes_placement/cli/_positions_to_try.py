"""Positions that a placement search tries for each sensor and actuator."""

from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from .._compiled import compiled
from .._types import InputError, UsageError
from ..experiment.experiment import Experiment
from ..experiment.transducers import Transducer
from ..modes.finite_elements.outline import outline
from ..positions.bounds import in_space
from ..positions.vectors import PointsInSpace

MOST_PLACEMENTS = 100_000
"""Placements, at most, that an exhaustive search tries."""

UNMOVED = 1e-9
"""Share of the greatest mode shape below which a point does not move."""


def positions_to_try(experiment: Experiment, search: str, count: int) -> dict[str, Sequence[Any]]:
    """Return the positions of the structure at which each sensor and actuator can be mounted [m].

    Parameters
    ----------
    experiment
        The experiment.
    search
        Name of the search.
    count
        Positions on the structure, of which those are kept that a tolerance allows.
    """
    if search == "evolutionary" and in_space(experiment.structure.modes.bounds()):
        raise UsageError(
            "--search evolutionary moves along a line, but this structure lies in space. Give "
            "--search sequential or forward, or use bp.place with a tolerance for each transducer."
        )
    positions = positions_on(experiment, count)
    transducers = {**experiment.sensor, **experiment.actuator}
    allowed: dict[str, Sequence[Any]] = {
        name: [at for at in positions if can_be_at(experiment, transducer, at)]
        for name, transducer in transducers.items()
    }
    nowhere = [name for name, remaining in allowed.items() if not remaining]
    if nowhere:
        raise UsageError(
            f'At none of {len(positions)} positions "{nowhere[0]}" can be mounted with its '
            "tolerance. Try more positions, --places 200, or use bp.place with positions of your "
            "own."
        )
    placements = np.prod([len(remaining) for remaining in allowed.values()], dtype=float)
    if search == "exhaustive" and placements > MOST_PLACEMENTS:
        raise UsageError(
            f"--search exhaustive would try {placements:.2g} placements of {', '.join(allowed)}. "
            "Give --search forward (or evolutionary), fewer --sensors or fewer --places."
        )
    return allowed


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
