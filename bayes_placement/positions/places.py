"""Places: positions whose coordinates are numbers or distributions."""

import abc
from collections.abc import Sequence
from typing import NamedTuple, TypeAlias

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpyro.distributions import Distribution, Uniform

from .._shared.compiled import compiled
from .._shared.dimensions import Parameter
from .._shared.reprs import with_short_repr
from .._shared.sites import is_finite, is_unknown, unit
from . import _ball_in_box
from .vectors import (
    CartesianComponents,
    Recorded,
    Vector,
    direction_of,
    right_angled,
    triple,
    vector,
)

Value: TypeAlias = Array | np.ndarray | float | int
"""A number, or one that is computed."""


@with_short_repr
class Place(eqx.Module):
    """A position, some of whose coordinates may be unknown."""

    @abc.abstractmethod
    def coordinates(self) -> Float[Array, "*coordinate"]:
        """Position [m], once its coordinates are numbers."""

    @abc.abstractmethod
    def middle(self) -> Recorded:
        """Position at the means of its distributions [m]."""

    @abc.abstractmethod
    def nearest(self, position: Recorded) -> dict[str, Value]:
        """Values of its unknown coordinates, by name, nearest to a position [m]."""


Position: TypeAlias = Parameter | Place
"""A number on a line, a place in space, or the distribution of either."""


class Frame(NamedTuple):
    """An origin [m], orthonormal directions, and the lengths along them [m]."""

    origin: Float[np.ndarray, "3"]
    directions: Float[np.ndarray, "axis 3"]
    values: dict[str, Parameter]

    def distance(self, position: Recorded) -> float:
        """Distance of a position from the piece on which the uniform lengths lie [m]."""
        feet = self.directions @ (np.asarray(position) - self.origin)
        pairs = zip(self.values.values(), feet, strict=True)
        nearest = [np.clip(foot, at.low, at.high) if is_unknown(at) else at for at, foot in pairs]
        return float(np.linalg.norm(self.origin + np.array(nearest) @ self.directions - position))


class Straight(Place):
    """A place whose coordinates are lengths along fixed directions."""

    @abc.abstractmethod
    def frame(self) -> Frame:
        """Origin and directions along which its coordinates are measured."""

    def coordinates(self) -> Float[Array, "3"]:
        """Position [m]: the origin and the lengths along the directions."""
        origin, directions, values = self.frame()
        lengths = jnp.stack([jnp.asarray(value, dtype=float) for value in values.values()])
        return jnp.asarray(origin) + lengths @ directions

    def middle(self) -> CartesianComponents:
        """Position at the means of its distributions [m]."""
        origin, directions, values = self.frame()
        return triple(origin + np.array([mean(value) for value in values.values()]) @ directions)

    def nearest(self, position: Recorded) -> dict[str, Value]:
        """Lengths at the foot of a position [m], clipped to their uniform distributions."""
        origin, directions, values = self.frame()
        feet = directions @ (np.asarray(position) - origin)
        pairs = zip(values.items(), feet, strict=True)
        return {name: _clipped(value, foot) for (name, value), foot in pairs if is_unknown(value)}


class Cartesian(Straight):
    """A place by its coordinates in the axes of the structure.

    Parameters
    ----------
    x, y, z
        Coordinates [m], each a number or a distribution.

    Examples
    --------
    >>> bp.Sensor("s1", at=bp.positions.Cartesian(0.5, dist.Uniform(0.38, 0.42), 0.0))
    Sensor "s1" at (0.5, 0.4, 0) m, position.y Uniform(0.38, 0.42)
    """

    x: Parameter = eqx.field(metadata=unit("m"))
    y: Parameter = eqx.field(metadata=unit("m"))
    z: Parameter = eqx.field(metadata=unit("m"))

    def frame(self) -> Frame:
        """The axes of the structure."""
        return Frame(np.zeros(3), np.eye(3), {"x": self.x, "y": self.y, "z": self.z})


