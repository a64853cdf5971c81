"""point_mass: in, a place and a mass; out, its dynamic stiffness.

Not known here: the structure it sits on, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
from numpyro.distributions import LogUniform

from .._sites import unit
from .._types import Parameter
from . import _scales
from ._effect import Attachment, Omega, Place, Stiffness


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
    def suggest(cls, experiment: Any) -> Sequence["PointMass"]:
        """A mass of 0.01 % to 100 % of the structure's, anywhere on it."""
        mass = _scales.mass(experiment)
        law = LogUniform(1e-4 * mass, mass)
        return [cls(place, law) for place in _scales.anywhere(experiment)]


point_mass = PointMass
