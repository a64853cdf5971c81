"""ground_dashpot: in, a place and a viscosity; out, its dynamic stiffness.

Not known here: the structure it holds, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
from numpyro.distributions import LogUniform

from .._sites import unit
from .._types import Parameter
from . import _scales
from ._effect import Attachment, Direction, Omega, Place, Stiffness


class GroundDashpot(Attachment):
    """A viscous dashpot between one place and the ground, felt as i omega c.

    Parameters
    ----------
    at
        Where it holds the structure [m].
    viscosity
        Force per velocity [N s/m].
    direction
        Direction in which it acts, three numbers; None for every one in which the structure moves.
    """

    absent: ClassVar[tuple[str, float]] = ("viscosity", 0.0)
    at: Place = eqx.field(metadata=unit("m"))
    viscosity: Parameter = eqx.field(metadata=unit("N s/m"))
    direction: Direction = eqx.field(default=None, kw_only=True)
    name: str = eqx.field(static=True, default="ground_dashpot", kw_only=True)

    def dynamic_stiffness(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness i omega c [N/m]."""
        return 1j * omega * self.viscosity

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["GroundDashpot"]:
        """A dashpot of 1e-5 to 1 times the modal mass times the middle angular frequency."""
        viscosity = _scales.stiffness(experiment) / _scales.middle(experiment)
        law = LogUniform(1e-5 * viscosity, viscosity)
        places = _scales.somewhere_along(experiment)
        return [cls(place, law, direction=direction) for place, direction in places]


ground_dashpot = GroundDashpot
