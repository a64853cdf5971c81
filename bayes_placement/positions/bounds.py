"""bounds: in, the stretch or box that a structure fills; out, what of a line or place is in it.

Not known here: supports, laws. A line has a least and a greatest position, a structure in space a
least and a greatest corner.
"""

from typing import Any, TypeAlias

import numpy as np
from jaxtyping import Bool, Float

from .._types import InputError
from .vectors import Coordinates

Corners = tuple[Coordinates, Coordinates]

Bounds: TypeAlias = tuple[Any, Any] | Corners
"""Least and greatest position on a line, or the corners of the box about a structure [m]."""

HAIR = 1e-9  # of the size of the structure, by which a place may miss it through rounding


def in_space(bounds: Bounds) -> bool:
    """Tell whether a structure extends in space or along a line."""
    return np.ndim(bounds[0]) == 1


def box(bounds: Bounds, what: Any) -> Corners:
    """Corners of the box about a structure in space [m].

    Raises
    ------
    ValueError
        If the structure is a line.
    """
    if not in_space(bounds):
        raise InputError(f"{what} was given, but {not_in_space(bounds)}")
    low, high = bounds
    return low, high


def hair(bounds: Bounds) -> float:
    """Length [m] by which a place may miss a structure through rounding."""
    return HAIR * float(np.max(np.subtract(bounds[1], bounds[0])))


def inside(
    points: Float[np.ndarray, "point *coordinate"], bounds: Bounds
) -> Bool[np.ndarray, "point"]:
    """Tell which points are in the bounds, but for rounding."""
    slack = hair(bounds)
    within = (points >= np.subtract(bounds[0], slack)) & (points <= np.add(bounds[1], slack))
    return np.all(within.reshape(len(points), -1), axis=1)


def clipped(
    origin: np.ndarray, direction: np.ndarray, stretch: tuple[float, float], corners: Corners
) -> tuple[float, float]:
    """Part of a stretch along a direction [m] that is in a box, by the axes that it goes along."""
    low, high = stretch
    for start, slope, *sides in zip(origin, direction, *corners, strict=True):
        if abs(slope) > HAIR:
            ends = sorted((side - start) / slope for side in sides)
            low, high = max(low, ends[0]), min(high, ends[1])
    return low, high


def words(bounds: Bounds) -> str:
    """Write the bounds: 0 to 1.2 m."""
    low, high = (said(one) for one in bounds)
    return f"{low} to {high} m"


def said(position: Any) -> str:
    """Write a position: 0.2, or (0.2, 0, 0.9)."""
    if np.ndim(position) == 0:
        return f"{position:g}"
    return "(" + ", ".join(f"{one:g}" for one in position) + ")"


def not_a_line(bounds: Bounds) -> str:
    """Say what is needed on a structure in space."""
    middle = said(np.add(*bounds) / 2)
    return (
        f"the structure lies in space ({words(bounds)}), where a place has three coordinates: "
        f"at={middle}, or at=positions.Box({middle}, within=(0.01, 0.0, 0.0))."
    )


def not_in_space(bounds: Bounds) -> str:
    """Say what is needed on a line."""
    middle = said(np.add(*bounds) / 2)
    return (
        f"the structure is a line ({words(bounds)}), along which a place is one number: "
        f"at={middle}, or at=positions.Segment({middle}, within=0.01)."
    )
