"""vectors: in, numbers in any container; out, coordinates and directions in space, checked.

Not known here: what they belong to.
"""

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from .._types import InputError

Coordinates = tuple[float, float, float]

Recorded: TypeAlias = float | Coordinates
"""A place as a number on a line or three in space [m]."""

Vector: TypeAlias = Sequence[float | int] | np.ndarray
"""Three numbers, in any container."""


def triple(values: Any) -> Coordinates:
    """Return three numbers as a tuple."""
    x, y, z = (float(one) for one in values)
    return x, y, z


def vector(what: str, values: Any) -> Coordinates:
    """Return three finite numbers as a tuple.

    Raises
    ------
    ValueError
        If they are no three finite numbers.
    """
    given = np.asarray(values, dtype=float)
    if given.shape != (3,) or not np.all(np.isfinite(given)):
        raise InputError(
            f"{what} was given {given.tolist()}; three finite numbers along x, y and z [m] are "
            "needed, since the structure lies in space: (0.2, 0.0, 0.9)."
        )
    return triple(given)


def direction_of(what: str, values: Any) -> Coordinates:
    """Return a direction of unit length.

    Raises
    ------
    ValueError
        If it has no length.
    """
    given = np.array(vector(what, values))
    length = np.linalg.norm(given)
    if not length > 0:
        raise InputError(
            f"{what} was given {given.tolist()}, which has no direction; a step other than zero is "
            "needed: (0.0, 0.0, 1.0)."
        )
    return triple(given / length)


def right_angled(what: str, first: Any, second: Any) -> tuple[Coordinates, Coordinates]:
    """Return two directions of unit length at right angles.

    Raises
    ------
    ValueError
        If they are not at right angles.
    """
    one = direction_of(f"{what}(first direction)", first)
    other = direction_of(f"{what}(second direction)", second)
    if abs(np.dot(one, other)) > 1e-9:
        straight = np.array(other) - np.dot(one, other) * np.array(one)
        raise InputError(
            f"{what} was given directions {one} and {other}; two at right angles are needed, so "
            "that lengths along them are independent. Beside the first: second="
            f"{direction_of(what, straight)}."
        )
    return one, other
