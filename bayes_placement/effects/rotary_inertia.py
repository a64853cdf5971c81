"""A rotary inertia fixed to one place of the structure."""

from .._shared.dimensions import Parameter
from .prelude import Footprint, LogUniform, Mass, OnRotation, Scales, bending_scale, field, unit


class RotaryInertia(OnRotation):
    """A wheel or an arm that turns with the structure, -omega^2 J on its rotation.

    Blevins, Formulas for Natural Frequency and Mode Shape, table 8-8.

    Parameters
    ----------
    at
        Where it sits [m].
    inertia
        Moment of inertia about the place [kg m2].
    footprint, direction
        In space, the vector between the edges of its foot [m], and how these move.

    Examples
    --------
    >>> wheel = bp.effects.rotary_inertia(at=0.4, inertia=dist.LogUniform(1e-6, 1e-3))
    >>> wheel.name
    'rotary_inertia'
    """

    absent = ("inertia", 0.0)
    if_negative = "removed"
    inertia: Parameter = field(metadata=unit("kg m2"))
    footprint: Footprint = field(default=None, kw_only=True)
    name: str = field(static=True, default="rotary_inertia", kw_only=True)

    def network(self) -> Mass:
        """Return the inertia."""
        return Mass(self.inertia)

    @classmethod
    def suggest(cls, scales: Scales) -> list["RotaryInertia"]:
        """1e-7 to 0.1 times the mass of a uniform beam and its length squared, anywhere on it."""
        length, _, places = bending_scale(scales)
        whole = scales.mass * length**2
        return [cls(place, LogUniform(1e-7 * whole, 0.1 * whole)) for place in places]
