"""Read what a user writes behind `at=`, and check it against the structure."""

from typing import NamedTuple, TypeAlias

import jax
import numpy as np

from .._shared.arguments import finite_number
from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.ranges import described, reach
from .._shared.sites import is_finite, is_unknown
from .bounds import (
    Bounds,
    bounds_text,
    in_space,
    one_coordinate_needed,
    position_text,
    rounding_margin,
    three_coordinates_needed,
)
from .places import AtNode, Cartesian, Place, Position, Value
from .tolerances import Tolerance
from .vectors import Recorded

SINGLE_PRECISION = 1e-6
"""Rounding of single precision, over the extent of a structure."""

At: TypeAlias = Position | Tolerance | tuple[Parameter, ...] | list[Parameter]
"""A position as a user may write it: one or three numbers, a distribution, place or tolerance."""


class RecordedPosition(NamedTuple):
    """Where something sits on a structure, and where it was recorded."""

    position: Position
    """Its position [m]: numbers and distributions."""
    recorded: Recorded
    """Its recorded position [m]."""

    def at_record(self, component: str) -> Value | Recorded:
        """Value of an unknown component of the position where it was recorded."""
        if not isinstance(self.position, Place):
            return self.recorded
        return self.position.nearest(self.recorded)[component]


def position_on(at: At, bounds: Bounds, owner: str, word: str = "position") -> Position:
    """Return a position as numbers and distributions.

    Its owner and what it is called are for the errors.
    """
    place = as_place(at)
    if isinstance(place, Tolerance):
        try:
            return place.on(bounds)
        except ValueError as error:
            raise InputError(f"{owner}: {error}") from error
    if _coordinate_count(place) != (3 if in_space(bounds) else 1):
        needed = three_coordinates_needed if in_space(bounds) else one_coordinate_needed
        raise InputError(f"{owner}: {word} {_text(place)} was given, but {needed(bounds)}")
    _check_inside(place, bounds, f"{owner}: {word}")
    return place


def as_place(at: At) -> Position | Tolerance:
    """Return three numbers or distributions as a place, all else as it is."""
    if isinstance(at, Cartesian):
        _check_coordinates(at.x, at.y, at.z)
    if isinstance(at, Place | Tolerance) or is_unknown(at):
        return at
    if not isinstance(at, tuple | list) and np.ndim(at) != 1:
        _check_number(at)
        return at
    if len(at) != 3:
        raise InputError(
            f"A position of {len(at)} coordinates was given; one number on a line or three along "
            "x, y and z [m] in space are needed: at=(0.2, 0.0, 0.9)."
        )
    _check_coordinates(*at)
    return Cartesian(*at)


def _check_coordinates(*coordinates: object) -> None:
    for coordinate in coordinates:
        if not is_unknown(coordinate):
            _check_number(coordinate)


def _check_number(at: object) -> None:
    """Refuse what is no number; one that is computed passes."""
    if not isinstance(at, jax.core.Tracer):
        finite_number(
            "at", at, "at=0.25, at=(0.2, 0.0, 0.9) or at=positions.Segment(0.25, within=0.01)"
        )


def _coordinate_count(place: Position) -> int:
    if isinstance(place, AtNode):
        return int(np.prod(place.position.shape[1:], initial=1))
    if isinstance(place, Place):
        return 3
    return int(np.prod(place.shape() if is_unknown(place) else np.shape(place), initial=1))


def _check_inside(place: object, bounds: Bounds, owner: str) -> None:
    values = (place.x, place.y, place.z) if isinstance(place, Cartesian) else (place,)
    sides = zip(values, np.atleast_1d(bounds[0]), np.atleast_1d(bounds[1]), strict=False)
    margin = rounding_margin(bounds)
    if all(_may_lie_between(value, low, high, margin) for value, low, high in sides):
        return
    tolerance = "Box" if in_space(bounds) else "Segment"
    raise InputError(
        f"{owner} {_text(place)} m lies outside the structure ({bounds_text(bounds)}). Mode shapes "
        f"are only known on the structure; use positions.{tolerance} within it."
    )


def _may_lie_between(value: object, low: Value, high: Value, margin: float) -> bool:
    if is_unknown(value) and value.shape() == () and not is_finite(value):
        limits = (low, high, margin)
        if any(isinstance(limit, jax.core.Tracer) for limit in limits):
            return True
        first, last = reach(value)
        # Meshes and bounds of transforms come in single precision; what is not known may be inside.
        rounding = max(margin, SINGLE_PRECISION * float(high - low))
        starts_inside = np.isinf(first) or low - rounding <= first
        return bool(starts_inside and (np.isinf(last) or last <= high + rounding))
    return not isinstance(value, int | float) or bool(low - margin <= value <= high + margin)


def _text(place: object) -> str:
    """Write a position as it was given."""
    if isinstance(place, int | float):
        return position_text(place)
    if isinstance(place, Cartesian):
        return f"({_text(place.x)}, {_text(place.y)}, {_text(place.z)})"
    return described(place) if is_unknown(place) else type(place).__name__
