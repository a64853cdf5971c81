"""Points uniform in a ball that a box cuts, as a differentiable map of uniform numbers.

Rosenblatt's transform (1952, DOI 10.1214/aoms/1177729394): the first coordinate by its marginal
distribution, each further one by its distribution given those before. Rejection would be shorter,
but has no gradient, which NUTS and quadrature over positions need.
"""

import functools
import math
from collections.abc import Callable, Iterable
from types import ModuleType
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

Scalar = Float[Array, ""]
Share = Float[Array | np.ndarray, ""] | float | int
Values = TypeVar("Values", Array, np.ndarray)

CELLS = 512
HALVINGS = 60
_TINY = 1e-30  # of the radius squared: keeps slopes of roots finite where a slice is a point


class Cut(NamedTuple):
    """A ball about the origin in one to three dimensions, and the box that cuts it [m]."""

    radius: float
    low: tuple[float, ...]
    high: tuple[float, ...]

    @property
    def is_empty(self) -> bool:
        """Tell whether the box leaves nothing of the ball."""
        return self.radius <= 0 or self.distance_squared(0) >= self.radius**2

    def distance_squared(self, first: int) -> float:
        """Square of the distance [m] from the origin to the box along the axes from `first` on."""
        return math.fsum(self._squares()[first:])

    def box(self) -> tuple[Float[np.ndarray, "axis"], Float[np.ndarray, "axis"]]:
        """Least and greatest corner of what is left [m]."""
        squares = np.array(self._squares())
        reach = np.sqrt(self.radius**2 - np.sum(squares) + squares)
        return np.maximum(self.low, -reach), np.minimum(self.high, reach)

    def _squares(self) -> list[float]:
        sides = zip(self.low, self.high, strict=True)
        return [min(max(0.0, low), high) ** 2 for low, high in sides]


class _Marginal(NamedTuple):
    """Distribution of one coordinate, not normalised: antiderivative of its density, and ends."""

    cumulative: Callable[[Scalar], Scalar]
    density: Callable[[Scalar], Scalar]
    low: Scalar
    high: Scalar

    def at_share(self, share: Share) -> Scalar:
        """Value of the antiderivative below which a share of the total lies."""
        start = self.cumulative(self.low)
        return start + share * (self.cumulative(self.high) - start)


def point(cut: Cut, shares: Iterable[Share]) -> list[Scalar]:
    """Coordinates of the point with these shares, each from 0 to 1: uniform if they are."""
    square, coordinates = jnp.asarray(cut.radius**2), []
    for axis, share in enumerate(shares):
        coordinate = _quantile(cut, axis, square, share)
        coordinates.append(coordinate)
        square = square - coordinate**2
    return coordinates


def shares(cut: Cut, point: Iterable[Share]) -> list[Scalar]:
    """Shares of a point, clipped axis by axis to the cut ball."""
    square, shares = jnp.asarray(cut.radius**2), []
    for axis, coordinate in enumerate(point):
        marginal = _marginal(cut, axis, square)
        clipped = jnp.clip(coordinate, marginal.low, marginal.high)
        below = marginal.cumulative(clipped) - marginal.at_share(0)
        shares.append(below / (marginal.at_share(1) - marginal.at_share(0)))
        square = square - clipped**2
    return shares


def _marginal(cut: Cut, axis: int, square: Scalar) -> _Marginal:
    """Distribution of one coordinate, where the square is the radius squared less those before."""
    reach = _root(square - cut.distance_squared(axis + 1), cut, jnp)
    low, high = jnp.maximum(cut.low[axis], -reach), jnp.minimum(cut.high[axis], reach)
    remaining_axes = len(cut.low) - axis
    if remaining_axes == 1:
        return _Marginal(lambda x: x, jnp.ones_like, low, high)
    if remaining_axes == 2:
        return _Marginal(
            lambda y: _area_below(cut, y, square, jnp), lambda y: _width(cut, square, y), low, high
        )
    return _Marginal(
        lambda x: _interpolated(cut, x), lambda x: _slice(cut, cut.radius**2 - x**2, jnp), low, high
    )


