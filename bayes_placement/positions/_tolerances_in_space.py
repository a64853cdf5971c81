"""Tolerances in space: a box, a member, a patch of a surface, a ball; clipped to the structure."""

import abc
from typing import Any

import equinox as eqx
import numpy as np
from numpyro.distributions import Uniform

from .._shared.arguments import check_annotated, finite_number
from .._shared.errors import InputError
from .._shared.reprs import with_short_repr
from .._shared.sites import unit
from .bounds import ROUNDING, Bounds, bounds_text, box, clipped, inside, rounding_margin
from .places import Cartesian, InBall, OnMember, OnPatch, Position
from .vectors import (
    CartesianComponents,
    Recorded,
    Vector,
    direction_of,
    right_angled,
    triple,
    vector,
)


@with_short_repr
class Tolerance(eqx.Module):
    """Region in which something may sit; a structure makes a distribution of it.

    Examples
    --------
    >>> isinstance(bp.positions.Segment(0.2, within=0.02), bp.positions.Tolerance)
    True
    """

    @property
    @abc.abstractmethod
    def recorded(self) -> Recorded:
        """Recorded position [m]."""

    @abc.abstractmethod
    def on(self, bounds: Bounds) -> Position:
        """Uniform distribution of the position [m], clipped to the structure.

        Raises
        ------
        InputError
            If no part of the region lies on the structure, or it is larger than the structure.
        """

    @abc.abstractmethod
    def around(self, centre: object) -> "Tolerance":
        """Return the same tolerance about another recorded position [m]."""

    @abc.abstractmethod
    def scaled(self, factor: float) -> "Tolerance":
        """Return a tolerance `factor` times as large about the same position.

        Raises
        ------
        InputError
            If it has no size to scale.
        """


def check_reach(tolerance: Tolerance, reach: float, bounds: Bounds) -> None:
    """Refuse a tolerance that says nothing of the position, as millimetres taken for metres do."""
    size = float(np.max(np.subtract(bounds[1], bounds[0])))
    if reach > size:
        raise InputError(
            f"{tolerance} reaches {reach:g} m to either side, farther than the structure "
            f"({bounds_text(bounds)}) is long; a tolerance in metres is needed: {reach / 1000:g} "
            f"for {reach:g} mm. Where nothing is known of the position, {size:g} is enough."
        )


def off_structure(tolerance: Tolerance, bounds: Bounds) -> str:
    """Say that no part of a tolerance lies on the structure."""
    return (
        f"{tolerance} has no point on the structure ({bounds_text(bounds)}). A position on it is "
        "needed, in metres and in its axes."
    )


_OFF_AXIS = 0.1  # of the length of a member, by which a recorded position may miss its axis


class Box(Tolerance):
    """A box along the axes of the structure about the recorded position.

    Parameters
    ----------
    centre
        Recorded position [m].
    within
        Greatest deviation to either side along x, y and z [m], zero where there is none.

    Examples
    --------
    >>> bp.positions.Box((0.5, 0.4, 0.0), within=(0.02, 0.01, 0.0)).scaled(0.5)
    Box(centre=(0.5, 0.4, 0) m, within=(0.01, 0.005, 0) m)
    """

    centre: CartesianComponents = eqx.field(static=True, metadata=unit("m"))
    within: CartesianComponents = eqx.field(static=True, metadata=unit("m"))

    def __init__(self, centre: Vector, *, within: Vector):
        self.centre = vector("Box(centre=...)", centre)
        self.within = vector("Box(within=...)", within)
        if min(self.within) < 0 or max(self.within) == 0:
            raise InputError(
                f"Box(within={self.within}) was given; tolerances [m] that are not negative and "
                "not all zero are needed. For a position known exactly, give the three numbers "
                f"themselves: at={self.centre}."
            )

    @property
    def recorded(self) -> CartesianComponents:
        """Recorded position [m]."""
        return self.centre

    def around(self, centre: Any) -> "Box":
        """Return the same tolerances about another recorded position."""
        return Box(centre, within=self.within)

    def scaled(self, factor: float) -> "Box":
        """Return a box `factor` times as large about the same position."""
        return Box(self.centre, within=triple(factor * np.array(self.within)))

    def on(self, bounds: Bounds) -> Cartesian:
        """Uniform distribution of each coordinate [m] along which box and structure extend."""
        corners = box(bounds, self)
        check_reach(self, max(self.within), bounds)
        sides = zip(self.centre, self.within, *corners, strict=True)
        coordinates = [_side(*side, rounding_margin(corners)) for side in sides]
        if any(coordinate is None for coordinate in coordinates):
            raise InputError(off_structure(self, bounds))
        x, y, z = coordinates
        return Cartesian(x, y, z)  # type: ignore[arg-type]


