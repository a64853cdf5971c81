"""Any law spread over a part of the structure."""

from .prelude import NOT_NEGATIVE, Extent, Law, OverExtent, Parameter, Scales, field, unit


class Over(OverExtent):
    """A law spread evenly over a segment or box of the structure.

    Parameters
    ----------
    at
        Middle of the part [m].
    extent
        Its length on a line [m]; in space the edges of a box along x, y and z [m].
    law
        Law of all of it together, a network of springs, dashpots and masses.
    strength
        Factor on the law [1].
    direction
        Direction in which it acts; None for every one in which the structure moves.

    Examples
    --------
    >>> felt = bp.effects.Spring(2e4) | bp.effects.Dashpot(dist.LogUniform(1.0, 1e3))
    >>> list((experiment + bp.effects.over(0.4, 0.2, felt)).unknown)[1]
    'structure.effects.over.law.parts.2.viscosity'
    """

    tried_by_default = False
    absent = ("strength", 0.0)
    extent: Extent = field(metadata=unit("m", within=NOT_NEGATIVE))
    law: Law
    strength: Parameter = field(metadata=unit("1"), default=1.0)
    name: str = field(static=True, default="over", kw_only=True)

    @property
    def kind(self) -> str:
        """Name of its kind, which is that of the network."""
        return f"over: {self.law.in_words()}"

    def network(self) -> Law:
        """Return the law, scaled."""
        return self.strength * self.law

    @classmethod
    def suggest(cls, scales: Scales) -> list["Over"]:
        """Return none: the law is yours."""
        return []
