"""sensor_mass: in, a mass; out, what each sensor brings to the structure.

Not known here: where the sensors sit, data.
"""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
from numpyro.distributions import LogUniform

from .._sites import unit
from .._types import Parameter
from . import _scales
from ._effect import InstrumentEffect


class SensorMass(InstrumentEffect):
    """The mass of a sensor, at its own uncertain place; the structure moves with it.

    Whether all sensors are mounted all the time, or each in its own run alone, is said by
    `Experiment(sensors_mounted="fixed")` or `"roving"`.

    Parameters
    ----------
    mass
        Mass of each sensor [kg].
    """

    absent: ClassVar[tuple[str, float]] = ("mass", 0.0)
    loads_structure: ClassVar[bool] = True
    mass: Parameter = eqx.field(metadata=unit("kg"))
    name: str = eqx.field(static=True, default="sensor_mass", kw_only=True)

    def mounted_mass(self, sensor: str) -> Parameter:
        """The mass, for every sensor alike."""
        return self.mass

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["SensorMass"]:
        """A mass of 0.003 % to 30 % of the structure's."""
        mass = _scales.mass(experiment)
        return [cls(LogUniform(3e-5 * mass, 0.3 * mass))]


sensor_mass = SensorMass
