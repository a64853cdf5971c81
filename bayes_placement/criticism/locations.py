"""Where an effect of an experiment is, at values of its unknowns.

What has no known place has coordinates of NaN, and so have y and z on a line.
"""

from collections.abc import Mapping
from typing import Any, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._shared.compiled import compiled
from .._shared.sites import is_unknown, substitute
from ..effects.damping_layer import DampingLayer
from ..effects.effect import AtPlace, Effect
from ..effects.over import OverExtent
from ..experiment.experiment import Experiment
from ..modes.finite_elements.interpolation import Nearest
from ..modes.finite_elements.nodal_modes import nodal_of
from ..positions.bounds import in_space
from ..positions.places import Place, Straight, mean
from ..positions.vectors import PointsInSpace, Recorded, triple

Values: TypeAlias = Mapping[str, np.ndarray]

_OVER = (OverExtent, DampingLayer)
"""Effects that act all over a part of the structure."""


def locations(
    effect: Effect, experiment: Experiment, values: Values, count: int, field: str = ""
) -> PointsInSpace:
    """Where an effect of the experiment is [m] at each of several points; its place may be unknown.

    Values are those of its unknowns at the points. `field` names its second place; by default it is
    the first.
    """
    at: Any = effect.location(experiment.structure.modes, experiment.instruments)
    at = getattr(effect, field) if field else at
    word = field or "".join(effect.place_fields[:1])
    coordinates = {
        unknown.component: values[unknown.name]
        for unknown in experiment.unknowns_of(effect)
        if unknown.field == word and unknown.name in values
    }
    points = np.full((count, 3), np.nan)
    if isinstance(at, Place):
        points[:] = _in_space(at, coordinates, count)
    elif is_unknown(at):
        points[:, 0] = coordinates[""]
    elif at is not None:
        points[:, : np.size(at)] = at
    return points


def ends(effect: Effect, experiment: Experiment, values: Values, count: int) -> list[PointsInSpace]:
    """Each place of an effect of the experiment [m], see `locations`; of nodes alone the nearest.

    Both ends of a strut and of a segment, of a box two opposite corners, the least first.
    """
    fields = effect.place_fields
    places = [locations_as_read(effect, experiment, values, count, field) for field in fields]
    if not isinstance(effect, _OVER):
        return places
    half = 0.5 * _edges(effect, experiment, values, count)
    corners = [places[0] - half, places[0] + half]
    bounds = experiment.structure.modes.bounds()
    # A part ends with its line; what a box holds has no end of its own.
    return corners if in_space(bounds) else [np.clip(corner, *bounds) for corner in corners]


def locations_as_read(
    effect: Effect, experiment: Experiment, values: Values, count: int, field: str = ""
) -> PointsInSpace:
    """Where an effect is felt [m], see `locations`: of nodes alone the nearest.

    What reaches over a part is felt at all nodes of it, so that its middle need be none.
    """
    points = locations(effect, experiment, values, count, field)
    nearest = _nodes_alone(effect, experiment)
    if nearest is None:
        return points
    return np.where(np.isnan(points), points, jax.lax.map(nearest.closest, jnp.asarray(points)))


def _nodes_alone(effect: Effect, experiment: Experiment) -> Nearest | None:
    """Nodes at one of which an effect acts; None where the motion is known between them."""
    nodal = nodal_of(experiment.structure.modes)
    interpolation = None if nodal is None else nodal.interpolation
    acts_at_one = isinstance(effect, AtPlace) and not isinstance(effect, _OVER)
    return interpolation if isinstance(interpolation, Nearest) and acts_at_one else None


def lengths_as_read(
    effect: Effect, experiment: Experiment, values: Values, count: int
) -> dict[str, np.ndarray]:
    """Unknown coordinates of the nodes at which an effect acts, by name; none without nodes alone.

    Arguments are those of `locations`.
    """
    read: dict[str, np.ndarray] = {}
    are_nodes = _nodes_alone(effect, experiment) is not None
    for unknown in experiment.unknowns_of(effect) if are_nodes else ():
        place = getattr(effect, unknown.field)
        if isinstance(place, Place):
            points = locations_as_read(effect, experiment, values, count, unknown.field)
            nodes, which = np.unique(points, axis=0, return_inverse=True)
            lengths = [float(place.nearest(triple(node))[unknown.component]) for node in nodes]
            read[unknown.name] = np.array(lengths)[which]
    return read


def _edges(
    effect: OverExtent | DampingLayer, experiment: Experiment, values: Values, count: int
) -> PointsInSpace:
    """Edges of a part [m]; of a part of a line its length comes first."""
    edges = effect.extent if isinstance(effect.extent, tuple) else (effect.extent, 0.0, 0.0)
    unknowns = experiment.unknowns_of(effect)
    drawn = iter(values[unknown.name] for unknown in unknowns if unknown.field == "extent")
    columns = [
        next(drawn) if is_unknown(edge) else np.full(count, float(edge or 0.0)) for edge in edges
    ]
    return np.stack(columns, axis=-1)


def effect_locations(experiment: Experiment, means: Mapping[str, float]) -> dict[str, Recorded]:
    """Where each effect of an experiment is felt [m], by name; those without a place not."""
    located: dict[str, Recorded] = {}
    values = {name: np.array([value]) for name, value in means.items()}
    for effect in experiment.effects:
        (at,) = locations_as_read(effect, experiment, values, 1)
        if np.isfinite(at).all():
            located[effect.name] = triple(at)
        elif np.isfinite(at[0]):
            located[effect.name] = float(at[0])
    return located


def _in_space(place: Place, values: Values, count: int) -> PointsInSpace:
    if isinstance(place, Straight):
        origin, directions, components = place.frame()
        lengths = [
            np.broadcast_to(values.get(name, mean(length)), count)
            for name, length in components.items()
        ]
        return origin + np.stack(lengths, axis=-1) @ directions
    return np.broadcast_to(np.asarray(compiled(_coordinates)(place, dict(values))), (count, 3))


def _coordinates(place: Place, values: Mapping[str, Array]) -> Float[Array, "point coordinate"]:
    return jax.vmap(lambda point: substitute(place, point).coordinates())(values)
