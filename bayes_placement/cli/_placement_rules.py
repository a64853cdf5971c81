"""Rules of a placement as they are typed: forbidden regions, and costs of transducers."""

from collections.abc import Sequence
from typing import Any

from .._shared.errors import UsageError


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
