"""Columns of a Jacobian that one difference gives together.

The position of a sensor changes its own channels only, so that the positions of all sensors need
one step of differences, not one each (Curtis, Powell and Reid, 1974,
doi:10.1093/imamat/13.1.117).
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float


class ColumnGroups(NamedTuple):
    """Unknowns in groups, no two of one group changing the same datum.

    Parameters
    ----------
    group
        Group of each unknown.
    changes
        Which data each unknown changes.
    """

    group: np.ndarray
    changes: Bool[np.ndarray, "unknown datum"]

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


def column_groups(changes: Bool[np.ndarray, "unknown datum"]) -> ColumnGroups:
    """Put each unknown in the first group that changes none of its data."""
    group = np.zeros(len(changes), dtype=int)
    taken: list[np.ndarray] = []
    for unknown, data in enumerate(changes):
        free = [number for number, other in enumerate(taken) if not (data & other).any()]
        group[unknown] = free[0] if free else len(taken)
        if free:
            taken[free[0]] |= data
        else:
            taken.append(data.copy())
    return ColumnGroups(group, changes)
