"""Mass that each sensor, or each exciter, adds to the structure where it sits."""

from .prelude import InstrumentEffect, LogUniform, Omega, Parameter, Scales, Stiffness, field, unit


class SensorMass(InstrumentEffect):
    """The mass of a sensor, at its own uncertain place; the structure moves with it.

    `Experiment(sensors_mounted="fixed")` states that all sensors are mounted all the time,
    `"roving"` that each is mounted in its own run alone.

    Parameters
    ----------
    mass
        Mass of each sensor [kg].

    Examples
    --------
    >>> loaded = experiment + bp.effects.sensor_mass(dist.Uniform(0.0, 0.02))
    >>> loaded.unknown["instrument_effects.sensor_mass.mass"].unit
    'kg'
    """

    absent = ("mass", 0.0)
    loads = ("sensor",)
    mass: Parameter = field(metadata=unit("kg"))
    name: str = field(static=True, default="sensor_mass", kw_only=True)

    def load(self, side: str, number: int, omega: Omega) -> Stiffness:
        """Dynamic stiffness -omega^2 m [N/m], the same for every sensor."""
        return -(omega**2) * self.mass

    @classmethod
    def suggest(cls, scales: Scales) -> list["SensorMass"]:
        """A mass of 0.001 % to 30 % of the structure's."""
        return [cls(LogUniform(scales.least_mass, 0.3 * scales.mass))]


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
