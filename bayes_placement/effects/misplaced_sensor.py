"""A sensor that sat elsewhere than recorded, beyond its tolerance."""

import itertools
import math
from collections import OrderedDict
from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import Uniform

from .._sites import is_unknown, unit
from .._types import InputError, Parameter
from ..modes.modes import Modes
from ..positions.bounds import in_space
from ..positions.places import Cartesian, Frame, coordinates
from ..positions.vectors import Coordinates, triple
from . import _setting_words
from .effect import Location
from .instrument_effect import InstrumentEffect
from .instruments import Instruments, Number
from .scales import Scales


class MisplacedSensor(InstrumentEffect):
    """A sensor shifted from its recorded place, far beyond its tolerance.

    Parameters
    ----------
    sensor
        Name of the sensor.
    shift
        Distance from its recorded place and tolerance [m].
    towards
        In space: the direction of the shift, or two directions at right angles on a surface.
    bearing
        Angle of the shift from the first of two directions to the second [rad].
    """

    absent: ClassVar[tuple[str, float]] = ("shift", 0.0)
    place_fields: ClassVar[tuple[str, ...]] = ("shift",)
    sensor: Number
    shift: Parameter = eqx.field(metadata=unit("m"))
    towards: tuple[Any, ...] = eqx.field(default=(), kw_only=True)
    bearing: Parameter = eqx.field(metadata=unit("rad"), default=0.0, kw_only=True)
    name: str = eqx.field(static=True, default="misplaced_sensor", kw_only=True)

    def on(self, modes: Modes) -> "MisplacedSensor":
        """Return the effect as it is.

        Raises
        ------
        InputError
            If the structure is in space and no direction of the shift is given.
        """
        if in_space(modes.bounds()) and not self.towards:
            raise InputError(
                f'Effect "{self.name}": a shift without a direction was given; one is needed in '
                "space, or two on a surface, since a sensor may be shifted along any axis: "
                "towards=((1.0, 0.0, 0.0),)."
            )
        return self

    def numbered(self, instruments: Instruments) -> "MisplacedSensor":
        """Return the effect with its sensor by number.

        Raises
        ------
        InputError
            If the experiment has no such sensor.
        """
        return eqx.tree_at(lambda tree: tree.sensor, self, instruments.number(self.sensor))

    def moved(self, instruments: Instruments, modes: Modes) -> Instruments:
        """Sensors of which this one is shifted, as far as the structure extends."""
        corners = [jnp.asarray(corner, float) for corner in modes.bounds()]
        step = self._step() @ jnp.asarray(self.towards, float) if self.towards else self.shift
        moved = OrderedDict(instruments.sensors)
        chosen = instruments.number(self.sensor)
        for number, (name, sensor) in enumerate(moved.items()):
            recorded = coordinates(sensor.position)
            shifted = jnp.clip(recorded + step, *corners)
            position: Any = jnp.where(chosen == number, shifted, recorded)
            if self.towards:
                position = Cartesian(*position)
            moved[name] = eqx.tree_at(lambda tree: tree.position, sensor, position)
        return instruments._replace(sensors=moved)

    def _step(self) -> Float[Array, "towards"]:
        """Lengths along the directions [m]."""
        angle = jnp.asarray(self.bearing, float)
        parts = jnp.stack([jnp.cos(angle), jnp.sin(angle)])
        return self.shift * parts[: len(self.towards)]

    def location(self, modes: Modes, instruments: Instruments) -> Location:
        """Where the sensor was recorded [m]."""
        return instruments.recorded(self.sensor)

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Name of the sensor, and the direction of the shift if there is only one."""
        direction = _setting_words.along(self.towards[0]) if len(self.towards) == 1 else ""
        return _setting_words.joined(f"sensor {instruments.name(self.sensor)}", direction)

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence["MisplacedSensor"]:
        """Each sensor anywhere on the piece of the structure on which it was recorded."""
        return [
            variant
            for name, sensor in scales.instruments.sensors.items()
            for variant in cls._anywhere(scales.modes, name, sensor.recorded)
        ]

    @classmethod
    def _anywhere(cls, modes: Modes, name: str, recorded: Any) -> list["MisplacedSensor"]:
        bounds = modes.bounds()
        if not in_space(bounds):
            return [cls(name, Uniform(bounds[0] - recorded, bounds[1] - recorded))]
        frames = [piece.frame() for piece in modes.anywhere()]
        nearest = min(frames, key=lambda frame: _distance(frame, recorded))
        feet = nearest.directions @ (np.array(recorded) - nearest.origin)
        lengths = [*nearest.values.values()]
        free = [row for row, length in enumerate(lengths) if is_unknown(length)]
        uniform: list[Any] = [lengths[row] for row in free]
        if len(free) == 1:
            low, high = uniform[0].low - feet[free[0]], uniform[0].high - feet[free[0]]
            towards = (triple(nearest.directions[free[0]]),)
            return [cls(name, Uniform(low, high), towards=towards)]
        farthest = float(np.linalg.norm([prior.high - prior.low for prior in uniform]))
        shift, bearing = Uniform(0.0, farthest), Uniform(-math.pi, math.pi)
        pairs = itertools.combinations(nearest.directions[free], 2)
        return [
            cls(name, shift, towards=tuple(map(triple, pair)), bearing=bearing) for pair in pairs
        ]


def _distance(frame: Frame, place: Coordinates) -> float:
    """Distance of a place from a piece of the structure [m]."""
    feet = frame.directions @ (np.array(place) - frame.origin)
    pairs = zip(frame.values.values(), feet, strict=True)
    nearest = [np.clip(foot, at.low, at.high) if is_unknown(at) else at for at, foot in pairs]
    return float(np.linalg.norm(frame.origin + np.array(nearest) @ frame.directions - place))


misplaced_sensor = MisplacedSensor
