"""Two sensors whose cables are swapped."""

import equinox as eqx

from .prelude import Number, Parameter, unit
from .swapped import Swapped


class SwappedSensors(Swapped):
    """Two sensors of which each has its signal recorded on the channels of the other.

    Parameters
    ----------
    sensor, other
        Names of the two sensors, which have equally many channels.
    share
        1 where the two are swapped, 0 where they are not; between, a mixture.

    Examples
    --------
    >>> sensors = [bp.Sensor("s1", at=0.2), bp.Sensor("s2", at=0.4)]
    >>> two = bp.Experiment(structure, **setup | {"sensors": sensors})
    >>> [effect.name for effect in (two + bp.effects.swapped_sensors("s1", "s2")).effects]
    ['swapped_sensors']
    """

    side = "sensor"
    sensor: Number
    other: Number
    share: Parameter = eqx.field(metadata=unit("1"), default=1.0)
    name: str = eqx.field(static=True, default="swapped_sensors", kw_only=True)
