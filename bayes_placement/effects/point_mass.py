"""A mass fixed to one place of the structure."""

from .._shared.dimensions import Parameter
from .prelude import LogUniform, Mass, NetworkAttachment, Scales, field, negative_log_uniform, unit


class PointMass(NetworkAttachment):
    """A mass fixed to one place, which adds -omega^2 m; negative if removed.

    Blevins, Formulas for Dynamics, Acoustics and Vibration, ch. 4.

    Parameters
    ----------
    at, direction
        Where it sits [m], and along which vector, as that of a fluid may; None along every one.
    mass
        Mass [kg].

    Examples
    --------
    >>> heavier = experiment + bp.effects.point_mass(at=0.4, mass=dist.LogUniform(0.01, 1.0))
    >>> list(heavier.unknown)
    ['structure.damping.ratio', 'structure.effects.point_mass.mass', 'sensor.s1.position']
    """

    absent = ("mass", 0.0)
    if_negative = "removed"
    mass: Parameter = field(metadata=unit("kg"))
    name: str = field(static=True, default="point_mass", kw_only=True)

    def network(self) -> Mass:
        """Return the mass."""
        return Mass(self.mass)

    @classmethod
    def suggest(cls, scales: Scales) -> list["PointMass"]:
        """0.001 % to 100 % of the structure's mass, or up to 10 % of it removed, anywhere on it."""
        least, mass = scales.least_mass, scales.mass
        priors = LogUniform(least, mass), negative_log_uniform(least, 0.1 * mass)
        return [cls(place, prior) for prior in priors for place in scales.places()]
