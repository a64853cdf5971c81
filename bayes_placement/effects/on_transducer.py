"""What effects on one sensor or actuator, or on one of its channels, have in common."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._shared.errors import InputError
from ..modes.modes import Modes
from . import _setting_words
from .effect import Location
from .instrument_effect import Alone, InstrumentEffect
from .instruments import Instruments, Number
from .scales import Scales

Kind = TypeVar("Kind", bound="OfSide")
OfChannel = TypeVar("OfChannel", bound="OnTransducer")


class OnTransducer(InstrumentEffect):
    """An effect on one sensor or actuator, or on one of its channels.

    Attributes
    ----------
    transducer
        Name of the sensor or actuator; None for all of a side, where an effect allows that.
    side
        `sensor` or `actuator`; empty where it follows from the name, sensors first.
    direction
        Recorded direction of the only channel that it is about; None for all of the transducer.

    Examples
    --------
    >>> kinds = bp.effects.EFFECTS.items()
    >>> [name for name, kind in kinds if issubclass(kind, bp.effects.OnTransducer)]
    ['channel_delay', 'gain_error', 'reversed_channel', 'frequency_drift', 'low_pass',
    'high_pass', 'phase_drift', 'mains_hum']
    """

    transducer: eqx.AbstractVar[Number | None]
    side: str = eqx.field(static=True, default="", kw_only=True)
    direction: Number | None = eqx.field(default=None, kw_only=True)

    @property
    def acts_on(self) -> str:  # type: ignore[override]
        """`all_channels` without a transducer."""
        return "all_channels" if self.transducer is None else "channel"

    def numbered(self, instruments: Instruments) -> "OnTransducer":
        """Return the effect with its transducer by number, and the direction as an array."""
        if self.transducer is None:
            return self._of_all(instruments)
        side = self.side or instruments.side_of(self.transducer)
        number = instruments.number(self.transducer, side)
        direction = self.direction
        if direction is not None:
            self._check_direction(instruments, number, side)
            direction = np.asarray(direction)
        return dataclasses.replace(self, transducer=number, side=side, direction=direction)

    def alone(self, instruments: Instruments) -> Alone | None:
        """Return it on the first transducer of an experiment that has this one alone."""
        if self.transducer is None:
            return None
        side = self.side or instruments.side_of(self.transducer)
        name = instruments.name(self.transducer, side)
        return Alone(dataclasses.replace(self, transducer=0, side=side), side, (name,))

    def _of_all(self, instruments: Instruments) -> "OnTransducer":
        """Return the effect on every transducer of its side, by default of the sensors."""
        if self.direction is not None:
            raise InputError(
                f'Effect "{self.name}": the direction {self.direction} was given without a sensor; '
                "none is needed, since the effect is then in all channels. Name the sensor as "
                f'well: "{next(iter(instruments.sensors))}".'
            )
        side = self.side or "sensor"
        instruments.side(side)
        return dataclasses.replace(self, side=side)

    def _check_direction(self, instruments: Instruments, number: Number, side: str) -> None:
        channels = instruments.side(side)[instruments.name(number, side)].channels
        if self.direction not in [channel.direction for channel in channels]:
            raise InputError(
                f'Effect "{self.name}": the direction {self.direction} was given, but the {side} '
                f"has the channels {', '.join(channel.label for channel in channels)}. Give the "
                f"direction of one of them: direction={channels[0].direction}."
            )

    def affected(self, instruments: Instruments) -> Float[Array, "#sensor #actuator 1"]:
        """1 on the FRFs of the transducer or of its only channel that counts, 0 on all others."""
        if self.transducer is None:
            return jnp.ones((1, 1, 1))
        rows = instruments.of(self.transducer, self.side)
        if self.direction is not None:
            directions = [channel.direction for channel in instruments.channels(self.side)]
            rows *= np.array(directions) == self.direction
        return rows[:, None, None] if self.side == "sensor" else rows[None, :, None]

    def location(self, modes: Modes, instruments: Instruments) -> Location | None:
        """Where the transducer was recorded [m]; None of all of them."""
        if self.transducer is None:
            return None
        return instruments.recorded(self.transducer, self.side)

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Name of the transducer, and its channel if only one counts."""
        if self.transducer is None:
            return f"all {self.side}s"
        transducer = f"{self.side} {instruments.name(self.transducer, self.side)}"
        return _setting_words.joined(transducer, _setting_words.channel(self.direction))


class OfSide(InstrumentEffect):
    """An effect on one sensor, or on one actuator."""

    side: eqx.AbstractClassVar[str]
    """`sensor` or `actuator`, which is the field that holds its name."""

    @property
    def transducer(self) -> Number:
        """Name or number of the transducer."""
        return getattr(self, self.side)

    def numbered(self: Kind, instruments: Instruments) -> Kind:
        """Return the effect with its transducer by number."""
        number = instruments.number(self.transducer, self.side)
        return eqx.tree_at(lambda tree: getattr(tree, self.side), self, number)

    def alone(self, instruments: Instruments) -> Alone:
        """Return it on the first transducer of an experiment that has this one alone."""
        side = self.side
        name = instruments.name(self.transducer, side)
        first = eqx.tree_at(lambda tree: getattr(tree, side), self, 0)
        return Alone(first, side, (name,))

    def location(self, modes: Modes, instruments: Instruments) -> Location:
        """Where the transducer was recorded [m]."""
        return instruments.recorded(self.transducer, self.side)

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Name of the transducer."""
        return f"{self.side} {instruments.name(self.transducer, self.side)}"


def channels(instruments: Instruments, side: str) -> Sequence[tuple[str, int | None]]:
    """Every channel of a side: its transducer, and its direction where that has several."""
    return [
        (name, direction if len(transducer.directions) > 1 else None)
        for name, transducer in instruments.side(side).items()
        for direction in transducer.directions
    ]


def on_each_channel(
    kind: Callable[..., OfChannel], scales: Scales, *numbers: object
) -> list[OfChannel]:
    """Effects of one kind on each channel, with the same priors of their numbers.

    With one channel on either side a factor on either is the same, and that of the sensor is taken.
    """
    instruments, sides = scales.instruments, ("sensor", "actuator")
    single = all(len(instruments.channels(side)) == 1 for side in sides)
    return [
        kind(name, *numbers, side=side, direction=direction)
        for side in (sides[:1] if single else sides)
        for name, direction in channels(instruments, side)
    ]
