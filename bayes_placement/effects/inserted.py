"""Any law inserted in a cut of a uniform bar or beam."""

from collections.abc import Sequence

from .._shared.sites import LAW_UNITS
from ..modes.changed import required_waveguide
from ..modes.ports import MOTIONS, cut
from .attached import GivenLaw, check_motion, of_motion
from .effect import AtPlace, Omega, OnPorts, Stiffness, placed
from .prelude import Law, Modes, Parameter, PortLaw, coordinates, field, unit


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
