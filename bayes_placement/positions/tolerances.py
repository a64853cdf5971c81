"""tolerances: in, a recorded place and a tolerance; out, the uniform law of where it may be.

Not known here: mode shapes, sensors, data. Every support is clipped to the structure.
"""

from typing import Any

import equinox as eqx
import numpy as np
from jaxtyping import Float
from numpyro.distributions import Uniform

from .._types import InputError
from ._nearest_nodes import at_nodes
from ._supports_in_space import Ball, Box, Member, Patch
from .bounds import Bounds, in_space, inside, not_a_line, not_in_space, words
from .places import Place
from .tolerance_region import Support
from .vectors import Recorded, triple

__all__ = ["Ball", "Box", "Member", "Nodes", "Patch", "Segment", "Support"]


class Segment(Support):
    """A stretch of a line structure: recorded place and what the glue may be off.

    Parameters
    ----------
    centre
        Recorded position along the structure [m].
    within
        Greatest deviation to either side [m]. The law is uniform, the least informative one
        (section 2.1 of the paper).
    """

    centre: float = eqx.field(static=True)
    within: float = eqx.field(static=True)

    def __init__(self, centre: float | int, *, within: float | int):
        self.centre = float(centre)
        self.within = float(within)
        if not self.within > 0:
            raise InputError(
                f"Segment(within={within}) was given; a positive tolerance [m] is needed. For a "
                f"position known exactly, give the number itself: at={centre}."
            )

    @property
    def recorded(self) -> float:
        """Recorded position [m]."""
        return self.centre

    def around(self, centre: Any) -> "Segment":
        """Return the same tolerance about another place."""
        return Segment(centre, within=self.within)

    def scaled(self, factor: float) -> "Segment":
        """Return a segment so many times as long about the same place."""
        return Segment(self.centre, within=factor * self.within)

    def on(self, bounds: Bounds) -> Uniform:
        """Uniform law along the line, see `Segment.law`."""
        if in_space(bounds):
            raise InputError(
                f"Segment({self.centre}, within={self.within}) was given, but {not_a_line(bounds)}"
            )
        return self.law(bounds)  # type: ignore[arg-type]

    def law(self, bounds: tuple[float, float]) -> Uniform:
        """Uniform law of the position [m], clipped to the structure.

        Raises
        ------
        ValueError
            If no part of the segment lies on the structure.
        """
        low = max(self.centre - self.within, bounds[0])
        high = min(self.centre + self.within, bounds[1])
        if not low < high:
            raise InputError(
                f"Segment({self.centre}, within={self.within}) m has no point on the structure "
                f"({bounds[0]:g} to {bounds[1]:g} m)."
            )
        return Uniform(low, high)


class Nodes(Support):
    """The nodes of a mesh: the paper's localization at the nearest node, Eqs. (13) and (16).

    Each node has the share of the support that is nearest to it: exact for a segment, a member, a
    patch and a box that extends along one or two axes; from scrambled Sobol points otherwise, with
    the standard error in `places.AtNode.weight_error`.

    Parameters
    ----------
    position
        Where the nodes are [m].
    support
        What the true place is uniform in; None where every node is as likely as any other.
    """

    position: Float[np.ndarray, "node *coordinate"]
    support: Support | None

    def __init__(self, position: Any, support: Support | None = None):
        self.position = np.asarray(position, dtype=float)
        self.support = support
        shape = self.position.shape
        if shape[1:] not in ((), (3,)) or len(shape) == 0 or shape[0] == 0:
            raise InputError(
                f"Nodes(position of shape {shape}) was given; positions [m] of at least one node "
                "are needed, three coordinates each in space (node, 3), or one on a line (node,)."
            )

    @property
    def recorded(self) -> Recorded:
        """Recorded position of the support, or the middle of the nodes [m]."""
        if self.support is not None:
            return self.support.recorded
        middle = np.mean(self.position, axis=0)
        return float(middle) if middle.ndim == 0 else triple(middle)

    def around(self, centre: Any) -> "Nodes":
        """Return the nodes about another place, with the tolerance of the support."""
        return Nodes(self.position, None if self.support is None else self.support.around(centre))

    def scaled(self, factor: float) -> "Nodes":
        """Return the nodes about the same place, the tolerance of the support so much larger."""
        if self.support is None:
            raise InputError(
                "Nodes without a support were to have another tolerance, but they have none: every "
                "node is as likely as any other. Give one: "
                "positions.Nodes(position, positions.Segment(0.3, within=0.01))."
            )
        return Nodes(self.position, self.support.scaled(factor))

    def on(self, bounds: Bounds) -> Place:
        """Law of the nearest node: a categorical law over those that may be nearest."""
        if in_space(bounds) != (self.position.ndim == 2):
            told = not_a_line(bounds) if in_space(bounds) else not_in_space(bounds)
            raise InputError(
                f"Nodes(position of shape {self.position.shape}) was given, but {told}"
            )
        law = None if self.support is None else self.support.on(bounds)
        on_structure = inside(self.position, bounds)
        if not on_structure.any():
            raise InputError(
                f"None of {len(on_structure)} nodes lies on the structure ({words(bounds)}). Nodes "
                "of its own model are needed, in metres and in its axes."
            )
        return at_nodes(self.position, on_structure, law)
