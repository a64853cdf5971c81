"""Bounds of a structure: the stretch of a line or the box in space that it fills."""

from typing import TypeAlias

import numpy as np
from jaxtyping import Bool, Float

from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .vectors import CartesianComponents, Vector

Corners = tuple[CartesianComponents, CartesianComponents]

Bounds: TypeAlias = tuple[Parameter, Parameter] | Corners
"""Least and greatest position on a line, or the corners of the box about a structure [m]."""

ROUNDING = 1e-9  # of the size of the structure, by which a position may miss it


def in_space(bounds: Bounds) -> bool:
    """Tell whether a structure extends in space or along a line."""
    return np.ndim(bounds[0]) == 1


def box(bounds: Bounds, tolerance: object) -> Corners:
    """Corners of the box about a structure in space [m]."""
    if not in_space(bounds):
        raise InputError(f"{tolerance} was given, but {one_coordinate_needed(bounds)}")
    low, high = bounds
    return low, high


def rounding_margin(bounds: Bounds) -> float:
    """Length [m] by which a position may miss a structure through rounding."""
    return ROUNDING * float(np.max(np.subtract(bounds[1], bounds[0])))


def inside(
    points: Float[np.ndarray, "point *coordinate"], bounds: Bounds
) -> Bool[np.ndarray, "point"]:
    """Tell which points lie within the bounds, but for rounding."""
    margin = rounding_margin(bounds)
    within = (points >= np.subtract(bounds[0], margin)) & (points <= np.add(bounds[1], margin))
    return np.all(within.reshape(len(points), -1), axis=1)


def clipped(
    origin: np.ndarray, direction: np.ndarray, stretch: tuple[float, float], corners: Corners
) -> tuple[float, float]:
    """Part of a stretch along a direction [m] that lies in a box."""
    low, high = stretch
    for start, slope, *sides in zip(origin, direction, *corners, strict=True):
        if abs(slope) > ROUNDING:
            ends = sorted((side - start) / slope for side in sides)
            low, high = max(low, ends[0]), min(high, ends[1])
    return low, high


def bounds_text(bounds: Bounds) -> str:
    """Write the bounds: 0 to 1.2 m."""
    low, high = (position_text(end) for end in bounds)
    return f"{low} to {high} m"


def position_text(position: Parameter | Vector) -> str:
    """Write a position: 0.2, or (0.2, 0, 0.9)."""
    if np.ndim(position) == 0:
        return f"{position:g}"
    return "(" + ", ".join(f"{coordinate:g}" for coordinate in np.ravel(position)) + ")"


def three_coordinates_needed(bounds: Bounds) -> str:
    """Say what a position on a structure in space needs."""
    middle = position_text(np.add(*bounds) / 2)
    return (
        f"the structure lies in space ({bounds_text(bounds)}), where a position has three "
        f"coordinates: at={middle}, or at=positions.Box({middle}, within=(0.01, 0.0, 0.0))."
    )


def one_coordinate_needed(bounds: Bounds) -> str:
    """Say what a position on a line needs."""
    middle = position_text(np.add(*bounds) / 2)
    return (
        f"the structure is a line ({bounds_text(bounds)}), along which a position is one number: "
        f"at={middle}, or at=positions.Segment({middle}, within=0.01)."
    )
