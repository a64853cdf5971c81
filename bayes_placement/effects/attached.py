"""Any law attached to one place of the structure, and what all effects of a given law share."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import equinox as eqx

from .._shared.arguments import shown
from .._shared.errors import InputError
from .._shared.sites import LAW_UNITS, OF_ROTATION, unit
from ..modes.ports import MOTIONS, rotation
from .effect import Effect, NetworkAttachment, StructureEffect
from .on_rotation import Footprint, check_rotation
from .prelude import Law, Modes, Parameter, Points, Scales, coordinates, field


class GivenLaw(StructureEffect):
    """An effect whose law the user gives, times a strength."""

    tried_by_default: ClassVar[bool] = False
    absent: ClassVar[tuple[str, float]] = ("strength", 0.0)
    law: eqx.AbstractVar[Law]
    strength: eqx.AbstractVar[Parameter]

    @property
    def kind(self) -> str:
        """Name of its kind, which is that of the network."""
        return f"{type(self).name}: {self.law.in_words()}"

    def network(self) -> Law:
        """Return the law, scaled."""
        return self.strength * self.law

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence[Effect]:
        """Return none: the law is the user's."""
        return []


def of_motion(effect: Any) -> Mapping[str, str]:
    """Units of a law on the motion of an effect, by those of displacement."""
    return OF_ROTATION if effect.motion == "rotation" else {}


def check_motion(effect: Any, motions: Sequence[str]) -> None:
    """Refuse a word that is no motion of the structure."""
    if effect.motion not in motions:
        raise InputError(
            f'Effect "{effect.name}": motion={shown(effect.motion)} was given; '
            f"{' or '.join(repr(word) for word in motions)} is needed, since the structure has no "
            f'other here: motion="{motions[0]}".'
        )


class Attached(GivenLaw, NetworkAttachment):
    """A law between one place of the structure and the ground, on its displacement or rotation.

    Parameters
    ----------
    at, direction
        Where it is attached [m], and along which vector; None for every motion there is.
    law
        What is attached, a network of springs, dashpots and masses: of a rotation in N m for N.
    strength
        Factor on the law [1].
    motion
        `displacement` or `rotation`.
    footprint
        Of a rotation in space, the vector between the edges of the foot [m].

    Examples
    --------
    >>> law = bp.effects.Spring(1e4) - bp.effects.Dashpot(dist.LogUniform(1.0, 1e3))
    >>> list((experiment + bp.effects.attached(0.4, law, name="mount")).unknown)[1]
    'structure.effects.mount.law.parts.2.viscosity'
    """

    law: Law = field(metadata={LAW_UNITS: of_motion})
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
    def acts_on(self) -> str:  # type: ignore[override]
        """The motion."""
        return self.motion

    def on(self, modes: Modes) -> "Attached":
        """Return the effect placed on a structure that has this motion."""
        check_motion(self, MOTIONS)
        if self.motion == "rotation":
            check_rotation(self.footprint, self.direction, modes)
        return NetworkAttachment.on(self, modes)

    def points(self, modes: Modes) -> Points:
        """The displacement along its directions, or the rotation."""
        if self.motion == "displacement":
            return NetworkAttachment.points(self, modes)
        return rotation(coordinates(self.at), self.footprint, self.direction, modes)
