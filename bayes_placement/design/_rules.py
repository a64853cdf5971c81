"""_rules: in, places to try; out, which of them, and which combinations, are allowed.

Not known here: how information is estimated, in what order placements are tried.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from .._vectors import Recorded
from ..experiment import Experiment
from ._candidates import Candidates


class Rules(NamedTuple):
    """What a placement must keep to.

    Parameters
    ----------
    forbidden
        Regions in which nothing may be recorded: low and high corner [m], numbers on a line.
    least_distance
        Least distance [m] between recorded places of sensors, and of actuators.
    """

    forbidden: Sequence[tuple[Recorded, Recorded]] = ()
    least_distance: float = 0.0

    def places(self, one: Candidates) -> np.ndarray:
        """Which candidates of a transducer are allowed."""
        where = _points(one)
        allowed = np.ones(len(where), dtype=bool)
        for low, high in self.forbidden:
            allowed &= ~np.all(
                (where >= np.atleast_1d(low)) & (where <= np.atleast_1d(high)), axis=1
            )
        return allowed

    def cells(
        self, experiment: Experiment, several: Sequence[Candidates], cells: np.ndarray
    ) -> np.ndarray:
        """Which combinations of candidates [cell, transducer] are allowed.

        Raises
        ------
        ValueError
            If none is.
        """
        allowed = np.ones(len(cells), dtype=bool)
        for one, chosen in zip(several, cells.T, strict=True):
            allowed &= self.places(one)[chosen]
        where = {one.name: _points(one)[own] for one, own in zip(several, cells.T, strict=True)}
        for side in (experiment.sensor, experiment.actuator):
            allowed &= self._far(side, where, len(cells))
        if not allowed.any():
            raise ValueError(
                f"None of {len(cells)} placements is allowed: forbidden regions "
                f"{list(self.forbidden)} m, least distance {self.least_distance:g} m. Give more "
                "places to try, or fewer rules."
            )
        return allowed

    def _far(
        self, side: Mapping[str, Any], where: Mapping[str, np.ndarray], count: int
    ) -> np.ndarray:
        """Whether the transducers of one side are far enough from each other."""
        several = [
            where.get(name, np.tile(np.atleast_1d(one.recorded), (count, 1)))
            for name, one in side.items()
        ]
        far = np.ones(count, dtype=bool)
        for number, one in enumerate(several):
            for other in several[:number]:
                far &= np.linalg.norm(one - other, axis=1) >= self.least_distance
        return far


def _points(one: Candidates) -> np.ndarray:
    """Recorded places [candidate, coordinate]."""
    return one.recorded.reshape(len(one.laws), -1)
