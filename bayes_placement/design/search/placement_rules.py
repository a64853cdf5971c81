"""Which placements are allowed: forbidden regions, and distances between transducers."""

import itertools
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..._shared.errors import InputError
from ...experiment.experiment import Experiment
from ...experiment.transducers import Transducer
from ...positions.bounds import bounds_text, in_space
from ...positions.vectors import Recorded
from .._candidates import Candidates

RecordedPositions = Mapping[str, np.ndarray]
"""Recorded positions [placement, coordinate] of transducers [m], by name."""


LEAST_SHARE = 0.01
"""Least distance over the greatest extent of the structure, where none is given."""


class PlacementRules(NamedTuple):
    """Rules for placements: forbidden regions and a least distance."""

    forbidden: Sequence[tuple[Recorded, Recorded]] = ()
    """Regions in which nothing may be recorded: low and high corner [m], numbers on a line."""
    least_distance: float | None = None
    """Least distance [m] between recorded positions of sensors, and of actuators, of which one is
    moved; None for 1 % of the greatest extent of the structure."""
    least_between: float = 0.0
    """Least distance [m] between a sensor and an actuator of which one is moved."""

    def checked(self, experiment: Experiment) -> "PlacementRules":
        """Return the rules, the distance with its default, after a check that they fit."""
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
        low, high = experiment.structure.modes.bounds()
        for first, last in self.forbidden:
            if np.any(np.greater(first, high)) or np.any(np.less(last, low)):
                raise InputError(
                    f"The forbidden region {first} to {last} m was given, which lies outside the "
                    f"structure ({bounds_text((low, high))}); a part of it is needed, since "
                    "nothing is placed elsewhere. Give it in metres: forbidden=[(0.2, 0.3)]."
                )
        small = LEAST_SHARE * float(np.max(np.subtract(high, low)))
        if self.least_distance is None:
            return self._replace(least_distance=small, least_between=small)
        if not self.least_distance >= 0:
            raise InputError(
                f"least_distance={self.least_distance:g} was given; a distance [m] that is not "
                "negative is needed: least_distance=0.05."
            )
        return self._replace(least_between=min(small, self.least_distance))

    def allowed(
        self, experiment: Experiment, positions: RecordedPositions, undecided: Collection[str] = ()
    ) -> np.ndarray:
        """Which placements are allowed [placement].

        Other transducers stay where they are in the experiment; undecided ones have no place yet
        and do not count.
        """
        count = len(next(iter(positions.values())))
        allowed = np.ones(count, dtype=bool)
        for points in positions.values():
            allowed &= ~self.in_forbidden(points)
        both = {**experiment.sensor, **experiment.actuator}
        decided = {name: both[name] for name in both if name not in undecided}
        return allowed & self._separated(decided, positions, count)

    def allowed_cells(
        self,
        experiment: Experiment,
        moved: Sequence[Candidates],
        cells: np.ndarray,
        undecided: Collection[str] = (),
    ) -> np.ndarray:
        """Which combinations of candidates [cell, transducer] are allowed [cell]."""
        columns = zip(moved, cells.T, strict=True)
        positions = {transducer.name: transducer.points()[column] for transducer, column in columns}
        return self.allowed(experiment, positions, undecided)

    def none_allowed(self) -> InputError:
        """Error that no placement is allowed."""
        return InputError(
            f"None of the placements is allowed: forbidden regions {list(self.forbidden)} m, least "
            f"distance {self.least_distance or 0.0:g} m. Give more places to try, or fewer rules."
        )

    def in_forbidden(self, points: np.ndarray) -> np.ndarray:
        """Which points [point, coordinate] are in a forbidden region [point]."""
        inside = np.zeros(len(points), dtype=bool)
        for low, high in self.forbidden:
            corners = np.atleast_1d(low), np.atleast_1d(high)
            inside |= np.all((points >= corners[0]) & (points <= corners[1]), axis=1)
        return inside

    def _separated(
        self, transducers: Mapping[str, Transducer], positions: RecordedPositions, count: int
    ) -> np.ndarray:
        """Whether transducers are far enough from each other [placement].

        Two that are mounted already stay where they are, however close.
        """
        points = {
            name: positions.get(name, np.tile(np.atleast_1d(transducer.recorded), (count, 1)))
            for name, transducer in transducers.items()
        }
        separated = np.ones(count, dtype=bool)
        for first, second in itertools.combinations(points, 2):
            if first in positions or second in positions:
                distance = np.linalg.norm(points[first] - points[second], axis=1)
                alike = transducers[first].kind == transducers[second].kind
                least = (self.least_distance or 0.0) if alike else self.least_between
                separated &= distance >= least
        return separated
