"""A sensor or an actuator that sat elsewhere than recorded, beyond its tolerance."""

import itertools
import math
from collections import OrderedDict
from collections.abc import Sequence
from typing import Any, ClassVar, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import Uniform

from .._sites import is_unknown
from .._types import InputError, Parameter
from ..modes.modes import Modes
from ..positions.bounds import in_space
from ..positions.places import Cartesian, Frame, coordinates
from ..positions.vectors import CartesianComponents, triple
from . import _setting_words
from .effect import Location
from .instrument_effect import InstrumentEffect
from .instruments import Instruments, Number
from .scales import Scales

Self = TypeVar("Self", bound="Misplaced")


class Misplaced(InstrumentEffect):
    """A transducer of a side shifted from its recorded place, far beyond its tolerance.

    Attributes
    ----------
    side
        Its side, `sensor` or `actuator`, which is the field that holds its name.
    shift
        Distance from its recorded place and tolerance [m].
    towards
        In space: the direction of the shift, or two directions at right angles on a surface.
    bearing
        Angle of the shift from the first of two directions to the second [rad].
    """

    absent: ClassVar[tuple[str, float]] = ("shift", 0.0)
    place_fields: ClassVar[tuple[str, ...]] = ("shift",)
    side: eqx.AbstractClassVar[str]
    shift: eqx.AbstractVar[Parameter]
    towards: eqx.AbstractVar[tuple[Any, ...]]
    bearing: eqx.AbstractVar[Parameter]

    @property
    def transducer(self) -> Number:
        """Name or number of the transducer."""
        number: Number = getattr(self, self.side)
        return number

    def on(self: Self, modes: Modes) -> Self:
        """Return the effect as it is.

        Raises
        ------
        InputError
            If the structure is in space and no direction of the shift is given, or the shift is
            longer than the structure.
        """
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
        if not known or any(_is_open(bound) for bound in (low, high)):
            return
        extent, shift = float(np.linalg.norm(np.subtract(high, low))), abs(self.shift)
        if shift > extent:
            raise InputError(
                f'Effect "{self.name}": a shift of {shift:g} m was given, farther than the '
                f"structure ({extent:g} m) extends; a distance on it is needed, in metres: "
                "shift=0.02 for 20 mm."
            )

    def numbered(self: Self, instruments: Instruments) -> Self:
        """Return the effect with its transducer by number.

        Raises
        ------
        InputError
            If the experiment has no such transducer.
        """
        number = instruments.number(self.transducer, self.side)
        return eqx.tree_at(lambda tree: getattr(tree, self.side), self, number)

    def moved(self, instruments: Instruments, modes: Modes) -> Instruments:
        """Transducers of which this one is shifted, as far as the structure extends."""
        corners = [jnp.asarray(corner, float) for corner in modes.bounds()]
        step = self._step() @ jnp.asarray(self.towards, float) if self.towards else self.shift
        moved = OrderedDict(instruments.side(self.side))
        chosen = instruments.number(self.transducer, self.side)
        for number, (name, transducer) in enumerate(moved.items()):
            recorded = coordinates(transducer.position)
            shifted = jnp.clip(recorded + step, *corners)
            position: Any = jnp.where(chosen == number, shifted, recorded)
            if self.towards:
                position = Cartesian(*position)
            moved[name] = eqx.tree_at(lambda tree: tree.position, transducer, position)
        return instruments._replace(**{f"{self.side}s": moved})

    def _step(self) -> Float[Array, "towards"]:
        """Lengths along the directions [m]."""
        angle = jnp.asarray(self.bearing, float)
        parts = jnp.stack([jnp.cos(angle), jnp.sin(angle)])
        return self.shift * parts[: len(self.towards)]

    def location(self, modes: Modes, instruments: Instruments) -> Location:
        """Where the transducer was recorded [m]."""
        return instruments.recorded(self.transducer, self.side)

    def setting(self, modes: Modes, instruments: Instruments) -> str:
        """Name of the transducer, and the direction of the shift if there is only one."""
        direction = _setting_words.along(self.towards[0]) if len(self.towards) == 1 else ""
        name = instruments.name(self.transducer, self.side)
        return _setting_words.joined(f"{self.side} {name}", direction)

    @classmethod
    def suggest(cls: type[Self], scales: Scales) -> Sequence[Self]:
        """Each transducer anywhere on the piece of the structure on which it was recorded."""
        return [
            cls(name, **shift)
            for name, transducer in scales.instruments.side(cls.side).items()
            for shift in _anywhere(scales.modes, transducer.recorded)
        ]


def _is_open(number: Any) -> bool:
    """Whether a number is not known yet."""
    return is_unknown(number) or isinstance(number, jax.core.Tracer)


def _anywhere(modes: Modes, recorded: Any) -> list[dict[str, Any]]:
    """Priors of the shift of a transducer that was recorded somewhere, one for each plane."""
    bounds = modes.bounds()
    if not in_space(bounds):
        return [{"shift": Uniform(bounds[0] - recorded, bounds[1] - recorded)}]
    frames = [piece.frame() for piece in modes.anywhere()]
    nearest = min(frames, key=lambda frame: _distance(frame, recorded))
    feet = nearest.directions @ (np.array(recorded) - nearest.origin)
    lengths = [*nearest.values.values()]
    free = [row for row, length in enumerate(lengths) if is_unknown(length)]
    uniform: list[Any] = [lengths[row] for row in free]
    if len(free) == 1:
        low, high = uniform[0].low - feet[free[0]], uniform[0].high - feet[free[0]]
        return [{"shift": Uniform(low, high), "towards": (triple(nearest.directions[free[0]]),)}]
    farthest = float(np.linalg.norm([prior.high - prior.low for prior in uniform]))
    shift, bearing = Uniform(0.0, farthest), Uniform(-math.pi, math.pi)
    pairs = itertools.combinations(nearest.directions[free], 2)
    return [
        {"shift": shift, "towards": tuple(map(triple, pair)), "bearing": bearing} for pair in pairs
    ]


def _distance(frame: Frame, place: CartesianComponents) -> float:
    """Distance of a place from a piece of the structure [m]."""
    feet = frame.directions @ (np.array(place) - frame.origin)
    pairs = zip(frame.values.values(), feet, strict=True)
    nearest = [np.clip(foot, at.low, at.high) if is_unknown(at) else at for at, foot in pairs]
    return float(np.linalg.norm(frame.origin + np.array(nearest) @ frame.directions - place))
