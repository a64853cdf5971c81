"""_places: in, where a case says that a transducer sits; out, supports and angles.

Not known here: measurements, priors of parameters, files.
"""

from typing import Any

import numpy as np
from numpyro.distributions import Uniform

from ..._types import Parameter
from ...positions.tolerances import Box, Segment
from ._finite_elements import Model
from ._json_fields import Rule, between, is_number, numbers
from ._line import Drawn
from ._measurement import Mounted


def position(drawn: Drawn) -> Rule:
    """What is allowed as a recorded position."""
    if isinstance(drawn, Model):
        low, high = drawn.bounds
        return numbers(
            f"three coordinates [m] among the nodes, from {low.tolist()} to {high.tolist()},",
            ((low + high) / 2).tolist(),
            lambda value: bool(np.all(low <= value) and np.all(value <= high)),
        )
    length = drawn.length
    return numbers(
        f"three coordinates [m] on the structure, [x, 0, 0] with x from 0 to {length:g},",
        [0.25 * length, 0.0, 0.0],
        lambda value: 0 <= value[0] <= length and value[1] == value[2] == 0,
    )


def directions(drawn: Drawn) -> Rule:
    """What is allowed as recorded directions."""
    if isinstance(drawn, Model):
        axes = drawn.kind.axes
        return Rule(
            f"a list of directions in which the structure moves, of {list(axes)} or their "
            "opposites, each once,",
            list(axes),
            lambda value: _are_directions(value, axes),
        )
    along = drawn.direction
    return numbers(
        f"the direction in which the structure moves, [{along}] or [{-along}],",
        [along],
        lambda value: value in ([along], [-along]),
    )


def at(mounted: Mounted, drawn: Drawn) -> Any:
    """Where the transducer may sit: a support, or a place where it is exact."""
    if isinstance(drawn, Model):
        return Box(mounted.position, within=mounted.fields.take("tolerance_m", _TOLERANCES))
    place, (within, *_) = mounted.position[0], mounted.fields.take("tolerance_m", _TOLERANCE)
    return Segment(place, within=within) if within else place


def angles(mounted: Mounted, drawn: Drawn) -> tuple[Parameter, ...] | None:
    """Laws of the Euler angles; None where the orientation is exact."""
    rule = between(0.0, np.pi / 2, "rad", 0.1)
    tolerance = mounted.fields.take("angle_tolerance_rad", rule)
    if tolerance == 0:
        return None
    law = Uniform(-float(tolerance), float(tolerance))
    if isinstance(drawn, Model) and len(drawn.kind.axes) == 3:
        return (law, law, law)
    # R = Rx Ry Rz projects x on x by cos ty cos tz and z on z by cos tx cos ty: on a structure that
    # moves along one of them, a transducer's roll about its own axis is not seen.
    own = abs(mounted.channels[0].direction or 0)
    return tuple(0.0 if about == own else law for about in (1, 2, 3))


def _are_directions(value: Any, axes: tuple[int, ...]) -> bool:
    if not isinstance(value, list) or not value or not all(map(is_number, value)):
        return False
    return {abs(one) for one in value} <= set(axes) and len(set(map(abs, value))) == len(value)


_TOLERANCE = numbers(
    "three tolerances [m] along x, y, z, the last two 0 on a line along x,",
    [0.01, 0.0, 0.0],
    lambda value: value[0] >= 0 and value[1] == value[2] == 0,
)
_TOLERANCES = numbers(
    "three tolerances [m] along x, y, z, not negative,",
    [0.01, 0.0, 0.0],
    lambda value: min(value) >= 0,
)
