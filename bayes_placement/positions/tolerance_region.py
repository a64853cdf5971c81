"""tolerance_region: in, the bounds of a structure; out, the distribution of a place in it.

Not known here: any single support, mode shapes, sensors, data.
"""

import abc
from typing import Any

import equinox as eqx

from .bounds import Bounds, words
from .places import Position
from .vectors import Recorded


class Support(eqx.Module):
    """Where something may sit, as its user states it; a structure makes a law of it."""

    @property
    @abc.abstractmethod
    def recorded(self) -> Recorded:
        """Recorded position [m]."""

    @abc.abstractmethod
    def on(self, bounds: Bounds) -> Position:
        """Uniform law of the position [m], clipped to the structure.

        Raises
        ------
        ValueError
            If no part of the support lies on the structure.
        """

    @abc.abstractmethod
    def around(self, centre: Any) -> "Support":
        """Return the same tolerance about another recorded position [m]."""

    @abc.abstractmethod
    def scaled(self, factor: float) -> "Support":
        """Return a tolerance so many times as large about the same place.

        Raises
        ------
        ValueError
            If it has none of its own.
        """


def nothing_left(support: Support, bounds: Bounds) -> str:
    """Say that a support misses the structure."""
    return (
        f"{support} m has no point on the structure ({words(bounds)}). A place on it is needed, in "
        "metres and in its axes."
    )
