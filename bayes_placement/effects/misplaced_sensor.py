"""misplaced_sensor: in, a sensor and what is wrong with it; out, where it sat, what it recorded.

Not known here: the structure, data.
"""

import itertools
import math
from collections import OrderedDict
from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int
from numpyro.distributions import Uniform

from .._sites import is_unknown, unit
from .._types import InputError, Parameter, Receptance
from ..modes.modes import Modes
from ..positions.bounds import in_space
from ..positions.channel import Channel
from ..positions.places import Cartesian, Frame, coordinates
from ..positions.vectors import Coordinates, triple
from . import _words
from ._effect import InstrumentEffect, Numbered, Omega, Sensors, numbered, of_sensor, sensor_names


class MisplacedSensor(InstrumentEffect):
    """A sensor far outside its tolerance, with its axis reversed, or with its cable swapped.

    Parameters
    ----------
    sensor
        Name of the sensor.
    shift
        How far it sits beyond its recorded place and tolerance [m].
    towards
        In space: the direction of the shift, or two directions at right angles on a surface.
    bearing
        Angle of the shift from the first of two directions to the second [rad].
    reversed_share
        0, or 1 where its axis points the other way; between, a mixture of both.
    swapped_with
        Name of the sensor whose channels carry its signal, and it the other's; None if none.
    swapped_share
        0, or 1 where the two are swapped.
    """

    absent: ClassVar[tuple[str, float]] = ("shift", 0.0)
    sensor: Numbered
    shift: Parameter = eqx.field(metadata=unit("m"), default=0.0)
    towards: tuple[Any, ...] = eqx.field(default=(), kw_only=True)
    bearing: Parameter = eqx.field(metadata=unit("rad"), default=0.0, kw_only=True)
    reversed_share: Parameter = eqx.field(metadata=unit("1"), default=0.0, kw_only=True)
    swapped_with: Numbered | None = eqx.field(default=None, kw_only=True)
    swapped_share: Parameter = eqx.field(metadata=unit("1"), default=0.0, kw_only=True)
    name: str = eqx.field(static=True, default="misplaced_sensor", kw_only=True)

    def sensors(self, sensors: Sensors, modes: Modes) -> Sensors:
        """Sensors of which this one is shifted, as far as the structure goes."""
        if in_space(modes.bounds()) and not self.towards:
            return sensors  # only reversed or swapped
        corners = [jnp.asarray(corner, float) for corner in modes.bounds()]
        step = self._step() @ jnp.asarray(self.towards, float) if self.towards else self.shift
        moved = OrderedDict(sensors)
        for number, (name, one) in enumerate(sensors.items()):
            here = coordinates(one.position)
            named = isinstance(self.sensor, str)
            chosen = self.sensor == (name if named else number)
            there = jnp.where(chosen, jnp.clip(here + step, *corners), here)
            place = Cartesian(*there) if self.towards else there
            moved[name] = eqx.tree_at(lambda sensor: sensor.position, one, place)
        return moved

    def _step(self) -> Float[Array, "towards"]:
        """Lengths along the directions [m]."""
        turn = jnp.asarray(self.bearing, float)
        parts = jnp.stack([jnp.cos(turn), jnp.sin(turn)])
        return self.shift * parts[: len(self.towards)]

    def among(self, channels: Sequence[Channel]) -> "MisplacedSensor":
        """Return it with the numbers of its sensors.

        Raises
        ------
        ValueError
            If the experiment does not have them, or they cannot be swapped.
        """
        one = eqx.tree_at(lambda one: one.sensor, self, numbered(self.sensor, channels))
        if self.swapped_with is None:
            return one
        other = numbered(self.swapped_with, channels)
        own, its = (len(_channels(number, channels)) for number in (one.sensor, other))
        if own != its:
            first, second = (sensor_names(channels)[int(place)] for place in (one.sensor, other))
            raise InputError(
                f'Effect "{self.name}": sensors "{first}" and "{second}" were given as swapped, '
                f"but they have {own} and {its} channels, of which each carries one of the other. "
                "Name two sensors alike."
            )
        return eqx.tree_at(lambda one: one.swapped_with, one, other)

    def recorded(self, frf: Receptance, omega: Omega, channels: Sequence[Channel]) -> Receptance:
        """FRF with the axis of the sensor reversed, or its channels swapped with another's."""
        sign = 1 - 2 * of_sensor(self.sensor, channels) * self.reversed_share
        turned = frf * sign[:, None, None]
        if self.swapped_with is None:
            return turned
        return turned + self.swapped_share * (
            turned[self._order(self.swapped_with, channels)] - turned
        )

    def _order(self, other: Numbered, channels: Sequence[Channel]) -> Int[Array, "sensor"]:
        """Which channel carries the signal of each, the two sensors exchanged."""
        known = sensor_names(channels)
        places = [_channels(number, channels) for number in range(len(known))]
        most = max(map(len, places))
        table = jnp.array([[*each, *each[:1] * (most - len(each))] for each in places])
        order = jnp.arange(len(channels))
        first, second = (numbered(one, channels) for one in (self.sensor, other))
        for one, its in ((first, second), (second, first)):
            order = order.at[table[one]].set(table[its])
        return order

    def setting(self, experiment: Any) -> str:
        """Which sensor it is about, and what is wrong with it."""
        sensor = f"sensor {_words.sensor(self.sensor, experiment)}"
        if self.swapped_with is not None:
            return f"{sensor} swapped with {_words.sensor(self.swapped_with, experiment)}"
        turned = is_unknown(self.reversed_share) or bool(self.reversed_share)
        one_way = _words.along(self.towards[0]) if len(self.towards) == 1 else ""
        return _words.together(sensor, "reversed" if turned else one_way)

    @classmethod
    def _moved(cls, experiment: Any, name: str) -> list["MisplacedSensor"]:
        """A sensor anywhere on the piece of the structure on which it was recorded."""
        bounds, recorded = experiment.structure.modes.bounds(), experiment.sensor[name].recorded
        if not in_space(bounds):
            return [cls(name, Uniform(bounds[0] - recorded, bounds[1] - recorded))]
        frames = [piece.frame() for piece in experiment.structure.modes.anywhere()]
        near = min(frames, key=lambda frame: _distance(frame, recorded))
        feet = near.directions @ (np.array(recorded) - near.origin)
        laws = [law for law in near.values.values() if is_unknown(law)]
        free = [row for row, law in enumerate(near.values.values()) if is_unknown(law)]
        if len(free) == 1:
            law, foot = laws[0], feet[free[0]]
            towards = (triple(near.directions[free[0]]),)
            return [cls(name, Uniform(law.low - foot, law.high - foot), towards=towards)]
        farthest = float(np.linalg.norm([law.high - law.low for law in laws]))
        around = {"shift": Uniform(0.0, farthest), "bearing": Uniform(-math.pi, math.pi)}
        pairs = itertools.combinations(near.directions[free], 2)
        return [cls(name, **around, towards=tuple(map(triple, pair))) for pair in pairs]

    @classmethod
    def suggest(cls, experiment: Any) -> Sequence["MisplacedSensor"]:
        """Each sensor anywhere on the structure, reversed, or swapped with each other one."""
        moved = [one for name in experiment.sensor for one in cls._moved(experiment, name)]
        turned = [cls(name, reversed_share=1.0) for name in experiment.sensor]
        swapped = [
            cls(one, swapped_with=other, swapped_share=1.0)
            for one, other in itertools.combinations(experiment.sensor, 2)
        ]
        return [*moved, *turned, *swapped]


def _channels(sensor: Any, channels: Sequence[Channel]) -> list[int]:
    """Channels of a sensor, by its number."""
    name = sensor_names(channels)[int(sensor)]
    return [place for place, channel in enumerate(channels) if channel.name == name]


def _distance(frame: Frame, place: Coordinates) -> float:
    """How far a place is from a piece of the structure [m]."""
    feet = frame.directions @ (np.array(place) - frame.origin)
    pairs = zip(frame.values.values(), feet, strict=True)
    held = [np.clip(at, law.low, law.high) if is_unknown(law) else law for law, at in pairs]
    return float(np.linalg.norm(frame.origin + np.array(held) @ frame.directions - place))


misplaced_sensor = MisplacedSensor
