"""Mass that each sensor adds to the structure."""

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
