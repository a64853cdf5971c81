"""Places of sensors, actuators, or both that were measured from the other end of a structure."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import equinox as eqx
import numpy as np

from ...positions.bounds import in_space
from ...positions.places import AtNode, Cartesian, coordinates
from ...positions.vectors import triple
from .mistakes import Mistake, from_other_end
from .record import PLACE_PRECISION

if TYPE_CHECKING:
    from ..experiment import Experiment

SIDES = (("sensor",), ("actuator",), ("sensor", "actuator"))
"""Whose places may have been measured so."""


class OtherEnd(NamedTuple):
    """Sides whose places are measured from the other end of an axis."""

    sides: Sequence[str]
    axis: int

    def of(self, model: "Experiment") -> "Experiment":
        """A model whose places are numbers, those of these sides measured so."""
        total = sum(self._ends(model))
        for side in self.sides:
            for name, transducer in getattr(model, side).items():
                place = np.array(coordinates(transducer.position), ndmin=1)
                place[self.axis] = total - place[self.axis]
                at = Cartesian(*place) if place.size > 1 else place[0]
                model = eqx.tree_at(partial(_place, side=side, name=name), model, at)
        return model

    def mistake(self, model: "Experiment") -> Mistake:
        """The mistake in words, by the ends of a model."""
        axis = "xyz"[self.axis] if in_space(model.structure.modes.bounds()) else ""
        return from_other_end(self.sides, axis, self._ends(model))

    def _ends(self, model: "Experiment") -> tuple[float, float]:
        low, high = map(np.atleast_1d, model.structure.modes.bounds())
        return float(low[self.axis]), float(high[self.axis])


def other_ends(model: "Experiment") -> Iterator[OtherEnd]:
    """All that leave each transducer on the structure, where shapes are known between nodes."""
    low, high = map(np.atleast_1d, model.structure.modes.bounds())
    if _lies_on_structure(model):
        for axis in np.flatnonzero(low < high).tolist():
            ends = [OtherEnd(sides, axis) for sides in SIDES]
            yield from (end for end in ends if _lies_on_structure(end.of(model)))


def _place(model: "Experiment", side: str, name: str) -> object:
    return getattr(model, side)[name].position


def _lies_on_structure(model: "Experiment") -> bool:
    modes = model.structure.modes
    places = [each.position for each in (*model.sensor.values(), *model.actuator.values())]
    if not in_space(modes.bounds()):
        return True
    if any(isinstance(place, AtNode) for place in places):
        return False
    frames = [piece.frame() for piece in modes.anywhere()]
    at = [triple(coordinates(place)) for place in places]
    apart = [min((frame.distance(place) for frame in frames), default=np.inf) for place in at]
    return max(apart) <= PLACE_PRECISION * float(np.max(np.subtract(*modes.bounds()[::-1])))
