"""A viscous dashpot between one place of the structure and the ground."""

from .prelude import Dashpot, LogUniform, NetworkAttachment, Parameter, Scales, at_each, field, unit


class GroundDashpot(NetworkAttachment):
    """A viscous dashpot between one place and the ground: the dynamic stiffness i omega c.

    Parameters
    ----------
    at, direction
        Where it holds the structure [m], and along which vector; None for every motion there is.
    viscosity
        Force per velocity [N s/m].

    Examples
    --------
    >>> dashpot = bp.effects.ground_dashpot(at=0.1, viscosity=dist.Uniform(0.0, 50.0))
    >>> list((experiment + dashpot).unknown)
    ['structure.damping.ratio', 'structure.effects.ground_dashpot.viscosity', 'sensor.s1.position']
    """

    absent = ("viscosity", 0.0)
    viscosity: Parameter = field(metadata=unit("N s/m"))
    name: str = field(static=True, default="ground_dashpot", kw_only=True)

    def network(self) -> Dashpot:
        """Return the dashpot."""
        return Dashpot(self.viscosity)

    @classmethod
    def suggest(cls, scales: Scales) -> list["GroundDashpot"]:
        """A dashpot of 1e-5 to 1 times the mass times the middle angular frequency of the band."""
        largest = scales.stiffness / scales.angular_frequency
        viscosity = LogUniform(1e-5 * largest, largest)
        return at_each(cls, scales.places_and_directions(), viscosity)
