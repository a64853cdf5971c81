"""A spring between one place of the structure and the ground."""

from collections.abc import Sequence
from typing import ClassVar

import equinox as eqx
import jax.numpy as jnp
from numpyro.distributions import LogUniform

from .._sites import unit
from .._types import Parameter
from .effect import Attachment, Direction, Omega, Place, Stiffness
from .scales import Scales


class GroundSpring(Attachment):
    """A spring between one place and the ground, felt as k at every frequency.

    Parameters
    ----------
    at
        Where it holds the structure [m].
    stiffness
        Stiffness [N/m].
    direction
        Direction in which it acts, three numbers; None for every one in which the structure moves.
    """

    absent: ClassVar[tuple[str, float]] = ("stiffness", 0.0)
    at: Place = eqx.field(metadata=unit("m"))
    stiffness: Parameter = eqx.field(metadata=unit("N/m"))
    direction: Direction = eqx.field(default=None, kw_only=True)
    name: str = eqx.field(static=True, default="ground_spring", kw_only=True)

    def dynamic_stiffness(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness k [N/m]."""
        return jnp.broadcast_to(jnp.asarray(self.stiffness), omega.shape)

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence["GroundSpring"]:
        """A spring of 1e-5 to 100 times the modal stiffness in the middle of the band."""
        stiffness = LogUniform(1e-5 * scales.stiffness, 1e2 * scales.stiffness)
        places = scales.places_and_directions()
        return [cls(place, stiffness, direction=direction) for place, direction in places]


ground_spring = GroundSpring
