"""Mass that each exciter adds to the structure where it drives."""

from .prelude import InstrumentEffect, LogUniform, Omega, Parameter, Scales, Stiffness, field, unit


class ActuatorMass(InstrumentEffect):
    """A mass between the force gauge of an exciter and the structure, which moves with it.

    The gauge records the force that the mass takes as well: H is that of the structure with the
    mass at the point of drive. Each exciter is mounted in its own runs only. McConnell and Cappa,
    Mechanical Systems and Signal Processing 14 (2000) 625, doi:10.1006/mssp.1999.1283.

    Parameters
    ----------
    mass
        Mass of each exciter beyond its gauge [kg].

    Examples
    --------
    >>> [effect.name for effect in (experiment + bp.effects.actuator_mass(0.01)).effects]
    ['actuator_mass']
    """

    changes_modes = False
    absent = ("mass", 0.0)
    loads = ("actuator",)
    mass: Parameter = field(metadata=unit("kg"))
    name: str = field(static=True, default="actuator_mass", kw_only=True)

    def load(self, side: str, number: int, omega: Omega) -> Stiffness:
        """Dynamic stiffness -omega^2 m [N/m], the same for every exciter."""
        return -(omega**2) * self.mass

    @classmethod
    def suggest(cls, scales: Scales) -> list["ActuatorMass"]:
        """A mass of 0.001 % to 30 % of the structure's, where exciters may stay mounted."""
        if not scales.exciters_may_be_mounted:
            return []
        return [cls(LogUniform(scales.least_mass, 0.3 * scales.mass))]
