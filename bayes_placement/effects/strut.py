"""Something that connects two places of the structure."""

from collections.abc import Sequence

import jax.numpy as jnp

from ..modes.ports import difference
from .effect import NetworkAttachment, Place, placed
from .prelude import Law, Modes, Parameter, Points, Scales, Spring, coordinates, field, unit


class Strut(NetworkAttachment):
    """A law between the displacements of two places, as of a strut, a tie or a loose cable.

    In space it acts along its line where nothing else is said; on a line or plate along the only
    direction of motion. A mass has no place in it: it would have to be fixed to the ground.

    Parameters
    ----------
    at, to
        Its two ends [m].
    law
        What connects them: springs and dashpots [N/m], or [N s/m].
    strength
        Factor on the law [1].
    direction
        Direction of the displacements, three numbers.

    Examples
    --------
    >>> tie = bp.effects.strut(0.2, 0.7, bp.effects.Spring(dist.LogUniform(1e3, 1e6)))
    >>> list((experiment + tie).unknown)[1]
    'structure.effects.strut.law.stiffness'
    """

    tried_by_default = False
    absent = ("strength", 0.0)
    acts_on = "relative"
    place_fields = ("at", "to")
    to: Place = field(metadata=unit("m"))
    law: Law
    strength: Parameter = field(metadata=unit("1"), default=1.0)
    name: str = field(static=True, default="strut", kw_only=True)

    @property
    def kind(self) -> str:
        """Name of its kind, which is that of the network."""
        return f"strut: {self.law.in_words()}"

    def on(self, modes: Modes) -> "Strut":
        """Return the effect with both ends placed on a structure."""
        return placed(NetworkAttachment.on(self, modes), modes, "to")

    def points(self, modes: Modes) -> Points:
        """The displacement of one end less that of the other."""
        ends = coordinates(self.at), coordinates(self.to)
        direction: Sequence[object] | None = self.direction
        if direction is None and len(modes.axes) > 1:
            direction = tuple(jnp.asarray(ends[0]) - jnp.asarray(ends[1]))
        return difference(*ends, direction, modes)

    def network(self) -> Law:
        """Return the law, scaled."""
        return self.strength * self.law

    @classmethod
    def suggest(cls, scales: Scales) -> list["Strut"]:
        """A spring of 1e-5 to 100 times the modal stiffness, between any two places."""
        spring = Spring(scales.any_stiffness)
        places = scales.places()
        pairs = [(one, other) for i, one in enumerate(places) for other in places[i:]]
        return [cls(one, other, spring) for one, other in pairs]
