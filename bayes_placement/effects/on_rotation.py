"""What is attached to the rotation of a structure at one place."""

from typing import TypeAlias

import equinox as eqx
import jax.numpy as jnp

from .._shared.dimensions import Parameter
from ..modes.modes import Modes
from ..modes.points import Points
from ..modes.ports import is_beam, rotation
from ..positions.places import coordinates
from .effect import Direction, NetworkAttachment
from .scales import Scales

Footprint: TypeAlias = tuple[Parameter, Parameter, Parameter] | None
"""Vector between the edges of a foot in space [m]; None on a beam."""


class OnRotation(NetworkAttachment):
    """Something attached to the rotation of a beam, or of a foot on a structure in space."""

    footprint: eqx.AbstractVar[Footprint]

    acts_on = "rotation"

    def on(self, modes: Modes) -> "OnRotation":
        """Return the effect placed on a structure that rotates."""
        check_rotation(self.footprint, self.direction, modes)
        return NetworkAttachment.on(self, modes)

    def points(self, modes: Modes) -> Points:
        """The slope of a beam, or the difference over the footprint."""
        return rotation(coordinates(self.at), self.footprint, self.direction, modes)


def check_rotation(footprint: Footprint, direction: Direction, modes: Modes) -> None:
    """Refuse a rotation that the structure does not have, or without a footprint in space."""
    rotation(jnp.asarray(modes.bounds()[0], float), footprint, direction, modes)


def bending_scale(scales: Scales) -> tuple[float, float] | None:
    """Length [m] and bending stiffness [N m2] of a uniform beam; None of other structures."""
    beam = scales.nominal_modes
    return (float(beam.length), float(beam.stiffness)) if is_beam(beam) else None
