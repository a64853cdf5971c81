"""Ports of each kind, made of points, and what hangs on them.

A rotation, a difference, a cut, a segment or box.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeGuard

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact

from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from ..positions.bounds import in_space
from . import _cuts
from .beams.waveguide import Waveguide
from .changed import original_waveguide
from .modes import Coordinates, Modes
from .points import Points, along, joined

Vector = Sequence[object] | None

POLYNOMIALS, POLYNOMIALS_OF_EDGE = 16, 7
"""Legendre polynomials over a segment, and over an edge of a box: a half-wave needs about two.

Products of those of the edges of a box are taken up to the same degree in all.
"""

NODES, NODES_OF_EDGE = 128, 9
"""Gauss nodes, many since the flexibility of a bar has a kink where two places meet."""

FEWER = 1.75
"""So many times fewer tell where something acts: over a box responses take a fifth of the time."""

MOTIONS = ("displacement", "rotation")
"""Motions of a port at one place."""


class PortLaw(NamedTuple):
    """Ports, and the dynamic stiffness N / D on each of them.

    As a pair, so that a strength of zero is N = 0 and changes nothing, bit for bit, and a pole,
    D = 0, holds the port.
    """

    points: Points
    """The ports."""
    numerator: Inexact[Array, "*port frequency"]
    denominator: Inexact[Array, "*port frequency"] | float = 1.0
    """N and D at each line, the same of all ports or of each one; of a displacement N / D is in
    N/m, of a rotation in N m/rad, of a cut less its compliance."""

    def of_each(self) -> tuple[Inexact[Array, "port frequency"], Inexact[Array, "port frequency"]]:
        """Numerator and denominator of each port, at each line."""
        shape = (self.points.count, jnp.shape(self.numerator)[-1])
        parts = (self.numerator, self.denominator)
        numerator, denominator = (jnp.broadcast_to(jnp.asarray(part), shape) for part in parts)
        return numerator, denominator


class Extent(NamedTuple):
    """Ports over a segment or box: the means of the displacement times Legendre polynomials.

    The polynomials are orthogonal, so that a law spread evenly acts on each port as all of it does.
    Fewer are needed than nodes of a quadrature: the displacement is smooth, but the flexibility
    between two places is not where they meet.
    """

    points: Points
    """The ports, one for each polynomial and direction."""
    length: Float[Array, ""]
    """Length of a segment that lies on the line [m]; 1 of a box."""


def rotation(place: Coordinates, footprint: Vector, direction: Vector, modes: Modes) -> Points:
    """Return the rotation [rad] at a place: of a beam its slope.

    In space it is the difference of two displacements along a direction over the footprint between
    them [m], since the rotation under a moment at a point grows beyond all bounds.
    """
    if in_space(modes.bounds()):
        return _rotation_of_footprint(place, footprint, direction, modes)
    if original_waveguide(modes).half_order == 1:
        raise InputError(
            "A rotation of a bar was given, but a bar moves along its axis only and has none. "
            'Use beams.beam, or a motion that it has: motion="displacement".'
        )
    return Points(place[None], np.ones((1, 1)), orders=(1,))


def _rotation_of_footprint(
    place: Coordinates, footprint: Vector, direction: Vector, modes: Modes
) -> Points:
    if footprint is None or (direction is None and len(modes.axes) > 1):
        raise InputError(
            "A rotation of a structure in space was given without a footprint; the vector between "
            "the edges of the foot and the direction in which these move are needed, since under a "
            "moment at a point a plate or solid rotates without bounds: "
            "footprint=(0.02, 0, 0), direction=(0, 0, 1)."
        )
    arm = jnp.stack([jnp.asarray(component, float) for component in footprint])
    ends = along(place, direction, modes)
    return Points(
        jnp.concatenate([ends.position + arm / 2, ends.position - arm / 2]),
        jnp.concatenate([jnp.asarray(ends.direction)] * 2),
        combination=jnp.array([[1.0, -1.0]]) / jnp.linalg.norm(arm),
    )


def difference(place: Coordinates, other: Coordinates, direction: Vector, modes: Modes) -> Points:
    """Return the displacement at one place less that at another [m], along a direction.

    By default along each axis in which the structure moves.
    """
    ends = [along(end, direction, modes) for end in (place, other)]
    count = ends[0].count
    combination = jnp.concatenate([jnp.eye(count), -jnp.eye(count)], axis=1)
    return dataclasses.replace(joined(ends), combination=combination)


def beside(place: Coordinates, offset: object, modes: Modes) -> Points:
    """Return the displacement [m] at the end of a rigid arm along a beam, w + offset w'."""
    slope = rotation(place, None, None, modes)
    return on_arms(slope.position, slope.direction, jnp.asarray(offset, float))


def on_arms(
    position: Float[Array, "port"],
    direction: Float[Array | np.ndarray, "port axis"],
    arm: Float[Array, ""],
) -> Points:
    """Return the displacement at the end of a rigid arm [m] along a beam from each place.

    Of each port its displacement comes first, then its slope.
    """
    count, repeat = len(position), np.repeat if isinstance(direction, np.ndarray) else jnp.repeat
    return Points(
        jnp.repeat(position, 2),
        repeat(direction, 2, axis=0),
        orders=(0, 1) * count,
        combination=jnp.kron(jnp.eye(count), jnp.stack([jnp.ones(()), arm])),
    )


