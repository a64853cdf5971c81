"""What `place` is given: positions to try, regions that are forbidden, costs of transducers."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._shared.errors import UsageError
from ..design._positions_on import can_be_at, positions_on
from ..experiment.experiment import Experiment
from ..positions.bounds import in_space

MOST_PLACEMENTS = 100_000
"""Placements, at most, that an exhaustive search tries."""


def positions_to_try(experiment: Experiment, search: str, count: int) -> dict[str, Sequence[Any]]:
    """Return the positions of the structure at which each sensor and actuator can be mounted [m].

    Of `count` positions those are kept that a tolerance allows.
    """
    if search == "evolutionary" and in_space(experiment.structure.modes.bounds()):
        raise UsageError(
            "--search evolutionary moves along a line, but this structure lies in space. Give "
            "--search sequential or forward, or use bp.place with a tolerance for each transducer."
        )
    positions = positions_on(experiment, count)
    transducers = {**experiment.sensor, **experiment.actuator}
    allowed: dict[str, Sequence[Any]] = {
        name: [at for at in positions if can_be_at(experiment, transducer, at)]
        for name, transducer in transducers.items()
    }
    nowhere = [name for name, remaining in allowed.items() if not remaining]
    if nowhere:
        raise UsageError(
            f'At none of {len(positions)} positions "{nowhere[0]}" can be mounted with its '
            "tolerance. Try more positions, --places 200, or use bp.place with positions of your "
            "own."
        )
    placements = np.prod([len(remaining) for remaining in allowed.values()], dtype=float)
    if search == "exhaustive" and placements > MOST_PLACEMENTS:
        raise UsageError(
            f"--search exhaustive would try {placements:.2g} placements of {', '.join(allowed)}. "
            "Give --search forward (or evolutionary), fewer --sensors or fewer --places."
        )
    return allowed


def forbidden_regions(words: Sequence[str]) -> list[tuple[Any, Any]]:
    """Low and high corners [m] of regions, from `0.4:0.45` or `0,0,0:0.1,0.1,0` each."""
    return [_region(word) for word in words]


def _region(word: str) -> tuple[Any, Any]:
    try:
        low, high = ([float(number) for number in corner.split(",")] for corner in word.split(":"))
    except ValueError:
        low, high = [], []
    if not low or len(low) != len(high) or len(low) not in (1, 3):
        raise UsageError(
            f"--forbidden {word!r} was given; the least and the greatest position [m] of a region "
            "are needed, since nothing is placed between them: --forbidden 0.4:0.45, or in space "
            "--forbidden 0,0,0:0.1,0.1,0."
        )
    return (low[0], high[0]) if len(low) == 1 else (tuple(low), tuple(high))


def costs(words: Sequence[str]) -> dict[str, float]:
    """Costs [nat] of transducers by name, from `s1=0.1` each."""
    return dict(map(_cost, words))


def _cost(word: str) -> tuple[str, float]:
    name, _, number = word.rpartition("=")
    try:
        cost = float(number)
    except ValueError:
        cost = -1.0
    if not name or not cost >= 0:
        raise UsageError(
            f"--cost {word!r} was given; a transducer and the information gain [nat] that it must "
            "exceed to be used are needed: --cost s2=0.1."
        )
    return name, cost
