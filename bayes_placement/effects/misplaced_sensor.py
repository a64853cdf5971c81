"""A sensor that sat elsewhere than recorded, beyond its tolerance."""

from typing import Any

import equinox as eqx

from .misplaced import Misplaced
from .prelude import Number, Parameter, unit


class MisplacedSensor(Misplaced):
    """A sensor shifted from its recorded place, far beyond its tolerance.

    Parameters
    ----------
    sensor
        Name of the sensor.
    shift
        Distance from its recorded place and tolerance [m].
    towards
        In space: the direction of the shift, or two directions at right angles on a surface.
    bearing
        Angle of the shift from the first of two directions to the second [rad].

    Examples
    --------
    >>> elsewhere = bp.effects.misplaced_sensor("s1", shift=dist.Uniform(-0.1, 0.1))
    >>> [unknown.name for unknown in (experiment + elsewhere).unknowns_of(elsewhere)]
    ['instrument_effects.misplaced_sensor.shift']
    """

    side = "sensor"
    sensor: Number
    shift: Parameter = eqx.field(metadata=unit("m"))
    towards: tuple[Any, ...] = eqx.field(default=(), kw_only=True)
    bearing: Parameter = eqx.field(metadata=unit("rad"), default=0.0, kw_only=True)
    name: str = eqx.field(static=True, default="misplaced_sensor", kw_only=True)
