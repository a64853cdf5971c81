"""_groups: in, which data each unknown moves; out, unknowns that can be moved together.

Not known here: experiments, data. A sensor's place moves its own channels only, so that the places
of all sensors need one step of differences, not one each (Curtis, Powell and Reid, 1974,
DOI 10.1093/imamat/13.1.117).
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float


class Groups(NamedTuple):
    """Unknowns in groups, no two of one group moving the same datum.

    Parameters
    ----------
    of
        Group of each unknown.
    moves
        Which data each unknown moves.
    """

    of: np.ndarray
    moves: Bool[np.ndarray, "unknown datum"]

    @property
    def number(self) -> int:
        """Number of groups."""
        return int(self.of.max(initial=-1)) + 1

    def directions(self) -> Float[np.ndarray, "group unknown"]:
        """Unknowns that are moved together, one group a row."""
        return (np.arange(self.number)[:, None] == self.of).astype(float)

    def slopes(
        self, together: Float[np.ndarray, "point group datum"]
    ) -> Float[np.ndarray, "point unknown datum"]:
        """Slopes along each unknown, from those along the groups."""
        return together[:, self.of] * self.moves


def grouped(moves: Bool[np.ndarray, "unknown datum"]) -> Groups:
    """Put each unknown in the first group that moves none of its data."""
    of = np.zeros(len(moves), dtype=int)
    taken: list[np.ndarray] = []
    for unknown, own in enumerate(moves):
        free = [number for number, other in enumerate(taken) if not (own & other).any()]
        of[unknown] = free[0] if free else len(taken)
        if free:
            taken[free[0]] |= own
        else:
            taken.append(own.copy())
    return Groups(of, moves)