def _quantile(cut: Cut, axis: int, square: Scalar, share: Share) -> Scalar:
    """Coordinate below which a share of the total lies."""
    marginal = _marginal(cut, axis, square)
    if axis == len(cut.low) - 1:
        return marginal.low + share * (marginal.high - marginal.low)
    fixed_square, fixed_share = jax.lax.stop_gradient((square, share))
    root = jax.lax.stop_gradient(_bisected(_marginal(cut, axis, fixed_square), fixed_share))
    # One Newton step from a constant root has the exact derivative of the root.
    slope = jax.lax.stop_gradient(jnp.maximum(marginal.density(root), _TINY))
    step = (marginal.cumulative(root) - marginal.at_share(share)) / slope
    return jnp.clip(root - step, marginal.low, marginal.high)


def _bisected(marginal: _Marginal, share: Share) -> Scalar:
    target = marginal.at_share(share)

    def halve(_: object, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        middle = (ends[0] + ends[1]) / 2
        below = marginal.cumulative(middle) < target
        return jnp.where(below, middle, ends[0]), jnp.where(below, ends[1], middle)

    low, high = jax.lax.fori_loop(0, HALVINGS, halve, (marginal.low, marginal.high))
    return (low + high) / 2


def _root(square: Values, cut: Cut, xp: ModuleType) -> Values:
    return xp.sqrt(xp.maximum(square, _TINY * cut.radius**2))


def _width(cut: Cut, square: Scalar, y: Scalar) -> Scalar:
    """Width of a disc within the last two sides of the box, at a coordinate across it."""
    half = _root(square - y**2, cut, jnp)
    return jnp.clip(cut.high[-1], -half, half) - jnp.clip(cut.low[-1], -half, half)


def _area_below(cut: Cut, y: Values, square: Values, xp: ModuleType) -> Values:
    """Area of a disc between the last two sides of the box, below y, up to a constant."""
    upper = _area_under(cut, cut.high[-1], y, square, xp)
    return upper - _area_under(cut, cut.low[-1], y, square, xp)


def _area_under(cut: Cut, level: float, y: Values, square: Values, xp: ModuleType) -> Values:
    """Integral up to y of a level clipped to the half width of the disc, up to a constant."""

    def segment(t: Values) -> Values:
        half = _root(square - t**2, cut, xp)
        return (t * half + square * xp.arctan2(t, half)) / 2

    corner = _root(square - level**2, cut, xp)
    inner = xp.clip(y, -corner, corner)
    return math.copysign(1.0, level) * (segment(y) - segment(inner) + abs(level) * inner)


def _slice(cut: Cut, square: Values, xp: ModuleType) -> Values:
    """Area of a disc within the last four sides of the box."""
    reach = _root(square - cut.distance_squared(2), cut, xp)
    low, high = xp.maximum(cut.low[1], -reach), xp.minimum(cut.high[1], reach)
    return _area_below(cut, high, square, xp) - _area_below(cut, low, square, xp)


class _Volumes(NamedTuple):
    """Volume below equally spaced coordinates, and the area there."""

    start: float
    step: float
    volume: Float[np.ndarray, "node"]
    area: Float[np.ndarray, "node"]


@functools.lru_cache(maxsize=256)
def _volumes(cut: Cut) -> _Volumes:
    low, high = (ends[0] for ends in cut.box())
    node, weight = np.polynomial.legendre.leggauss(8)
    edges = np.linspace(low, high, CELLS + 1)
    step = (high - low) / CELLS
    inside = edges[:-1, None] + step * (node + 1) / 2
    parts = step / 2 * (_slice(cut, cut.radius**2 - inside**2, np) @ weight)
    area = _slice(cut, cut.radius**2 - edges**2, np)
    return _Volumes(low, step, np.concatenate([[0.0], np.cumsum(parts)]), area)


def _interpolated(cut: Cut, x: Scalar) -> Scalar:
    """Volume below x by cubics with the exact values and slopes at the nodes."""
    table = _volumes(cut)
    steps = (x - table.start) / table.step
    cell = jnp.clip(jnp.floor(steps), 0, CELLS - 1).astype(int)
    t = steps - cell
    volume, area = jnp.asarray(table.volume), table.step * jnp.asarray(table.area)
    rise = volume[cell + 1] - volume[cell]
    bend = (area[cell] - rise) * (1 - t) - (area[cell + 1] - rise) * t
    return volume[cell] + t * rise + t * (1 - t) * bend
