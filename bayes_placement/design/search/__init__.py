"""search: strategies to find the best placement, their interface, and the simplest of them."""

import abc
from collections.abc import Callable, Sequence
from typing import NamedTuple

import equinox as eqx
import numpy as np

from ..._shared.reprs import with_short_repr
from .._candidates import Candidates, Recordings, combinations
from ..running.evaluation import Evaluation
from ._search_space import Group, SearchSpace, Selection, gain_as_mounted


class Trials(NamedTuple):
    """Placements that were tried."""

    positions: list[Recordings]
    """Recorded positions [placement]."""
    gain: np.ndarray
    """Information gain [placement, 1 + replicate] [nat]: the estimate, then without each
    replicate."""
    near_best: np.ndarray
    """Which placements are next to the best one [placement]."""
    evaluations: int
    """Number of placements that were evaluated, intermediate ones included."""

    @staticmethod
    def of(positions: list[Recordings], gain: np.ndarray) -> "Trials":
        """Trials of placements that are not next to each other."""
        return Trials(positions, gain, np.zeros(len(positions), dtype=bool), len(positions))

    @staticmethod
    def none(evaluation: Evaluation) -> "Trials":
        """No placement at all."""
        return Trials.of([], np.zeros((0, 1 + evaluation.estimator.replicates)))

    @staticmethod
    def joined(batches: Sequence["Trials"]) -> "Trials":
        """All trials as one."""
        return Trials(
            [positions for trials in batches for positions in trials.positions],
            np.concatenate([trials.gain for trials in batches]),
            np.concatenate([trials.near_best for trials in batches]),
            sum(trials.evaluations for trials in batches),
        )

    def distinct(self) -> "Trials":
        """Each placement once."""
        rows = [
            tuple((name, *np.ravel(at).tolist()) for name, at in positions.items())
            for positions in self.positions
        ]
        first = sorted({row: number for number, row in reversed(list(enumerate(rows)))}.values())
        positions = [self.positions[number] for number in first]
        return Trials(positions, self.gain[first], self.near_best[first], self.evaluations)


@with_short_repr
class Search(eqx.Module):
    """A way to search for the best placement."""

    @abc.abstractmethod
    def trials(self, space: SearchSpace) -> Trials:
        """Try placements.

        Raises
        ------
        InputError
            If none is allowed.
        """


def trials_of_selections(
    space: SearchSpace, groups: Sequence[Group], search: Callable[[Evaluation, Selection], Trials]
) -> Trials:
    """Search with each selection of transducers separately."""
    selections = space.selections(groups)
    batches = []
    for number, selection in enumerate(selections):
        evaluation = space.evaluation_of(selection).part(number, len(selections))
        if selection:
            batches.append(search(evaluation, selection))
        else:
            batches.append(Trials.of([{}], gain_as_mounted(evaluation)))
    trials = Trials.joined(batches)
    if not trials.positions:
        raise space.rules.none_allowed()
    return trials


def recorded(moved: Sequence[Candidates], cells: np.ndarray) -> list[Recordings]:
    """Recorded position of each transducer at combinations of candidates [cell, transducer]."""
    return [
        {
            transducer.name: transducer.recorded[number]
            for transducer, number in zip(moved, cell, strict=True)
        }
        for cell in cells
    ]


def without_exchanges(
    groups: Sequence[Group], moved: Sequence[Candidates], cells: np.ndarray
) -> np.ndarray:
    """Cells with exchangeable transducers in one order only."""
    column = {transducer.name: number for number, transducer in enumerate(moved)}
    ordered = np.ones(len(cells), dtype=bool)
    for group in groups:
        exchangeable = cells[:, [column[name] for name in group if name in column]]
        ordered &= np.all(np.diff(exchangeable, axis=1) >= 0, axis=1)
    return cells[ordered]


class Exhaustive(Search):
    """All combinations of the places to try; exchangeable sensors are not tried twice.

    Examples
    --------
    >>> search = bp.design.Exhaustive()
    >>> bp.place(experiment, places, search=search, estimator=estimator).search
    'Exhaustive'
    """

    def trials(self, space: SearchSpace) -> Trials:
        """Try all allowed combinations."""
        candidates = space.candidates()
        groups = space.groups(candidates)

        def try_combinations(evaluation: Evaluation, selection: Selection) -> Trials:
            moved = [transducer for transducer in candidates if transducer.name in selection]
            cells = without_exchanges(groups, moved, combinations(moved))
            cells = cells[space.rules.allowed_cells(evaluation.experiment, moved, cells)]
            if not len(cells):
                return Trials.none(evaluation)
            return Trials.of(recorded(moved, cells), evaluation.at(moved, cells))

        return trials_of_selections(space, groups, try_combinations)
