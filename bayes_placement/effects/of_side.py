"""An effect on one transducer, whose name is in the field that is called as its side."""

import dataclasses
from typing import Any, TypeVar

import equinox as eqx

from ..modes.modes import Modes
from .effect import Location
from .instrument_effect import Alone, InstrumentEffect
from .instruments import Instruments, Number

Self = TypeVar("Self", bound="OfSide")


class OfSide(InstrumentEffect):
    """An effect on one sensor, or on one actuator.

    Attributes
    ----------
    side
        `sensor` or `actuator`, which is the field that holds its name.
    """

    side: eqx.AbstractClassVar[str]

    @property
    def transducer(self) -> Number:
        """Name or number of the transducer."""
        number: Number = getattr(self, self.side)
        return number

    def numbered(self: Self, instruments: Instruments) -> Self:
        """Return the effect with its transducer by number."""
        number = instruments.number(self.transducer, self.side)
        return eqx.tree_at(lambda tree: getattr(tree, self.side), self, number)

    def alone(self, instruments: Instruments) -> Alone:
        """Return it on the first transducer of an experiment that has this one alone."""
        side = self.side
        name = instruments.name(self.transducer, side)
        first: dict[str, Any] = {side: 0}
        return Alone(dataclasses.replace(self, **first), side, (name,))

    def location(self, modes: Modes, instruments: Instruments) -> Location:
        """Where the transducer was recorded [m]."""
        return instruments.recorded(self.transducer, self.side)

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Name of the transducer."""
        return f"{self.side} {instruments.name(self.transducer, self.side)}"
