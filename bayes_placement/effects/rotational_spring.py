"""A spring that holds the rotation of the structure at one place."""

from .._shared.dimensions import Parameter
from .prelude import Footprint, LogUniform, OnRotation, Scales, Spring, bending_scale, field, unit


class RotationalSpring(OnRotation):
    """A spring between the rotation at one place and the ground: a cable, a half-clamped support.

    Blevins, Formulas for Natural Frequency and Mode Shape, table 8-8.

    Parameters
    ----------
    at
        Where it holds the structure [m].
    stiffness
        Moment per rotation [N m/rad].
    footprint, direction
        In space, the vector between the edges of its foot [m], and how these move.

    Examples
    --------
    >>> hold = bp.effects.rotational_spring(at=0.4, stiffness=dist.LogUniform(0.1, 1e3))
    >>> hold.name
    'rotational_spring'
    """

    absent = ("stiffness", 0.0)
    stiffness: Parameter = field(metadata=unit("N m/rad"))
    footprint: Footprint = field(default=None, kw_only=True)
    name: str = field(static=True, default="rotational_spring", kw_only=True)

    def network(self) -> Spring:
        """Return the spring."""
        return Spring(self.stiffness)

    @classmethod
    def suggest(cls, scales: Scales) -> list["RotationalSpring"]:
        """1e-4 to 1e4 times the bending stiffness over the length of a uniform beam, anywhere."""
        length, stiffness, places = bending_scale(scales)
        middle = stiffness / length
        return [cls(place, LogUniform(1e-4 * middle, 1e4 * middle)) for place in places]
