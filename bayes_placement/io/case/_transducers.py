"""Positions and angles of the transducers of a case, with their tolerances."""

from typing import Any

import numpy as np
from numpyro.distributions import Normal, Uniform

from ..._shared.dimensions import Parameter
from ...positions.tolerances import Box, Segment
from .._gate import is_number
from ._bar_or_beam import NominalStructure
from ._finite_elements import FiniteElementStructure
from ._json_fields import FieldRule, between, numbers
from ._measurement import RecordedTransducer


def position_rule(nominal: NominalStructure) -> FieldRule:
    """What is allowed as a recorded position."""
    if isinstance(nominal, FiniteElementStructure):
        low, high = nominal.bounds
        return numbers(
            f"three coordinates [m] among the nodes, from {low.tolist()} to {high.tolist()},",
            ((low + high) / 2).tolist(),
            lambda value: bool(np.all(low <= value) and np.all(value <= high)),
        )
    length = nominal.length
    return numbers(
        f"three coordinates [m] on the structure, [x, 0, 0] with x from 0 to {length:g},",
        [0.25 * length, 0.0, 0.0],
        lambda value: 0 <= value[0] <= length and value[1] == value[2] == 0,
    )


def directions_rule(nominal: NominalStructure) -> FieldRule:
    """What is allowed as recorded directions."""
    if isinstance(nominal, FiniteElementStructure):
        axes = nominal.kind.axes
        return FieldRule(
            f"a list of directions in which the structure moves, of {list(axes)} or their "
            "opposites, each once,",
            list(axes),
            lambda value: _are_directions(value, axes),
        )
    direction = nominal.direction
    return numbers(
        f"the direction in which the structure moves, [{direction}] or [{-direction}],",
        [direction],
        lambda value: value in ([direction], [-direction]),
    )


def position(transducer: RecordedTransducer, nominal: NominalStructure) -> Any:
    """Position of a transducer with its tolerance; a number where the tolerance is zero."""
    if isinstance(nominal, FiniteElementStructure):
        return Box(transducer.position, within=transducer.fields.value("tolerance_m", _TOLERANCES))
    within, *_ = transducer.fields.value("tolerance_m", _TOLERANCE_ALONG_X)
    recorded = transducer.position[0]
    return Segment(recorded, within=within) if within else recorded


def angles(
    transducer: RecordedTransducer, nominal: NominalStructure
) -> tuple[Parameter, ...] | None:
    """Distributions of the Euler angles [rad]; None where the orientation is exact."""
    rule = between(0.0, np.pi / 2, "rad", 0.1)
    tolerance = transducer.fields.value("angle_tolerance_rad", rule)
    if tolerance == 0:
        return None
    angle = Uniform(-float(tolerance), float(tolerance))
    if isinstance(nominal, FiniteElementStructure) and len(nominal.kind.axes) == 3:
        return (angle, angle, angle)
    # R = Rx Ry Rz projects x on x by cos ty cos tz and z on z by cos tx cos ty: on a structure that
    # moves along one of them, the roll of a transducer about that axis has no influence.
    roll_axis = abs(transducer.channels[0].direction or 0)
    return tuple(0.0 if axis == roll_axis else angle for axis in (1, 2, 3))


def gain(transducer: RecordedTransducer) -> Parameter:
    """Gain [1]: normal about 1 with the standard deviation that is stated, else exactly 1."""
    return _about(1.0, transducer, "gain_tolerance", "1", 0.01)


def delay(transducer: RecordedTransducer) -> Parameter:
    """Delay [s]: normal about 0 with the standard deviation that is stated, else exactly 0."""
    return _about(0.0, transducer, "delay_tolerance_s", "s", 1e-6)


def _about(
    exact: float, transducer: RecordedTransducer, field: str, unit: str, example: float
) -> Parameter:
    """Normal distribution about an exact value; the value where no tolerance is stated."""
    if not transducer.fields.has(field):
        return exact
    deviation = float(transducer.fields.value(field, between(0.0, np.inf, unit, example)))
    return Normal(exact, deviation) if deviation else exact


def _are_directions(value: Any, axes: tuple[int, ...]) -> bool:
    if not isinstance(value, list) or not value or not all(map(is_number, value)):
        return False
    return set(map(abs, value)) <= set(axes) and len(set(map(abs, value))) == len(value)


_TOLERANCE_ALONG_X = numbers(
    "three tolerances [m] along x, y, z, the last two 0 on a line along x,",
    [0.01, 0.0, 0.0],
    lambda value: value[0] >= 0 and value[1] == value[2] == 0,
)
_TOLERANCES = numbers(
    "three tolerances [m] along x, y, z, not negative,",
    [0.01, 0.0, 0.0],
    lambda value: min(value) >= 0,
)