class Member(Tolerance):
    """A stretch of a straight member of a frame.

    Parameters
    ----------
    start, end
        Where its axis begins and ends [m].
    centre
        Recorded position [m], projected onto the axis; None for the entire member.
    within
        Greatest deviation along the member to either side [m].

    Examples
    --------
    >>> start, end = (0.0, 0.0, 0.0), (1.0, 1.0, 0.0)
    >>> bp.positions.Member(start, end, centre=(0.5, 0.5, 0.0), within=0.1).recorded
    (0.5, 0.5, 0.0)
    """

    start: CartesianComponents = eqx.field(static=True, metadata=unit("m"))
    end: CartesianComponents = eqx.field(static=True, metadata=unit("m"))
    centre: CartesianComponents | None = eqx.field(static=True, metadata=unit("m"))
    within: float | None = eqx.field(static=True, metadata=unit("m"))

    def __init__(
        self,
        start: Vector,
        end: Vector,
        *,
        centre: Vector | None = None,
        within: float | int | None = None,
    ):
        self.start, self.end = vector("Member(start=...)", start), vector("Member(end=...)", end)
        self.centre = None if centre is None else vector("Member(centre=...)", centre)
        check_annotated("within", within, float | None)
        self.within = None if within is None else float(within)
        direction_of("Member(end - start)", np.subtract(self.end, self.start))
        if (self.centre is None) != (self.within is None) or not self._reach() > 0:
            raise InputError(
                f"Member(centre={centre}, within={within}) was given; a recorded position "
                "and a positive tolerance [m] are needed, or neither for the entire member: "
                "centre=(0.0, 0.0, 0.7), within=0.02."
            )
        self._check_on_axis()

    def _reach(self) -> float:
        return np.inf if self.within is None else self.within

    def _check_on_axis(self) -> None:
        if self.centre is None:
            return
        along, direction, length = self._foot()
        distance = np.linalg.norm(np.subtract(self.centre, self.start) - along * direction)
        if distance > _OFF_AXIS * length:
            raise InputError(
                f"Member(centre={self.centre}) lies {distance:g} m off the axis from {self.start} "
                f"to {self.end} m, more than a tenth of its length; a position on this member is "
                "needed. Give the member that it is on."
            )

    def _foot(self) -> tuple[float, np.ndarray, float]:
        """Recorded position along the member [m], its direction and its length [m]."""
        axis = np.subtract(self.end, self.start)
        length = float(np.linalg.norm(axis))
        centre = np.add(self.start, self.end) / 2 if self.centre is None else self.centre
        return float((centre - np.array(self.start)) @ axis / length), axis / length, length

    @property
    def recorded(self) -> CartesianComponents:
        """Recorded position [m], or the middle of the member."""
        return triple(np.add(self.start, self.end) / 2) if self.centre is None else self.centre

    def around(self, centre: Any) -> "Member":
        """Return the same tolerance about another place on the member."""
        return Member(self.start, self.end, centre=centre, within=self.within)

    def scaled(self, factor: float) -> "Member":
        """Return a stretch `factor` times as long about the same position."""
        if self.within is None:
            raise InputError(
                "A positions.Member without `within` was to have another tolerance, but its "
                "tolerance is the entire member. Give a recorded position: centre=(0.0, 0.0, 0.7), "
                "within=0.02."
            )
        return Member(self.start, self.end, centre=self.centre, within=factor * self.within)

    def on(self, bounds: Bounds) -> OnMember:
        """Uniform distribution of the distance from the start [m]."""
        corners = box(bounds, self)
        check_reach(self, self.within or 0.0, bounds)
        foot, direction, length = self._foot()
        stretch = (max(foot - self._reach(), 0.0), min(foot + self._reach(), length))
        low, high = clipped(np.array(self.start), direction, stretch, corners)
        ends = np.array(self.start) + np.outer((low, high), direction)
        if not low < high or not inside(ends, corners).all():
            raise InputError(off_structure(self, bounds))
        return OnMember(Uniform(low, high), start=self.start, direction=triple(direction))


