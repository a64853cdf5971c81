"""Coordinates, directions and rotations in space, checked."""

from collections.abc import Sequence
from typing import TypeAlias

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._shared.arguments import arguments_checked, shown
from .._shared.errors import InputError

CartesianComponents = tuple[float, float, float]
"""Components of a position or direction along x, y and z."""

PointsInSpace = Float[np.ndarray, "point 3"]
"""Cartesian coordinates [m] of points."""

Recorded: TypeAlias = float | CartesianComponents
"""A position as one number on a line or three in space [m]."""

Vector: TypeAlias = Sequence[float | int] | np.ndarray
"""Three numbers, in any container."""

_PERPENDICULAR = 1e-9  # greatest cosine between two directions at right angles


def triple(values: object) -> CartesianComponents:
    """Return three numbers as a tuple."""
    x, y, z = np.asarray(values, dtype=float).tolist()
    return x, y, z


def vector(argument: str, values: object) -> CartesianComponents:
    """Return three finite numbers as a tuple.

    What they were given as is for the error.
    """
    array = _numbers(values)
    if array.shape != (3,) or not np.all(np.isfinite(array)):
        stated = array.tolist() if 0 < array.size < 9 else shown(values)
        raise InputError(
            f"{argument} was given {stated}; three finite numbers along x, y and z [m] are "
            "needed, since the structure lies in space: (0.2, 0.0, 0.9)."
        )
    return triple(array)


def _numbers(values: object) -> np.ndarray:
    """Numbers as an array; an empty one where there are none."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):  # words, objects
        return np.zeros(0)


def direction_of(argument: str, values: object) -> CartesianComponents:
    """Return a direction of unit length, or refuse one that has none."""
    array = np.array(vector(argument, values))
    length = np.linalg.norm(array)
    if not length > 0:
        raise InputError(
            f"{argument} was given {array.tolist()}, which has no direction; a vector other than "
            "zero is needed: (0.0, 0.0, 1.0)."
        )
    return triple(array / length)


def right_angled(
    argument: str, first: object, second: object
) -> tuple[CartesianComponents, CartesianComponents]:
    """Return two directions of unit length at right angles."""
    first = direction_of(f"{argument}(first direction)", first)
    second = direction_of(f"{argument}(second direction)", second)
    cosine = np.dot(first, second)
    if abs(cosine) > _PERPENDICULAR:
        perpendicular = np.array(second) - cosine * np.array(first)
        raise InputError(
            f"{argument} was given directions {first} and {second}; two at right angles are "
            "needed, so that lengths along them are independent. At right angles to the first: "
            f"second={direction_of(argument, perpendicular)}."
        )
    return first, second


@arguments_checked
def rotation(angles: Float[Array, "3"]) -> Float[Array, "3 3"]:
    r"""Rotation matrix R = R_x(t_x) R_y(t_y) R_z(t_z), active and right-handed.

    Column j is the true direction, in global axes, of the axis recorded as j. This is Eq. (10)
    of the paper with its entry (1, 2) corrected to -C_y S_z, without which R is not orthogonal.

    Parameters
    ----------
    angles
        Euler angles t_x, t_y, t_z [rad].

    Examples
    --------
    >>> np.asarray(bp.positions.rotation(jnp.array([0.0, 0.0, np.pi / 2]))).round(12) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    cx, cy, cz = jnp.cos(angles)
    sx, sy, sz = jnp.sin(angles)
    return jnp.array(
        [
            [cy * cz, -cy * sz, sy],
            [sz * cx + sx * sy * cz, cz * cx - sx * sy * sz, -sx * cy],
            [sx * sz - cx * sy * cz, sx * cz + cx * sy * sz, cx * cy],
        ]
    )


def unit_vector(direction: int) -> Float[np.ndarray, "3"]:
    """Unit vector of a recorded direction, +-1, +-2 or +-3 for +-x, +-y or +-z."""
    sign = 1.0 if direction > 0 else -1.0
    return sign * np.eye(3)[abs(direction) - 1]
