"""An actuator or a hit of a hammer that sat elsewhere than recorded, beyond its tolerance."""

from typing import Any

import equinox as eqx

from .misplaced import Misplaced
from .prelude import Number, Parameter, unit


class MisplacedActuator(Misplaced):
    """An actuator or a hit of a hammer shifted from its recorded place, far beyond its tolerance.

    Parameters
    ----------
    actuator
        Name of the actuator or hammer hit.
    shift
        Distance from its recorded place and tolerance [m].
    towards
        In space: the direction of the shift, or two directions at right angles on a surface.
    bearing
        Angle of the shift from the first of two directions to the second [rad].

    Examples
    --------
    >>> elsewhere = bp.effects.misplaced_actuator("a1", shift=0.05)
    >>> [effect.name for effect in (experiment + elsewhere).effects]
    ['misplaced_actuator']
    """

    changes_modes = False
    side = "actuator"
    actuator: Number
    shift: Parameter = eqx.field(metadata=unit("m"))
    towards: tuple[Any, ...] = eqx.field(default=(), kw_only=True)
    bearing: Parameter = eqx.field(metadata=unit("rad"), default=0.0, kw_only=True)
    name: str = eqx.field(static=True, default="misplaced_actuator", kw_only=True)
