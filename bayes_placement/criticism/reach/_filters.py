"""What a channel may have done to its record, told by name and few numbers.

A filter is one part, or a part and a gain. On a force FRFs have the inverse of what filters its
record; gains, signs and delays are those of the FRFs on either side, as of the effects of the
library.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from jaxtyping import Complex, Float

from ..._shared.dimensions import Spectrum
from ...effects.butterworth import loss_of_order
from ...effects.mount_resonance import excess
from ...inference.engines.least_squares import STEP
from ...laws.catalogue import leaves
from ...laws.law import Tree
from ...laws.rows import ELEMENTS_OF_ROW, NUMBERS, Points, Slopes, Stiffness, Which

DAMPING_RATIO = 0.03
"""Median of the damping ratio of a mount."""

DECADES_OF_DAMPING = 0.5
"""Its deviation: from 0.003 to 0.3 for the most part."""

Number: TypeAlias = float | np.ndarray
Band: TypeAlias = tuple[float, float]


class Part(NamedTuple):
    """One part of a filter.

    The factor is at angular frequencies [rad/s], of its numbers; these are from two standard normal
    coordinates and the ends of the band [Hz]. `filters` says that it filters the record, so that
    FRFs of a force have its inverse.
    """

    factor: Callable[..., Any]
    numbers: Callable[[Number, Number, Band], tuple[Number, ...]]
    words: str
    filters: bool = True
    scale: float = 1.0
    """Factor on the numbers in words."""


def _ratio(omega: Spectrum, frequency: Number) -> Float[np.ndarray, "*row frequency"]:
    return omega / (2 * np.pi * frequency)


def _nothing(size: Number, other: Number, band: Band) -> tuple[()]:
    return ()


def _at_the_top(size: Number, other: Number, band: Band) -> tuple[Number]:
    """A corner [Hz] within a decade or two of the last line."""
    return (band[1] * 10**size,)


PARTS: Mapping[str, Part] = {
    "gain": Part(
        lambda omega, gain: gain + 0j * omega,
        lambda size, other, band: (10**size,),
        "gain of {:g}",
        filters=False,
    ),
    "reversed": Part(lambda omega: -1.0 + 0j * omega, _nothing, "reversed sign", filters=False),
    "delay": Part(
        lambda omega, delay: np.exp(-1j * omega * delay),
        lambda size, other, band: (size * 0.5 / band[1],),  # half a period of the last line
        "delay of {:g} µs",
        filters=False,
        scale=1e6,
    ),
    "low-pass": Part(
        lambda omega, corner: 1 / loss_of_order(_ratio(omega, corner), 1),
        _at_the_top,
        "first-order low-pass at {:g} Hz",
    ),
    "high-pass": Part(
        lambda omega, corner: 1 / loss_of_order(-1 / _ratio(omega, corner), 1),
        lambda size, other, band: (band[0] * 10**size,),
        "first-order high-pass at {:g} Hz",
    ),
    "low-pass-2": Part(
        lambda omega, corner: 1 / loss_of_order(_ratio(omega, corner), 2),
        _at_the_top,
        "second-order low-pass at {:g} Hz",
    ),
    "mount": Part(
        lambda omega, corner, ratio: 1 + excess(_ratio(omega, corner), ratio),
        lambda size, other, band: (
            band[1] * 10**size,
            DAMPING_RATIO * 10 ** (DECADES_OF_DAMPING * other),
        ),
        "resonance of a mount at {:g} Hz",
    ),
    "differentiated": Part(lambda omega: 1j * omega, _nothing, "differentiated once"),
    "integrated": Part(lambda omega: 1 / (1j * omega), _nothing, "integrated once"),
}
"""Parts by their names; a gain and a corner have a deviation of a decade."""

FILTERS: Sequence[Tree] = (*PARTS, *(["*", "gain", part] for part in PARTS if part != "gain"))
"""Filters that are tried: one part, alone or with a gain."""


@dataclass(frozen=True)
class ChannelFilter:
    """A filter in a channel: the factor on its FRFs.

    `parts` are numbers of each part, by its name; `of_force` says that it is in the channel of an
    actuator.
    """

    parts: Mapping[str, tuple[Number, ...]]
    of_force: bool = False

    def factor(self, omega: Spectrum) -> Complex[np.ndarray, "*row frequency"]:
        """Factor on FRFs at angular frequencies [rad/s]."""
        return math.prod(
            PARTS[name].factor(omega, *numbers) ** (-1 if self._inverts(name) else 1)
            for name, numbers in self.parts.items()
        )

    def _inverts(self, name: str) -> bool:
        return self.of_force and PARTS[name].filters

    def tree(self) -> Tree:
        """Name of its only part, or a group of names."""
        names = [*self.parts]
        return names[0] if len(names) == 1 else ["*", *names]

    def in_words(self) -> str:
        """Its parts with their numbers."""
        return " and ".join(
            PARTS[name].words.format(
                *(float(f"{PARTS[name].scale * number:.3g}") for number in numbers)
            )
            for name, numbers in self.parts.items()
        )

    def __repr__(self) -> str:
        return self.in_words()


class FilterRows:
    """Filters as arrays, with priors about the band: what `NetworkRows` is for a port.

    `omega` are angular frequencies of the experiment [rad/s].
    """

    def __init__(self, omega: Spectrum, of_force: bool):
        self.trees = list(FILTERS)
        self.of_force = of_force
        self._band = float(omega[0] / (2 * np.pi)), float(omega[-1] / (2 * np.pi))

    def at_lines(self, which: Which, points: Points, omega: Spectrum) -> tuple[Stiffness, Slopes]:
        """Change of the factor from 1 of each row, and its slopes along their coordinates.

        `which` are filters of the rows, `omega` angular frequencies [rad/s].
        """
        values = self.stiffness(which, points, omega)
        moved = [self.stiffness(which, points + STEP * unit, omega) for unit in np.eye(NUMBERS)]
        return values, np.stack([(each - values) / STEP for each in moved], axis=1)

    def stiffness(self, which: Which, points: Points, omega: Spectrum) -> Stiffness:
        """Change of the factor from 1 alone, which is what a stiffness is at a port."""
        changes = np.empty((len(points), len(omega)), complex)
        for number in np.unique(which):
            rows = which == number
            coordinates = points[rows].T[..., None]
            changes[rows] = self.law(int(number), coordinates).factor(omega) - 1
        return changes

    def law(self, number: int, point: Float[np.ndarray, "coordinate *row"]) -> ChannelFilter:
        """Filter at coordinates."""
        parts = {
            name: PARTS[name].numbers(point[place], point[ELEMENTS_OF_ROW + place], self._band)
            for place, name in enumerate(leaves(self.trees[number]))
        }
        return ChannelFilter(parts, self.of_force)
