"""One row of a channel table, in SI."""

from typing import NamedTuple

from .._shared.reprs import with_short_repr

Point = tuple[float, float, float]


@with_short_repr
class ChannelRow(NamedTuple):
    """One channel of a channel table.

    Parameters
    ----------
    name
        Name of the transducer.
    role
        `sensor` or `actuator`.
    node
        Number of its node, or None.
    position, tolerance
        Coordinates and their tolerances [m], or None.
    direction
        +-1, +-2, +-3; 0 where not stated.
    angle_tolerance
        Tolerance of its orientation [rad], or None.
    sensitivity
        Signal over what is sensed [V per SI], or None.
    senses
        Quantity of its FRF, or `force`; empty without sensitivity.

    Examples
    --------
    >>> bp.io.mapped.ChannelRow("s1", "sensor", node=12, direction=-3).label
    's1-z'
    """

    name: str
    role: str
    node: int | None = None
    position: Point | None = None
    tolerance: Point | None = None
    direction: int = 0
    angle_tolerance: float | None = None
    sensitivity: float | None = None
    senses: str = ""

    @property
    def label(self) -> str:
        """Label of the channel, such as `s1+x`."""
        sign = "-" if self.direction < 0 else "+"
        return self.name + (f"{sign}{'xyz'[abs(self.direction) - 1]}" if self.direction else "")