class OnMember(Straight):
    """A place on a straight member.

    Parameters
    ----------
    along
        Distance from the start [m], a number or a distribution.
    start
        Where the member begins [m].
    direction
        Direction of the member, a vector of any length.

    Examples
    --------
    >>> strut = bp.positions.Member((0.0, 0.0, 0.0), (1.0, 0.8, 0.0))
    >>> isinstance(strut.on(plate.bounds()), bp.positions.OnMember)
    True
    """

    along: Parameter = eqx.field(metadata=unit("m"))
    start: CartesianComponents = eqx.field(static=True, metadata=unit("m"))
    direction: CartesianComponents = eqx.field(static=True)

    def __init__(self, along: Parameter, *, start: Vector, direction: Vector):
        self.along = along
        self.start = vector("OnMember(start=...)", start)
        self.direction = direction_of("OnMember(direction=...)", direction)

    def frame(self) -> Frame:
        """The line of the member."""
        directions = np.array([self.direction])
        return Frame(np.array(self.start), directions, {"along": self.along})


class OnPatch(Straight):
    """A place on a flat patch.

    Parameters
    ----------
    first, second
        Distances from the origin along the two directions [m], numbers or distributions.
    origin
        Where they are measured from [m].
    directions
        Two directions at right angles, of any length.

    Examples
    --------
    >>> patch = bp.positions.Patch((0.5, 0.4, 0.0), (1, 0, 0), (0, 1, 0), within=(0.02, 0.02))
    >>> isinstance(patch.on(plate.bounds()), bp.positions.OnPatch)
    True
    """

    first: Parameter = eqx.field(metadata=unit("m"))
    second: Parameter = eqx.field(metadata=unit("m"))
    origin: CartesianComponents = eqx.field(static=True, metadata=unit("m"))
    directions: tuple[CartesianComponents, CartesianComponents] = eqx.field(static=True)

    def __init__(
        self, first: Parameter, second: Parameter, *, origin: Vector, directions: Sequence[Vector]
    ):
        self.first, self.second = first, second
        self.origin = vector("OnPatch(origin=...)", origin)
        self.directions = right_angled("OnPatch", *directions)

    def frame(self) -> Frame:
        """The plane of the patch."""
        values = {"first": self.first, "second": self.second}
        return Frame(np.array(self.origin), np.array(self.directions), values)


class InBall(Place):
    """A place in a ball cut by a box: uniform in what is left if its shares are.

    Parameters
    ----------
    share
        Share of the cut ball below the place along each axis in which the box extends, given the
        axes before [1]: numbers from 0 to 1 or distributions.
    centre
        Centre [m].
    radius
        Radius [m].
    bounds
        Least and greatest corner of the box [m]. Where both agree the place is in their plane.

    Examples
    --------
    >>> ball = bp.positions.Ball((0.5, 0.4, 0.0), radius=0.02)
    >>> isinstance(ball.on(plate.bounds()), bp.positions.InBall)
    True
    """

    share: tuple[Parameter, ...] = eqx.field(metadata=unit("1"))
    centre: CartesianComponents = eqx.field(static=True, metadata=unit("m"))
    radius: float = eqx.field(static=True, metadata=unit("m"))
    bounds: tuple[CartesianComponents, CartesianComponents] = eqx.field(
        static=True, metadata=unit("m")
    )

    def coordinates(self) -> Float[Array, "3"]:
        """Position [m], by Rosenblatt's transform."""
        free = iter(_ball_in_box.point(self.cut, self.share))
        axes = zip(self.axes, self.centre, self.bounds[0], strict=True)
        values = [centre + next(free) if extends else low for extends, centre, low in axes]
        return jnp.stack([jnp.asarray(value, dtype=float) for value in values])

    @property
    def axes(self) -> tuple[bool, bool, bool]:
        """Tell along which axes the box extends."""
        first, second, third = (low < high for low, high in zip(*self.bounds, strict=True))
        return first, second, third

    @property
    def cut(self) -> _ball_in_box.Cut:
        """The section of the ball by the box, about the centre of the ball."""
        sides = list(zip(self.axes, self.centre, *self.bounds, strict=True))
        lost = sum((low - middle) ** 2 for extends, middle, low, _ in sides if not extends)
        return _ball_in_box.Cut(
            max(self.radius**2 - lost, 0.0) ** 0.5,
            tuple(low - middle for extends, middle, low, _ in sides if extends),
            tuple(high - middle for extends, middle, _, high in sides if extends),
        )

    def middle(self) -> CartesianComponents:
        """Centre of the ball [m], or the point of the box nearest to it."""
        return triple(np.clip(self.centre, *self.bounds))

    def nearest(self, position: Recorded) -> dict[str, Value]:
        """Shares of a position [m], clipped axis by axis to the cut ball."""
        steps = np.asarray(position) - np.array(self.centre)
        shares = compiled(_ball_in_box.shares)(self.cut, steps[np.array(self.axes)])
        return {
            f"share.{number}": value
            for number, (share, value) in enumerate(zip(self.share, shares, strict=True), start=1)
            if is_unknown(share)
        }


