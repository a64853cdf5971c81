"""Two actuators, or two hits of a hammer, whose records are swapped."""

import equinox as eqx

from .prelude import Number, Parameter, unit
from .swapped import Swapped


class SwappedActuators(Swapped):
    """Two actuators or hits of which each has its runs recorded under the name of the other.

    Parameters
    ----------
    actuator, other
        Names of the two actuators, which have equally many channels.
    share
        1 where the two are swapped, 0 where they are not; between, a mixture.

    Examples
    --------
    >>> actuators = [bp.Actuator("a1", at=0.3), bp.Actuator("a2", at=0.6)]
    >>> two = bp.Experiment(structure, **setup | {"actuators": actuators})
    >>> [effect.name for effect in (two + bp.effects.swapped_actuators("a1", "a2")).effects]
    ['swapped_actuators']
    """

    changes_modes = False
    side = "actuator"
    actuator: Number
    other: Number
    share: Parameter = eqx.field(metadata=unit("1"), default=1.0)
    name: str = eqx.field(static=True, default="swapped_actuators", kw_only=True)
