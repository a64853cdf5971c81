"""A law spread over a part of the structure: any law, and what all that is so attached shares."""

import dataclasses
from typing import ClassVar, TypeAlias, TypeVar

from .._shared.errors import InputError
from ..modes.ports import FEWER, over
from ..positions.bounds import in_space
from .attached import GivenLaw
from .effect import NetworkAttachment
from .prelude import NOT_NEGATIVE, Law, Modes, Parameter, Points, coordinates, field, unit

Spread = TypeVar("Spread", bound="OverExtent")

Edge: TypeAlias = Parameter | None

Extent: TypeAlias = Parameter | tuple[Edge, Edge, Edge]
"""Length [m] on a line; edges of a box along x, y and z in space [m], None for no edge."""


class OverExtent(NetworkAttachment):
    """Something attached all over an extent, each place of which bears its share."""

    tried_last: ClassVar[bool] = True
    takes_long: ClassVar[bool] = True
    extent: Extent = field(metadata=unit("m", within=NOT_NEGATIVE))
    is_rough: bool = field(static=True, default=False, kw_only=True, repr=False)

    acts_on = "region"

    def on(self, modes: Modes) -> "OverExtent":
        """Return the effect with its middle placed on a structure."""
        check_extent(self.name, self.extent, modes)
        return NetworkAttachment.on(without_flat_edges(self), modes)

    def points(self, modes: Modes) -> Points:
        """Ports all over the extent, on each of which all of the law acts."""
        fewer = FEWER if self.is_rough else 1.0
        return over(coordinates(self.at), self.extent, self.direction, modes, fewer).points

    def roughly(self: Spread) -> Spread:
        """Return the effect with fewer ports."""
        return dataclasses.replace(self, is_rough=True)


def without_flat_edges(effect: "OverExtent") -> "OverExtent":
    """Return the effect with None for edges of zero: a number is known too late to leave it out."""
    extent = effect.extent
    if not isinstance(extent, tuple | list):
        return effect
    edges = tuple(None if isinstance(edge, int | float) and edge == 0 else edge for edge in extent)
    return dataclasses.replace(effect, extent=edges)


def check_extent(name: str, extent: object, modes: Modes) -> None:
    """Refuse an extent of another number of edges than the structure has coordinates."""
    edges = len(extent) if isinstance(extent, tuple | list) else 1
    needed = 3 if in_space(modes.bounds()) else 1
    if edges != needed:
        line = "extent=0.1" if needed == 1 else "extent=(0.1, 0.05, 0.0)"
        raise InputError(
            f'Effect "{name}": an extent of {edges} numbers was given; {needed} is needed, the '
            f"length on a line, or the edges of a box along x, y and z in space: {line}."
        )


class Over(GivenLaw, OverExtent):
    """A law spread evenly over a segment or box of the structure.

    Parameters
    ----------
    at, direction
        Middle of the part [m], and along which vector; None for every motion there is.
    extent
        Its length on a line [m]; in space the edges of a box along x, y and z [m].
    law
        Law of all of it together, a network of springs, dashpots and masses.
    strength
        Factor on the law [1].

    Examples
    --------
    >>> felt = bp.effects.Spring(2e4) | bp.effects.Dashpot(dist.LogUniform(1.0, 1e3))
    >>> list((experiment + bp.effects.over(0.4, 0.2, felt)).unknown)[1]
    'structure.effects.over.law.parts.2.viscosity'
    """

    law: Law
    strength: Parameter = field(metadata=unit("1"), default=1.0)
    name: str = field(static=True, default="over", kw_only=True)

    @property
    def kind(self) -> str:
        """Name of its kind, which is that of the network."""
        return f"over a part: {self.law.in_words()}"
