"""A mass spread over a part of the structure."""

from .over import OverExtent
from .prelude import LogUniform, Mass, Parameter, Scales, field, unit


class SegmentMass(OverExtent):
    """A mass spread evenly over a segment or box: a coating, cables, sand; negative if removed.

    Parameters
    ----------
    at, direction
        Middle of the part [m], and along which vector; None for every motion there is.
    extent
        Its length on a line [m]; in space the edges of a box along x, y and z [m].
    mass
        All of the mass [kg].

    Examples
    --------
    >>> coat = bp.effects.segment_mass(at=0.4, extent=0.2, mass=dist.LogUniform(1e-3, 1.0))
    >>> list((experiment + coat).unknown)[1]
    'structure.effects.segment_mass.mass'
    """

    absent = ("mass", 0.0)
    mass: Parameter = field(metadata=unit("kg"))
    name: str = field(static=True, default="segment_mass", kw_only=True)

    def network(self) -> Mass:
        """Return all of it."""
        return Mass(self.mass)

    @classmethod
    def suggest(cls, scales: Scales) -> list["SegmentMass"]:
        """0.001 % to 100 % of the mass of the structure, on any part of it."""
        extents, size = scales.extents(), LogUniform(scales.least_mass, scales.mass)
        return [cls(place, extent, size) for place, extent in extents]
