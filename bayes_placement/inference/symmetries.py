"""Placements that may explain the same data as another one: its mirror image, an exchange.

A sampler may try them as moves; each keeps volume and is its own inverse, and is accepted or not by
the posterior, so a wrong guess costs time, never correctness.
"""

from collections.abc import Callable
from typing import Any

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
    moves = [_mirror(experiment, positions)] if positions else []
    if len(positions) == 2 and len(experiment.sensor) == len(experiment.actuator) == 1:
        moves.append(_exchange(*positions))
    return tuple(moves)


def _is_on_a_line(unknown: Unknown) -> bool:
    is_scalar = not unknown.component and unknown.distribution.shape() == ()
    return unknown.field == "position" and is_scalar


def _mirror(experiment: Experiment, positions: list[str]) -> Move:
    low, high = experiment.structure.modes.bounds()

    def move(values: Values) -> Values:
        return values | {name: low + high - values[name] for name in positions}

    return move


def _exchange(first: str, second: str) -> Move:
    def move(values: Values) -> Values:
        return values | {first: values[second], second: values[first]}

    return move
