"""A bed of springs under a part of the structure."""

from .over import OverExtent
from .prelude import Parameter, Scales, Spring, field, unit


class Foundation(OverExtent):
    """Springs spread evenly under a segment or box, as of Winkler's foundation.

    Hetenyi, Beams on Elastic Foundation (1946), ch. 1. The modulus of the bed is the stiffness
    over the extent.

    Parameters
    ----------
    at, direction
        Middle of the part [m], and along which vector; None for every motion there is.
    extent
        Its length on a line [m]; in space the edges of a box along x, y and z [m].
    stiffness
        Stiffness of all springs together [N/m].

    Examples
    --------
    >>> bed = bp.effects.foundation(at=0.4, extent=0.2, stiffness=dist.LogUniform(1e2, 1e6))
    >>> list((experiment + bed).unknown)[1]
    'structure.effects.foundation.stiffness'
    """

    absent = ("stiffness", 0.0)
    stiffness: Parameter = field(metadata=unit("N/m"))
    name: str = field(static=True, default="foundation", kw_only=True)

    def network(self) -> Spring:
        """Return all of it."""
        return Spring(self.stiffness)

    @classmethod
    def suggest(cls, scales: Scales) -> list["Foundation"]:
        """1e-5 to 100 times the modal stiffness, under any part of the structure."""
        return [cls(place, extent, scales.any_stiffness) for place, extent in scales.extents()]
