"""Tolerances of a recorded position; each makes a distribution of it on a structure."""

from typing import Any, cast

import equinox as eqx
import numpy as np
from jaxtyping import Float
from numpyro.distributions import Uniform

from .._shared.arguments import check_annotated, finite_number
from .._shared.errors import InputError
from .._shared.sites import unit
from ._nearest_nodes import at_nearest_node
from ._tolerances_in_space import Ball, Box, Member, Patch, Tolerance, check_reach
from .bounds import (
    Bounds,
    bounds_text,
    in_space,
    inside,
    one_coordinate_needed,
    three_coordinates_needed,
)
from .places import Place
from .vectors import Recorded, triple

__all__ = ["Ball", "Box", "Member", "Nodes", "Patch", "Segment", "Tolerance"]


class Segment(Tolerance):
    """A stretch of a line structure about the recorded position.

    Parameters
    ----------
    centre
        Recorded position along the structure [m].
    within
        Greatest deviation to either side [m]. The distribution is uniform, the least
        informative one (section 2.1 of the paper).

    Examples
    --------
    >>> place = bp.positions.Segment(0.2, within=0.02).on(bar.bounds())
    >>> round(float(place.low), 2), round(float(place.high), 2)
    (0.18, 0.22)
    """

    centre: float = eqx.field(static=True, metadata=unit("m"))
    within: float = eqx.field(static=True, metadata=unit("m"))

    def __init__(self, centre: float | int, *, within: float | int):
        if isinstance(within, int | float) and not within > 0:
            raise InputError(
                f"Segment(within={within}) was given; a positive tolerance [m] is needed. For a "
                f"position known exactly, give the number itself: at={centre}."
            )
        self.centre = finite_number("Segment(centre)", centre, "Segment(0.25, within=0.01)")
        self.within = finite_number("Segment(within)", within, "Segment(0.25, within=0.01)")

    @property
    def recorded(self) -> float:
        """Recorded position [m]."""
        return self.centre

    def around(self, centre: Any) -> "Segment":
        """Return the same tolerance about another recorded position."""
        return Segment(centre, within=self.within)

    def scaled(self, factor: float) -> "Segment":
        """Return a segment `factor` times as long about the same position."""
        return Segment(self.centre, within=factor * self.within)

    def on(self, bounds: Bounds) -> Uniform:
        """Uniform distribution of the position [m], clipped to the structure.

        Raises
        ------
        InputError
            If the structure lies in space, no part of the segment lies on it, or the tolerance is
            longer than the structure.
        """
        if in_space(bounds):
            needed = three_coordinates_needed(bounds)
            raise InputError(
                f"Segment({self.centre}, within={self.within}) was given, but {needed}"
            )
        check_reach(self, self.within, bounds)
        start, end = cast(tuple[float, float], bounds)
        low = max(self.centre - self.within, start)
        high = min(self.centre + self.within, end)
        if not low < high:
            raise InputError(
                f"Segment({self.centre}, within={self.within}) m has no point on the structure "
                f"({bounds_text(bounds)})."
            )
        return Uniform(low, high)


class Nodes(Tolerance):
    """The nodes of a mesh: the paper's localization at the nearest node, Eqs. (13) and (16).

    The weight of a node is the share of the tolerance that is nearest to it: exact for a segment, a
    member, a patch and a box that extends along one or two axes; from scrambled Sobol points
    otherwise, with the standard error in `places.AtNode.weight_error`.

    Parameters
    ----------
    position
        Where the nodes are [m].
    tolerance
        What the true position is uniform in; None where all nodes are equally likely.

    Examples
    --------
    >>> ball = bp.positions.Ball((0.5, 0.4, 0.0), radius=0.6)
    >>> bp.positions.Nodes(plane.position, ball).recorded
    (0.5, 0.4, 0.0)
    """

    position: Float[np.ndarray, "node *coordinate"]
    tolerance: Tolerance | None

    def __init__(self, position: object, tolerance: Tolerance | None = None):
        check_annotated("position", position, Float[np.ndarray, "node *coordinate"])
        check_annotated("tolerance", tolerance, Tolerance | None)
        self.position = np.asarray(position, dtype=float)
        self.tolerance = tolerance
        shape = self.position.shape
        if shape[1:] not in ((), (3,)) or len(shape) == 0 or shape[0] == 0:
            raise InputError(
                f"Nodes(position of shape {shape}) was given; positions [m] of at least one node "
                "are needed, three coordinates each in space (node, 3), or one on a line (node,)."
            )

    @property
    def recorded(self) -> Recorded:
        """Recorded position of the tolerance, or the mean of the nodes [m]."""
        if self.tolerance is not None:
            return self.tolerance.recorded
        mean = np.mean(self.position, axis=0)
        return float(mean) if mean.ndim == 0 else triple(mean)

    def around(self, centre: object) -> "Nodes":
        """Return the same nodes, the tolerance about another recorded position."""
        moved = None if self.tolerance is None else self.tolerance.around(centre)
        return Nodes(self.position, moved)

    def scaled(self, factor: float) -> "Nodes":
        """Return the same nodes, the tolerance `factor` times as large."""
        if self.tolerance is None:
            raise InputError(
                "Nodes without a tolerance were to have a larger one, but all nodes are equally "
                "likely. Give them a tolerance: "
                "positions.Nodes(position, positions.Segment(0.3, within=0.01))."
            )
        return Nodes(self.position, self.tolerance.scaled(factor))

    def on(self, bounds: Bounds) -> Place:
        """Categorical distribution of the nearest node, over those that may be nearest."""
        if in_space(bounds) != (self.position.ndim == 2):
            needed = three_coordinates_needed if in_space(bounds) else one_coordinate_needed
            raise InputError(
                f"Nodes(position of shape {self.position.shape}) was given, but {needed(bounds)}"
            )
        place = None if self.tolerance is None else self.tolerance.on(bounds)
        on_structure = inside(self.position, bounds)
        if not on_structure.any():
            raise InputError(
                f"None of {len(on_structure)} nodes lies on the structure ({bounds_text(bounds)}). "
                "Nodes of its own model are needed, in metres and in its axes."
            )
        return at_nearest_node(self.position, on_structure, place)
