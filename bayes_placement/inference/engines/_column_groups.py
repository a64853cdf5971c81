"""Columns of a Jacobian that one difference gives together.

The position of a sensor changes its own channels only, so that the positions of all sensors need
one step of differences, not one each (Curtis, Powell and Reid, 1974,
doi:10.1093/imamat/13.1.117).
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from ..batches import distinct_rows, threaded_map


class Changed(NamedTuple):
    """Whether each set of unknowns changes each datum, and the level of the noise."""

    data: Bool[np.ndarray, "set datum"]
    noise: Bool[np.ndarray, "set"]


Probe = Callable[[Bool[np.ndarray, "set unknown"]], Changed]


def changed_data(probe: Probe, alike: Int[np.ndarray, "unknown"]) -> Changed:
    """Return what each unknown changes; those that are `alike` may change different data.

    The same number of each sensor, such as its position, changes other data. Probes of those whose
    place in binary has a bit, and of those whose place has it not, then tell of each datum which
    one changes it: two evaluations a bit in the place of one an unknown (group testing: Dorfman,
    Ann. Math. Stat. 14 (1943) 436). Where two of them change one datum, each is probed alone.
    """
    unknown = np.eye(len(alike), dtype=bool)
    groups = [np.flatnonzero(alike == number) for number in np.unique(alike)]
    several = [group for group in groups if 0 < 2 * len(_bits(len(group))) < len(group)]
    found = [_told_apart(probe(_halves(unknown[group])), len(group)) for group in several]
    told = [(group, data) for group, data in zip(several, found, strict=True) if data is not None]
    alone = np.ones(len(alike), dtype=bool)
    for group, _ in told:
        alone[group] = False
    each = probe(unknown[alone])
    data, noise = (np.zeros((len(alike), *part.shape[1:]), dtype=bool) for part in each)
    data[alone], noise[alone] = each
    for group, of_group in told:
        data[group] = of_group
    return Changed(data, noise)


def _halves(
    members: Bool[np.ndarray, "member unknown"],
) -> Bool[np.ndarray, "half unknown"]:
    """For each bit the members whose place has it; then for each bit the others."""
    has_bit = _bits(len(members))
    return np.concatenate([has_bit, ~has_bit]) @ members


def _bits(count: int) -> Bool[np.ndarray, "bit member"]:
    """Bits of the numbers below a count."""
    places = np.arange(count)
    return places >> np.arange(int(count - 1).bit_length())[:, None] & 1 == 1


def _told_apart(halves: Changed, count: int) -> Bool[np.ndarray, "member datum"] | None:
    """Data that each member changes; None where two change the same, or the noise."""
    has_bit, has_not = np.split(halves.data, 2)
    changed = has_bit | has_not
    if halves.noise.any() or (has_bit & has_not).any() or (changed != changed[0]).any():
        return None
    bits = _bits(count)
    return np.stack([changed[0] & np.all(bit == has_bit.T, axis=1) for bit in bits.T])


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
