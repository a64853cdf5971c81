"""Any law attached to one place of the structure."""

from .._sites import TURNS, unit
from ..modes.ports import MOTIONS, rotation
from .on_rotation import Footprint, check_rotation
from .one_of import check_one_of
from .prelude import Law, Modes, NetworkAttachment, Parameter, Points, Scales, coordinates, field


class Attached(NetworkAttachment):
    """A law between one place of the structure and the ground, on its displacement or rotation.

    Parameters
    ----------
    at
        Where it is attached [m].
    law
        What is attached, a network of springs, dashpots and masses: of a rotation in N m for N.
    strength
        Factor on the law [1].
    motion
        `displacement` or `rotation`.
    footprint
        Of a rotation in space, the vector between the edges of the foot [m].
    direction
        Direction in which it acts; None for every one in which the structure moves.

    Examples
    --------
    >>> law = bp.effects.Spring(1e4) - bp.effects.Dashpot(dist.LogUniform(1.0, 1e3))
    >>> list((experiment + bp.effects.attached(0.4, law, name="mount")).unknown)[1]
    'structure.effects.mount.law.parts.2.viscosity'
    """

    tried_by_default = False
    absent = ("strength", 0.0)
    law: Law = field(metadata={TURNS: lambda effect: effect.motion == "rotation"})
    strength: Parameter = field(metadata=unit("1"), default=1.0)
    motion: str = field(static=True, default="displacement", kw_only=True)
    footprint: Footprint = field(default=None, kw_only=True)
    name: str = field(static=True, default="attached", kw_only=True)

    @property
    def kind(self) -> str:
        """Name of its kind, which is that of the network."""
        motion = "" if self.motion == "displacement" else f" to {self.motion}"
        return f"attached{motion}: {self.law.in_words()}"

    @property
    def acts_on(self) -> str:
        """What it acts on, as a result says it."""
        return self.motion

    def on(self, modes: Modes) -> "Attached":
        """Return the effect placed on a structure that has this motion."""
        check_one_of(self, "motion", MOTIONS)
        if self.motion == "rotation":
            check_rotation(self.footprint, self.direction, modes)
        return NetworkAttachment.on(self, modes)

    def points(self, modes: Modes) -> Points:
        """The displacement along its directions, or the rotation."""
        if self.motion == "displacement":
            return NetworkAttachment.points(self, modes)
        return rotation(coordinates(self.at), self.footprint, self.direction, modes)

    def network(self) -> Law:
        """Return the law, scaled."""
        return self.strength * self.law

    @classmethod
    def suggest(cls, scales: Scales) -> list["Attached"]:
        """Return none: the law is yours."""
        return []