def singly(points: Points) -> Points:
    """Points as a batch of single ones; on arms each with its slope."""
    if points.combination is None:
        return jax.tree.map(lambda leaf: jnp.asarray(leaf)[:, None], points)
    count = points.count
    own = jnp.diagonal(points.combination.reshape(count, count, 2)).T
    places = points.position.reshape(count, 2), jnp.asarray(points.direction).reshape(count, 2, -1)
    errors = None if points.shape_error is None else points.shape_error[:, None]
    return jax.vmap(lambda at, way, error, of: Points(at, way, error, (0, 1), of))(
        *places, errors, own[:, None]
    )


def cut(place: Coordinates, motion: str, modes: Modes) -> Points:
    """Return the internal force at a cut of a bar or beam, for the modulus as drawn.

    Its two sides move against each other: by a `rotation` under the bending moment [N m] of a beam,
    by a `displacement` under the axial force [N] of a bar or the shear force [N] of a beam.
    """
    waveguide = original_waveguide(modes)
    order = waveguide.half_order + (waveguide.half_order == 2 and motion == "displacement")
    sign = (-1) ** (order - waveguide.half_order)
    stiffness = jnp.broadcast_to(sign * jnp.asarray(waveguide.stiffness, float), (1, 1))
    at = _cuts.cut(waveguide, [place], [order]).positions
    return Points(at, stiffness, orders=(order,))


def cuts_over(extent: Extent, modes: Modes) -> Points:
    """Return the bending moment or axial force all over an extent, for the modulus as drawn.

    At each node it is the mean over what the node stands for, so that it does not jump where an
    instrument passes one.
    """
    waveguide, points = original_waveguide(modes), extent.points
    places = len(points.position)
    stiffness = jnp.broadcast_to(jnp.asarray(waveguide.stiffness, float), (places, 1))
    orders = (waveguide.half_order,) * places
    assert points.combination is not None
    widths = extent.length * points.combination[0]
    return Points(points.position, stiffness, None, orders, points.combination, widths)


def over(
    middle: Coordinates, extent: object, direction: Vector, modes: Modes, fewer: float = 1.0
) -> Extent:
    """Return ports all over a segment of a line or a box in space, about its middle.

    The extent is its length [m]; in space its three edges [m], None for those that it does not
    have. What lies outside of a line is left out. Along each edge they are so many times fewer.
    """
    if in_space(modes.bounds()):
        places, means, length = _box(middle, extent, fewer)
    else:
        places, means, length = _segment(middle, extent, modes, fewer)
    each = [along(place, direction, modes) for place in places]
    combination = jnp.asarray(np.kron(means, np.eye(each[0].count)))
    return Extent(dataclasses.replace(joined(each), combination=combination), length)


Means = Float[np.ndarray, "polynomial node"]
OverNodes = tuple[Float[Array, "node *coordinate"], Means, Float[Array, ""]]


def _segment(middle: Coordinates, extent: Parameter, modes: Modes, fewer: float) -> OverNodes:
    """Nodes on a line, weights of the means over it, and the length on the line."""
    node, means = _means(POLYNOMIALS, NODES, fewer)
    low, high = map(jnp.asarray, modes.bounds())
    ends = [jnp.clip(middle + side * extent / 2, low, high) for side in (-1, 1)]
    length = ends[1] - ends[0]
    return (ends[0] + ends[1]) / 2 + node * length / 2, means, length


def _box(middle: Coordinates, extent: Any, fewer: float) -> OverNodes:
    """Nodes in a box, and weights of the means over it; an edge of None has one node."""
    flat = [edge is None for edge in extent]
    point = np.zeros(1), np.ones((1, 1))
    along_edge = _means(POLYNOMIALS_OF_EDGE, NODES_OF_EDGE, fewer)
    edges = [point if zero else along_edge for zero in flat]
    nodes = [node for node, _ in edges]
    means, degree = np.ones((1, 1)), np.zeros(1, dtype=int)
    for _, of_edge in edges:
        means = np.kron(means, of_edge)
        degree = np.add.outer(degree, np.arange(len(of_edge))).ravel()
    means = means[degree < len(along_edge[1])]
    offsets = np.stack(np.meshgrid(*nodes, indexing="ij"), axis=-1).reshape(-1, 3) / 2
    sizes = jnp.stack([jnp.asarray(0.0 if edge is None else edge, float) for edge in extent])
    return middle + offsets * sizes, means, jnp.ones(())


def _means(polynomials: int, nodes: int, fewer: float) -> tuple[Float[np.ndarray, "node"], Means]:
    """Gauss nodes from -1 to 1, and weights of the means of a function times each polynomial."""
    polynomials = round(polynomials / fewer)
    node, weight = np.polynomial.legendre.leggauss(round(nodes / fewer))
    norm = np.sqrt(2 * np.arange(polynomials) + 1)
    values = np.polynomial.legendre.legvander(node, polynomials - 1)
    return node, (norm * values).T * (weight / 2)


def is_beam(modes: Modes) -> TypeGuard[Waveguide]:
    """Tell whether a structure is a uniform beam, which alone has slopes."""
    return isinstance(modes, Waveguide) and modes.half_order == 2
