"""Any law of springs, dashpots and masses, attached to one place, in a cut, or as the modulus."""

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import equinox as eqx
from jaxtyping import Array, Complex

from .._shared.arguments import shown
from .._shared.errors import InputError
from .._shared.sites import LAW_UNITS, OF_MODULUS, OF_ROTATION, unit
from ..laws import Law
from ..modes.changed import required_waveguide
from ..modes.points import Points
from ..modes.ports import MOTIONS, PortLaw, cut, rotation
from ..positions.places import coordinates
from .effect import AtPlace, Effect, Modulus, NetworkAttachment, OnPorts, StructureEffect, placed
from .prelude import Footprint, Modes, Omega, Parameter, Scales, Stiffness, check_rotation, field


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


class Inserted(GivenLaw, AtPlace, OnPorts):
    """A law between the two sides of a cut: a hinge with losses, a crack, a soft or lossy support.

    The structure opens the cut against it. Its compliance times the strength is what is inserted,
    so that a strength of zero closes the cut. `local_stiffness_loss` and `compliant_support`
    change the modes and their damping instead; both agree where nothing is damped.

    Parameters
    ----------
    at
        Where the cut is [m]; at an end, between the structure and its support.
    law
        What holds the two sides together, a network of springs and dashpots, of a rotation in N m
        for N.
    strength
        Factor on its compliance [1].
    motion
        How the sides move against each other: `rotation` of a beam, or `displacement`.

    Examples
    --------
    >>> joint = bp.effects.LossySpring(1e7, dist.LogUniform(1e-3, 1.0))
    >>> sleeve = bp.effects.inserted(0.4, joint, motion="displacement", name="sleeve")
    >>> list((experiment + sleeve).unknown)[1]
    'structure.effects.sleeve.law.loss_factor'
    """

    acts_on = "cut"
    law: Law = field(metadata={LAW_UNITS: of_motion})
    strength: Parameter = field(metadata=unit("1"), default=1.0)
    motion: str = field(static=True, default="rotation", kw_only=True)
    name: str = field(static=True, default="inserted", kw_only=True)

    def on(self, modes: Modes) -> "Inserted":
        """Return the effect placed on a uniform bar or beam, cut or not."""
        check_motion(self, MOTIONS)
        waveguide = required_waveguide(
            modes, "inserted", "Use soft_support or region_stiffness_loss."
        )
        check_motion(self, MOTIONS[:1] if waveguide.half_order == 1 else MOTIONS)
        return placed(self, modes)

    def port_laws(self, modes: Modes, modulus: Stiffness, omega: Omega) -> Sequence[PortLaw]:
        """The internal force at the cut, and less the compliance for the modulus as drawn."""
        numerator, denominator = self.law.fraction(omega)
        compliance = -self.strength * denominator * modulus**2
        return [PortLaw(cut(coordinates(self.at), self.motion, modes), compliance, numerator)]


class ModulusLaw(GivenLaw, Modulus):
    """A modulus E (1 + Z) of the whole structure, with a law Z of springs and dashpots.

    A springpot makes it a fractional one (Bagley and Torvik, AIAA J. 21 (1983) 741,
    doi:10.2514/3.8142), a lossy spring a hysteretic one.

    Parameters
    ----------
    law
        What is added to the modulus as drawn, over it: stiffnesses in 1 for N/m, viscosities in s
        for N s/m.
    strength
        Factor on the law [1].

    Examples
    --------
    >>> rubber = bp.effects.modulus(bp.effects.Springpot(dist.LogUniform(1e-3, 1.0), 0.5, 300.0))
    >>> list((experiment + rubber).unknown)[1]
    'structure.effects.modulus.law.stiffness'
    """

    law: Law = field(metadata={LAW_UNITS: lambda effect: OF_MODULUS})
    strength: Parameter = field(metadata=unit("1"), default=1.0)
    name: str = field(static=True, default="modulus", kw_only=True)

    def relative_modulus(self, omega: Omega) -> Complex[Array, "frequency"]:
        """What the law adds [1]."""
        return self.network().dynamic_stiffness(omega) + 0j
