"""A sensor or an actuator that sat elsewhere than recorded, beyond its tolerance."""

import itertools
import math
from collections import OrderedDict
from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.sites import is_open, is_unknown, unit
from ..positions.bounds import in_space
from ..positions.places import Cartesian
from ..positions.vectors import Vector, triple
from . import _setting_words
from .prelude import Instruments, Modes, Number, OfSide, Scales, Uniform, coordinates, field


class Misplaced(OfSide):
    """A transducer of a side shifted from its recorded place, far beyond its tolerance."""

    absent: ClassVar[tuple[str, float]] = ("shift", 0.0)
    place_fields: ClassVar[tuple[str, ...]] = ("shift",)
    shift: eqx.AbstractVar[Parameter]
    towards: eqx.AbstractVar[tuple[Vector, ...]]
    bearing: eqx.AbstractVar[Parameter]

    def on(self, modes: Modes) -> "Misplaced":
        """Return the effect as it is."""
        if in_space(modes.bounds()) and not self.towards:
            raise InputError(
                f'Effect "{self.name}": a shift without a direction was given; one is needed in '
                f"space, or two on a surface, since a {self.side} may be shifted along any axis: "
                "towards=((1.0, 0.0, 0.0),)."
            )
        self._check_shift(modes)
        return self

    def _check_shift(self, modes: Modes) -> None:
        """Refuse a shift across more than the structure, as one in mm is."""
        low, high = modes.bounds()
        known = isinstance(self.shift, int | float)  # what is no number is refused elsewhere
        if not known or any(is_open(bound) for bound in (low, high)):
            return
        extent, shift = float(np.linalg.norm(np.subtract(high, low))), abs(self.shift)
        if shift > extent:
            raise InputError(
                f'Effect "{self.name}": a shift of {shift:g} m was given, farther than the '
                f"structure ({extent:g} m) extends; a distance on it is needed, in metres: "
                "shift=0.02 for 20 mm."
            )

    def moved(self, instruments: Instruments, modes: Modes) -> Instruments:
        """Transducers of which this one is shifted, as far as the structure extends."""
        corners = [jnp.asarray(corner, float) for corner in modes.bounds()]
        step = self._step() @ jnp.asarray(self.towards, float) if self.towards else self.shift
        moved = OrderedDict(instruments.side(self.side))
        chosen = instruments.number(self.transducer, self.side)
        for number, (name, transducer) in enumerate(moved.items()):
            recorded = coordinates(transducer.position)
            shifted = jnp.clip(recorded + step, *corners)
            position = jnp.where(chosen == number, shifted, recorded)
            place = Cartesian(*position) if self.towards else position
            moved[name] = eqx.tree_at(lambda tree: tree.position, transducer, place)
        return instruments._replace(**{f"{self.side}s": moved})

    def _step(self) -> Float[Array, "towards"]:
        """Lengths along the directions [m]."""
        angle = jnp.asarray(self.bearing, float)
        parts = jnp.stack([jnp.cos(angle), jnp.sin(angle)])
        return self.shift * parts[: len(self.towards)]

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Name of the transducer, and the direction of the shift if there is only one."""
        direction = _setting_words.along(self.towards[0]) if len(self.towards) == 1 else ""
        return _setting_words.joined(OfSide.setting(self, modes, instruments), direction)

    @classmethod
    def suggest(cls, scales: Scales) -> Sequence["Misplaced"]:
        """Each transducer anywhere on the piece of the structure on which it was recorded."""
        return [
            cls(name, **shift)
            for name, transducer in scales.instruments.side(cls.side).items()
            for shift in _anywhere(scales.modes, transducer.recorded)
        ]


class MisplacedSensor(Misplaced):
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

    Examples
    --------
    >>> elsewhere = bp.effects.misplaced_sensor("s1", shift=dist.Uniform(-0.1, 0.1))
    >>> [unknown.name for unknown in (experiment + elsewhere).unknowns_of(elsewhere)]
    ['instrument_effects.misplaced_sensor.shift']
    """

    side = "sensor"
    sensor: Number
    shift: Parameter = field(metadata=unit("m"))
    towards: tuple[Vector, ...] = field(default=(), kw_only=True)
    bearing: Parameter = field(metadata=unit("rad"), default=0.0, kw_only=True)
    name: str = field(static=True, default="misplaced_sensor", kw_only=True)


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
    shift: Parameter = field(metadata=unit("m"))
    towards: tuple[Vector, ...] = field(default=(), kw_only=True)
    bearing: Parameter = field(metadata=unit("rad"), default=0.0, kw_only=True)
    name: str = field(static=True, default="misplaced_actuator", kw_only=True)


def _anywhere(modes: Modes, recorded: Any) -> list[dict[str, Any]]:
    """Priors of the shift of a transducer that was recorded somewhere, one for each plane."""
    bounds = modes.bounds()
    if not in_space(bounds):
        return [{"shift": Uniform(bounds[0] - recorded, bounds[1] - recorded)}]
    frames = [piece.frame() for piece in modes.anywhere()]
    nearest = min(frames, key=lambda frame: frame.distance(recorded))
    feet = nearest.directions @ (np.array(recorded) - nearest.origin)
    lengths = [*nearest.values.values()]
    free = [row for row, length in enumerate(lengths) if is_unknown(length)]
    uniform = [lengths[row] for row in free]
    if len(free) == 1:
        low, high = uniform[0].low - feet[free[0]], uniform[0].high - feet[free[0]]
        return [{"shift": Uniform(low, high), "towards": (triple(nearest.directions[free[0]]),)}]
    farthest = float(np.linalg.norm([prior.high - prior.low for prior in uniform]))
    shift, bearing = Uniform(0.0, farthest), Uniform(-math.pi, math.pi)
    pairs = itertools.combinations(nearest.directions[free], 2)
    return [
        {"shift": shift, "towards": tuple(map(triple, pair)), "bearing": bearing} for pair in pairs
    ]