class AtNode(Place):
    """A place at one of finitely many nodes, Eqs. (13) and (16) of the paper.

    Parameters
    ----------
    node
        Which of them, counted from 0: a number or `numpyro.distributions.Categorical`.
    position
        Where they are [m].
    row
        Row of each in the list of nodes from which they were chosen.
    weight_error
        Greatest standard error of a weight of the distribution; 0 where the weights are exact.

    Examples
    --------
    >>> ball = bp.positions.Ball((0.5, 0.4, 0.0), radius=0.6)
    >>> near = bp.positions.Nodes(plane.position, ball)
    >>> isinstance(near.on(plate.bounds()), bp.positions.AtNode)
    True
    """

    node: Parameter = eqx.field(metadata=unit("1"))
    position: Float[np.ndarray, "node *coordinate"]
    row: Int[np.ndarray, "node"]
    weight_error: float = eqx.field(static=True, default=0.0)

    def coordinates(self) -> Float[Array, "*coordinate"]:
        """Position of the node [m]."""
        return jnp.asarray(self.position)[self.node]

    def middle(self) -> Recorded:
        """Mean of the nodes by their weights, or the node itself [m]."""
        weight = self.node.probs if is_unknown(self.node) else np.eye(len(self.row))[self.node]
        mean_position = np.asarray(weight) @ np.asarray(self.position)
        return float(mean_position) if mean_position.ndim == 0 else triple(mean_position)

    def nearest(self, position: Recorded) -> dict[str, Value]:
        """The node nearest to a position [m]."""
        steps = np.asarray(self.position) - np.asarray(position)
        distance = np.linalg.norm(steps.reshape(len(steps), -1), axis=1)
        return {"node": int(np.argmin(distance))} if is_unknown(self.node) else {}


def coordinates(position: object) -> Float[Array, "*coordinate"]:
    """Coordinates [m] of a number on a line or of a place in space."""
    return position.coordinates() if isinstance(position, Place) else jnp.asarray(position, float)


def typical(distribution: Distribution) -> Value:
    """Mean of a distribution, or its most probable value where values are only labels.

    Of transformed and truncated ones NumPyro may know no mean: their median.
    """
    if is_finite(distribution):
        return jnp.argmax(distribution.log_prob(distribution.enumerate_support()))
    try:
        return distribution.mean
    except NotImplementedError:
        return distribution.icdf(0.5)


def mean(value: Parameter) -> float:
    """A number or the mean of its distribution; NaN while it is traced."""
    if is_unknown(value):
        return float(value.mean)
    return float("nan") if isinstance(value, jax.core.Tracer) else float(value)


def _clipped(distribution: Parameter, value: Value) -> Value:
    if isinstance(distribution, Uniform):
        return jnp.clip(value, distribution.low, distribution.high)
    return value
