"""Search space of a placement: candidates, exchangeable transducers, and optional ones."""

import itertools
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import equinox as eqx
import numpy as np

from ..._shared.errors import InputError
from ...experiment.experiment import Experiment
from ...experiment.transducers import Transducer
from ...experiment.variants import channel_numbers, with_only
from ...positions.bounds import bounds_text, in_space
from ...positions.vectors import Recorded
from .._candidates import Candidates, candidates, present_position
from ..running.evaluation import Evaluation

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


Places: TypeAlias = Mapping[str, object]
"""By the name of the transducer: recorded positions [m] or tolerance regions, or one region."""

Group: TypeAlias = tuple[str, ...]
"""Names of transducers that are exchangeable: they differ in their name only."""

Selection: TypeAlias = tuple[str, ...]
"""Names of the transducers that are placed; the others are left out."""


class SearchSpace(NamedTuple):
    """Transducers to be placed, with their candidates, rules and costs."""

    evaluation: Evaluation
    """How information is estimated, of the experiment with all its transducers."""
    places: Places
    """Places to try, by the name of the transducer."""
    rules: PlacementRules
    """Rules for the placements."""
    cost: Mapping[str, float]
    """Information gain that some transducers must add to be placed [nat], by name; all others are
    always placed."""

    def checked(self) -> "SearchSpace":
        """Return the search space after a check of its rules and costs."""
        rules = self.rules.checked(self.experiment)
        for name, cost in self.cost.items():
            if name not in self.places or not cost >= 0:
                raise InputError(
                    f'A cost of {cost:g} nat of "{name}" was given; a cost that is not negative of '
                    f"a transducer to be placed ({', '.join(self.places) or 'none'}) is needed, "
                    'since it decides whether that one is placed: cost={"s1": 0.2}.'
                )
        return self._replace(rules=rules)

    @property
    def experiment(self) -> Experiment:
        """The experiment with all its transducers."""
        return self.evaluation.experiment

    @property
    def mounted(self) -> list[str]:
        """Names of the transducers that stay."""
        names = [*self.experiment.sensor, *self.experiment.actuator]
        return [name for name in names if name not in self.places]

    def candidates(self) -> list[Candidates]:
        """Candidates of each transducer."""
        return candidates(self.experiment, self.places)

    def groups(self, moved: Sequence[Candidates]) -> list[Group]:
        """Groups of exchangeable transducers among those to be placed."""
        groups: list[list[Candidates]] = []
        for transducer in moved:
            for group in groups:
                if self._exchangeable(group[0], transducer):
                    group.append(transducer)
                    break
            else:
                groups.append([transducer])
        return [tuple(transducer.name for transducer in group) for group in groups]

    def _exchangeable(self, first: Candidates, second: Candidates) -> bool:
        return (
            self.cost.get(first.name) == self.cost.get(second.name)
            and np.array_equal(first.recorded, second.recorded)
            and differ_in_name_only(self.experiment, first.name, second.name)
            and bool(eqx.tree_equal(first.positions, second.positions))
        )

    def selections(self, groups: Sequence[Group]) -> list[Selection]:
        """All selections that can measure, the largest first.

        Transducers without a cost are always placed; of exchangeable ones the first are taken.
        """
        counts = [
            range(len(group), -1, -1) if group[0] in self.cost else [len(group)] for group in groups
        ]
        selections = []
        for numbers in itertools.product(*counts):
            pairs = zip(groups, numbers, strict=True)
            chosen = {name for group, number in pairs for name in group[:number]}
            selections.append(tuple(name for name in self.places if name in chosen))
        return [selection for selection in selections if self.can_measure(selection)]

    def can_measure(self, selection: Collection[str]) -> bool:
        """Return whether a selection, with those mounted, has a sensor and an actuator."""
        present = {*self.mounted, *selection}
        sides = (self.experiment.sensor, self.experiment.actuator)
        return all(present & set(side) for side in sides)

    def evaluation_of(self, selection: Sequence[str]) -> Evaluation:
        """Evaluation of the experiment with a selection and those that are mounted."""
        names = [*self.mounted, *selection]
        present = with_only(self.experiment, sensors=names, actuators=names)
        return self.evaluation._replace(experiment=present)

    def price(self, selection: Sequence[str]) -> float:
        """Sum of the costs of a selection [nat]."""
        return float(sum(self.cost.get(name, 0.0) for name in selection))


def differ_in_name_only(experiment: Experiment, first: str, second: str) -> bool:
    """Return whether two transducers differ only in their name and place."""
    for side, word in ((experiment.sensor, "sensors"), (experiment.actuator, "actuators")):
        if first not in side or second not in side:
            continue
        noise, pair = experiment.noise, (first, second)
        levels = [noise and noise.of(**{word: channel_numbers(side, {name})}) for name in pair]
        fields = [(side[name].directions, side[name].angles) for name in pair]
        equal = eqx.tree_equal(*levels) and eqx.tree_equal(*fields)
        return bool(equal) and not experiment.instrument_effects
    return False


def gain_in_one_shape(
    evaluation: Evaluation, moved: Sequence[Candidates], cells: np.ndarray, size: int
) -> np.ndarray:
    """Information gain at combinations of candidates [cell, transducer], all calls compiled once.

    Cells are repeated up to the size, and each candidate is listed once for each cell, so that all
    calls with the same transducers differ only in values.
    """
    padded = np.concatenate([cells, np.repeat(cells[-1:], max(size - len(cells), 0), axis=0)])
    repeated = [
        transducer.subset(column) for transducer, column in zip(moved, padded.T, strict=True)
    ]
    diagonal = np.repeat(np.arange(len(padded))[:, None], len(moved), axis=1)
    return evaluation.at(repeated, diagonal)[: len(cells)]


def gain_as_mounted(evaluation: Evaluation) -> np.ndarray:
    """Information gain [1, 1 + replicate] of the experiment with all transducers as they are."""
    name = next(iter(evaluation.experiment.sensor))
    stated = present_position(evaluation.experiment, name)
    return evaluation.at([stated], np.zeros((1, 1), int))
