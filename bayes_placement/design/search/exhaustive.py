"""Exhaustive search: all combinations of the places to try."""

from .._candidates import combinations
from ..running.evaluation import Evaluation
from ._search_space import SearchSpace, Selection
from .strategy import Search, Trials, recorded, trials_of_selections, without_exchanges


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
