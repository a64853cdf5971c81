"""The sensors and actuators of an experiment, as effects on them see them."""

from collections.abc import Mapping
from typing import NamedTuple, Protocol, TypeAlias, runtime_checkable

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact, Int

from .._shared.arguments import shown
from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from ..modes.points import Points, joined
from ..positions.channel import Channel
from ..positions.places import Position
from ..positions.vectors import Recorded

Number: TypeAlias = str | int | Int[Array | np.ndarray, ""]
"""Name of a transducer, or its number from 0 once the effect is part of an experiment."""


@runtime_checkable
class TransducerProtocol(Protocol):
    """What an effect may know of a sensor or an actuator."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def position(self) -> Position:
        """Where it sits [m]."""

    @property
    def recorded(self) -> Recorded:
        """Where it was recorded to sit [m]."""

    @property
    def directions(self) -> tuple[int, ...]:
        """Recorded directions of its channels."""

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Its channels, in order."""

    @property
    def arm(self) -> Parameter | None:
        """Distance from its place to the line of its force [m]; None without an arm."""

    def factor(self, omega: Inexact[Array, "frequency"]) -> Inexact[Array, "frequency"] | None:
        """Factor on its FRFs by its gain and its delay; None where both are exact."""

    def points(self, axes: tuple[int, ...], *, with_slopes: bool = False) -> Points:
        """Where and along what its channels act on a structure that moves along axes."""


class Instruments(NamedTuple):
    """Sensors and actuators by name, in their order."""

    sensors: Mapping[str, TransducerProtocol]
    actuators: Mapping[str, TransducerProtocol]

    def side(self, side: str) -> Mapping[str, TransducerProtocol]:
        """Transducers of one side, `sensor` or `actuator`."""
        if side not in ("sensor", "actuator"):
            raise InputError(
                f"side={shown(side)} was given; 'sensor' or 'actuator' is needed, since every "
                "channel is on one of them: side='sensor'."
            )
        return self.sensors if side == "sensor" else self.actuators

    def channels(self, side: str) -> list[Channel]:
        """Channels of one side, in order."""
        transducers = self.side(side).values()
        return [channel for transducer in transducers for channel in transducer.channels]

    def points(self, side: str, axes: tuple[int, ...]) -> Points:
        """Where and along what the channels of a side act, alike where one of them has an arm."""
        transducers = self.side(side).values()
        on_arms = any(transducer.arm is not None for transducer in transducers)
        return joined([item.points(axes, with_slopes=on_arms) for item in transducers])

    def side_of(self, transducer: Number) -> str:
        """Side of a transducer of this name, sensors first; of a number, `sensor`."""
        if not isinstance(transducer, str) or transducer in self.sensors:
            return "sensor"
        if transducer in self.actuators:
            return "actuator"
        raise InputError(
            f'An effect on "{transducer}" was added, but the experiment has the sensors '
            f"{', '.join(self.sensors)} and the actuators {', '.join(self.actuators)}. Name one of "
            f'them: "{next(iter(self.sensors))}".'
        )

    def name(self, transducer: Number, side: str = "sensor") -> str:
        """Name of a transducer, from its name or number."""
        return transducer if isinstance(transducer, str) else [*self.side(side)][int(transducer)]

    def number(self, transducer: Number, side: str = "sensor") -> Number:
        """Number of a transducer among those of its side.

        Effects on different transducers then differ in a number only, and are compiled once.
        """
        names = [*self.side(side)]
        if isinstance(transducer, int) and 0 <= transducer < len(names):
            return np.asarray(transducer)
        if not isinstance(transducer, str | int):
            return transducer
        if transducer not in names:
            raise InputError(
                f'An effect on {side} "{transducer}" was added, but the experiment has the {side}s '
                f'{", ".join(names)}. Name one of them: {side}="{names[0]}".'
            )
        return np.asarray(names.index(transducer))

    def rows(self, transducer: Number, side: str = "sensor") -> list[int]:
        """Places of the channels of a transducer among those of its side."""
        name = self.name(transducer, side)
        return [row for row, channel in enumerate(self.channels(side)) if channel.name == name]

    def of(self, transducer: Number, side: str = "sensor") -> Float[Array, "channel"]:
        """1 for the channels of a transducer, also by a traced number; 0 for all others."""
        names = [*self.side(side)]
        numbers = np.array([names.index(channel.name) for channel in self.channels(side)])
        # A product, by NumPy where the number is known: a conversion would be compiled.
        return jnp.asarray(1.0 * (numbers == self.number(transducer, side)))

    def recorded(self, transducer: Number, side: str = "sensor") -> Recorded:
        """Recorded place of a transducer [m]."""
        return self.side(side)[self.name(transducer, side)].recorded
