"""Columns of a Jacobian that one difference gives together.

The position of a sensor changes its own channels only, so that the positions of all sensors need
one step of differences, not one each (Curtis, Powell and Reid, 1974,
doi:10.1093/imamat/13.1.117).
"""

import functools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from ..batched_function import distinct_rows, threaded_map


class Block(NamedTuple):
    """Data that the same unknowns change, which are all of different groups."""

    unknowns: np.ndarray
    """The unknowns."""
    data: slice | np.ndarray
    """The data: a slice where they follow each other."""


@dataclass(frozen=True)
class ColumnGroups:
    """Unknowns in groups, no two of one group changing the same datum."""

    group: np.ndarray
    """Group of each unknown."""
    changes: Bool[np.ndarray, "unknown datum"]
    """Which data each unknown changes."""

    @property
    def number(self) -> int:
        """Number of groups."""
        return int(self.group.max(initial=-1)) + 1

    def directions(self) -> Float[np.ndarray, "group unknown"]:
        """Unknowns that are changed together, one group a row."""
        return (np.arange(self.number)[:, None] == self.group).astype(float)

    def slopes(
        self, along_groups: Float[np.ndarray, "point group datum"]
    ) -> Float[np.ndarray, "point unknown datum"]:
        """Slopes along each unknown, from those along the groups."""
        return along_groups[:, self.group] * self.changes

    def products(
        self,
        along_groups: Float[np.ndarray, "point group datum"],
        residual: Float[np.ndarray, "point datum"],
    ) -> tuple[Float[np.ndarray, "point unknown unknown"], Float[np.ndarray, "point unknown"]]:
        """Products of the slopes along unknowns with each other, and with residuals.

        Block by block, without the zeros of unknowns that change other data: they are a half of
        all slopes and more.
        """
        count, size = len(along_groups), len(self.group)
        squares, pulls = np.zeros((count, size, size)), np.zeros((count, size))
        of_block = functools.partial(self._products_of_block, along_groups, residual)
        products = threaded_map(of_block, self.blocks)
        for (unknowns, _), (square, pull) in zip(self.blocks, products, strict=True):
            squares[:, unknowns[:, None], unknowns] += square
            pulls[:, unknowns] += pull
        return squares, pulls

    def _products_of_block(
        self, along_groups: np.ndarray, residual: np.ndarray, block: Block
    ) -> tuple[np.ndarray, np.ndarray]:
        unknowns, data = block
        rows = self.group[unknowns]
        slopes = along_groups[:, rows if isinstance(data, slice) else rows[:, None], data]
        return slopes @ slopes.transpose(0, 2, 1), (slopes @ residual[:, data, None])[..., 0]

    @functools.cached_property
    def blocks(self) -> tuple[Block, ...]:
        """Data in blocks, each changed by the same unknowns."""
        patterns, pattern_of_datum = _patterns(self.changes)
        return tuple(
            Block(np.flatnonzero(pattern), _in_a_row(np.flatnonzero(pattern_of_datum == number)))
            for number, pattern in enumerate(patterns.T)
            if pattern.any()
        )


def _patterns(
    changes: Bool[np.ndarray, "unknown datum"],
) -> tuple[Bool[np.ndarray, "unknown pattern"], np.ndarray]:
    """The different columns, and which of them each datum has."""
    first, pattern_of_datum = distinct_rows(np.packbits(changes, axis=0).T)
    return changes[:, first], pattern_of_datum


def _in_a_row(data: np.ndarray) -> slice | np.ndarray:
    """The same data as a slice, where they follow each other: it copies nothing."""
    first, last = data[0], data[-1]
    return slice(first, last + 1) if last - first + 1 == len(data) else data


def column_groups(changes: Bool[np.ndarray, "unknown datum"]) -> ColumnGroups:
    """Put each unknown in the first group that changes none of its data."""
    group = np.zeros(len(changes), dtype=int)
    group_masks: list[np.ndarray] = []
    patterns, _ = _patterns(changes)  # few, however many data
    for unknown, changed in enumerate(patterns):
        free = [number for number, mask in enumerate(group_masks) if not (changed & mask).any()]
        group[unknown] = free[0] if free else len(group_masks)
        if free:
            group_masks[free[0]] |= changed
        else:
            group_masks.append(changed.copy())
    return ColumnGroups(group, changes)
