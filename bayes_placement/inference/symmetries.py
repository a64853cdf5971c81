"""Placements that may explain the same data as another one: its mirror image, an exchange.

A sampler may try them as moves; each keeps volume and is its own inverse, and is accepted or not by
the posterior, so a wrong guess costs time, never correctness.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx

from .._sites import Unknown
from ..experiment.experiment import Experiment

Values = dict[str, Any]
"""Values of unknowns, by name."""

Move = Callable[[Values], Values]


def symmetries(experiment: Experiment) -> tuple[Move, ...]:
    """Moves between placements: the mirror image, and sensor and actuator exchanged."""
    positions = [
        unknown.name
        for unknown in experiment.unknowns
        if unknown.is_placement and _is_on_a_line(unknown)
    ]
    moves: list[Move] = []
    if positions:
        moves.append(_Mirror(tuple(positions), *experiment.structure.modes.bounds()))
    if len(positions) == 2 and len(experiment.sensor) == len(experiment.actuator) == 1:
        moves.append(_Exchange(*positions))
    return tuple(moves)


def _is_on_a_line(unknown: Unknown) -> bool:
    is_scalar = not unknown.component and unknown.distribution.shape() == ()
    return unknown.field == "position" and is_scalar


class _Mirror(eqx.Module):
    """Mirror image of positions on a line."""

    names: tuple[str, ...] = eqx.field(static=True)
    low: float
    high: float

    def __call__(self, values: Values) -> Values:
        """Values with all positions mirrored."""
        return values | {name: self.low + self.high - values[name] for name in self.names}


class _Exchange(eqx.Module):
    """Two positions exchanged."""

    first: str = eqx.field(static=True)
    second: str = eqx.field(static=True)

    def __call__(self, values: Values) -> Values:
        """Values with either position at the other's place."""
        return values | {self.first: values[self.second], self.second: values[self.first]}