class Patch(Tolerance):
    """A flat rectangular patch of a surface.

    Parameters
    ----------
    centre
        Recorded position [m].
    first, second
        Two directions in the surface, at right angles, of any length.
    within
        Greatest deviation to either side along each of them [m].

    Examples
    --------
    >>> bp.positions.Patch((0.5, 0.4, 0.0), (1, 0, 0), (0, 1, 0), within=(0.02, 0.01)).recorded
    (0.5, 0.4, 0.0)
    """

    centre: CartesianComponents = eqx.field(static=True, metadata=unit("m"))
    directions: tuple[CartesianComponents, CartesianComponents] = eqx.field(static=True)
    within: tuple[float, float] = eqx.field(static=True, metadata=unit("m"))

    def __init__(
        self,
        centre: Vector,
        first: Vector,
        second: Vector,
        *,
        within: tuple[float | int, float | int],
    ):
        self.centre = vector("Patch(centre=...)", centre)
        self.directions = right_angled("Patch", first, second)
        check_annotated("within", within, tuple[float, float])
        self.within = (float(within[0]), float(within[1]))
        if not min(self.within) > 0:
            raise InputError(
                f"Patch(within={within}) was given; two positive tolerances [m] are needed. A "
                "position that is uncertain along one direction only is a positions.Member."
            )

    @property
    def recorded(self) -> CartesianComponents:
        """Recorded position [m]."""
        return self.centre

    def around(self, centre: Any) -> "Patch":
        """Return the same patch about another recorded position."""
        return Patch(centre, *self.directions, within=self.within)

    def scaled(self, factor: float) -> "Patch":
        """Return a patch `factor` times as large about the same position."""
        within = (factor * self.within[0], factor * self.within[1])
        return Patch(self.centre, *self.directions, within=within)

    def on(self, bounds: Bounds) -> OnPatch:
        """Uniform distribution of the distances from the centre along both directions [m]."""
        corners = box(bounds, self)
        check_reach(self, max(self.within), bounds)
        centre, directions = np.array(self.centre), np.array(self.directions)
        unshared = np.sum(np.abs(directions) > ROUNDING, axis=0) == 1
        sides = [
            clipped(centre, direction * unshared, (-within, within), corners)
            for direction, within in zip(directions, self.within, strict=True)
        ]
        if not all(low < high for low, high in sides):
            raise InputError(off_structure(self, bounds))
        (left, right), (low, high) = sides
        lengths = np.array([[left, low], [left, high], [right, low], [right, high]])
        if not inside(centre + lengths @ directions, corners).all():
            raise InputError(
                f"{self} reaches out of the structure ({bounds_text(bounds)}), and what is left "
                "of it is empty or no rectangle along its two directions. Make `within` smaller, "
                "or turn the directions along the edge that cuts it."
            )
        return OnPatch(
            Uniform(left, right), Uniform(low, high), origin=self.centre, directions=self.directions
        )


class Ball(Tolerance):
    """A ball: a position that is equally uncertain in all directions.

    Parameters
    ----------
    centre
        Recorded position [m].
    radius
        Greatest deviation [m].

    Examples
    --------
    >>> bp.positions.Ball((0.5, 0.4, 0.0), radius=0.02).recorded
    (0.5, 0.4, 0.0)
    """

    centre: CartesianComponents = eqx.field(static=True, metadata=unit("m"))
    radius: float = eqx.field(static=True, metadata=unit("m"))

    def __init__(self, centre: Vector, radius: float | int):
        self.centre = vector("Ball(centre=...)", centre)
        self.radius = finite_number("Ball(radius)", radius, "positions.Ball((0, 0, 0), 0.1)")
        if not 0 < self.radius < np.inf:
            raise InputError(
                f"Ball(radius={radius}) was given; a positive radius [m] is needed. For a position "
                f"known exactly, give the three numbers themselves: at={self.centre}."
            )

    @property
    def recorded(self) -> CartesianComponents:
        """Recorded position [m]."""
        return self.centre

    def around(self, centre: Any) -> "Ball":
        """Return the same ball about another recorded position."""
        return Ball(centre, self.radius)

    def scaled(self, factor: float) -> "Ball":
        """Return a ball `factor` times as large about the same position."""
        return Ball(self.centre, factor * self.radius)

    def on(self, bounds: Bounds) -> InBall:
        """Uniform distribution in the part of the ball within the box about the structure."""
        low, high = box(bounds, self)
        check_reach(self, self.radius, bounds)
        place = InBall((), self.centre, self.radius, (low, high))
        if place.cut.is_empty:
            raise InputError(off_structure(self, bounds))
        shares = (Uniform(0.0, 1.0),) * sum(place.axes)
        return InBall(shares, self.centre, self.radius, (low, high))


def _side(
    centre: float, within: float, low: float, high: float, margin: float
) -> Uniform | float | None:
    """One coordinate of a box [m]; None where it misses the structure."""
    start, end = max(centre - within, low), min(centre + within, high)
    if within > 0 and high - low > margin:
        return Uniform(start, end) if start < end else None
    return (start + end) / 2 if start <= end + margin else None
