"""A mass fixed to one place of the structure."""

from collections.abc import Sequence
from typing import ClassVar

import equinox as eqx
from numpyro.distributions import LogUniform

from .._sites import unit
from .._types import Parameter
from .effect import Attachment, Omega, Place, Stiffness
from .scales import Scales


class PointMass(Attachment):
    """A mass fixed to one place, felt as -omega^2 m in every direction.

    Blevins, Formulas for Dynamics, Acoustics and Vibration, ch. 4.

    Parameters
    ----------
    at
        Where it sits [m].
    mass
        Mass [kg].
    """

    absent: ClassVar[tuple[str, float]] = ("mass", 0.0)
    at: Place = eqx.field(metadata=unit("m"))
    mass: Parameter = eqx.field(metadata=unit("kg"))
    name: str = eqx.field(static=True, default="point_mass", kw_only=True)

    def dynamic_stiffness(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness -omega^2 m [N/m]."""
        return -(omega**2) * self.mass

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence["PointMass"]:
        """A mass of 0.01 % to 100 % of the structure's, anywhere on it."""
        mass = LogUniform(1e-4 * scales.mass, scales.mass)
        return [cls(place, mass) for place in scales.places()]


point_mass = PointMass
