"""Which data each unknown changes, from few evaluations.

The same number of each sensor, such as its position, changes other data. Probes of those whose
place in binary has a bit, and of those whose place has it not, then tell of each datum which one
changes it: two evaluations a bit in the place of one an unknown (group testing: Dorfman, Ann. Math.
Stat. 14 (1943) 436). Where two of them change one datum, each is probed alone.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Int


class Changed(NamedTuple):
    """Whether each set of unknowns changes each datum, and the level of the noise."""

    data: Bool[np.ndarray, "set datum"]
    noise: Bool[np.ndarray, "set"]


Probe = Callable[[Bool[np.ndarray, "set unknown"]], Changed]


def changed_data(probe: Probe, alike: Int[np.ndarray, "unknown"]) -> Changed:
    """Return what each unknown changes; those that are `alike` may change different data."""
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
