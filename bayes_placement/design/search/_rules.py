"""_rules: in, places to try; out, which of them, and which combinations, are allowed.

Not known here: how information is estimated, in what order placements are tried.
"""

from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..._types import InputError
from ...experiment.experiment import Experiment
from ...positions.bounds import in_space
from ...positions.vectors import Recorded
from .._candidates import Candidates

Where = Mapping[str, np.ndarray]
"""Recorded places [placement, coordinate] of transducers [m], by name."""


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

    def checked(self, experiment: Experiment) -> "Rules":
        """Return the rules, once they are known to fit the structure.

        Raises
        ------
        ValueError
            If a region has no extent or other coordinates, or the distance is negative.
        """
        coordinates = 3 if in_space(experiment.structure.modes.bounds()) else 1
        for low, high in self.forbidden:
            sizes = {np.size(low), np.size(high)}
            if sizes != {coordinates} or np.any(np.asarray(low) > np.asarray(high)):
                needed = "(0.2, 0.3)" if coordinates == 1 else "((0, 0, 0), (0.1, 0.1, 0))"
                raise InputError(
                    f"The forbidden region {low} to {high} m was given; its least and its greatest "
                    f"corner are needed, each of {coordinates} coordinates as the structure has: "
                    f"forbidden=[{needed}]."
                )
        if not self.least_distance >= 0:
            raise InputError(
                f"least_distance={self.least_distance:g} was given; a distance [m] that is not "
                "negative is needed: least_distance=0.05."
            )
        return self

    def allowed(
        self, experiment: Experiment, where: Where, away: Collection[str] = ()
    ) -> np.ndarray:
        """Which placements are allowed.

        Parameters
        ----------
        experiment
            The experiment, whose other transducers stay where they are.
        where
            Places of some of its transducers.
        away
            Those that do not count, since their place is not chosen yet.
        """
        count = len(next(iter(where.values())))
        allowed = np.ones(count, dtype=bool)
        for places in where.values():
            allowed &= ~self.in_forbidden(places)
        for side in (experiment.sensor, experiment.actuator):
            there = {name: one for name, one in side.items() if name not in away}
            allowed &= self._far(there, where, count)
        return allowed

    def cells(
        self,
        experiment: Experiment,
        several: Sequence[Candidates],
        cells: np.ndarray,
        away: Collection[str] = (),
    ) -> np.ndarray:
        """Which combinations of candidates [cell, transducer] are allowed."""
        where = {one.name: one.points()[own] for one, own in zip(several, cells.T, strict=True)}
        return self.allowed(experiment, where, away)

    def none_of(self) -> InputError:
        """Error that no placement is allowed."""
        return InputError(
            f"None of the placements is allowed: forbidden regions {list(self.forbidden)} m, least "
            f"distance {self.least_distance:g} m. Give more places to try, or fewer rules."
        )

    def in_forbidden(self, where: np.ndarray) -> np.ndarray:
        """Which places [place, coordinate] are in a forbidden region."""
        found = np.zeros(len(where), dtype=bool)
        for low, high in self.forbidden:
            found |= np.all((where >= np.atleast_1d(low)) & (where <= np.atleast_1d(high)), axis=1)
        return found

    def _far(self, side: Mapping[str, Any], where: Where, count: int) -> np.ndarray:
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
