"""Exhaustive search: all combinations of the places given."""

from .._candidates import combinations
from ..running.evaluation import Evaluation
from ._search_space import SearchSpace, Selection
from .strategy import Search, Trials, recorded, trials_of_selections, without_exchanges


class Exhaustive(Search):
    """All combinations of the places given; sensors that are exchangeable are not tried twice."""

    def trials(self, space: SearchSpace) -> Trials:
        """Try all that are allowed.

        Raises
        ------
        InputError
            If none is.
        """
        candidates = space.candidates()
        groups = space.groups(candidates)

        def all_combinations(evaluation: Evaluation, selection: Selection) -> Trials:
            moved = [one for one in candidates if one.name in selection]
            cells = without_exchanges(groups, moved, combinations(moved))
            cells = cells[space.rules.allowed_cells(evaluation.experiment, moved, cells)]
            if not len(cells):
                return Trials.none(evaluation)
            return Trials.of(recorded(moved, cells), evaluation.at(moved, cells))

        return trials_of_selections(space, groups, all_combinations)
