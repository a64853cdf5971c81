"""Sequential search: one transducer is moved after the other, until no move improves the gain."""

from collections.abc import Iterator, Sequence

import equinox as eqx
import numpy as np

from ..._shared.arguments import check_count
from .._candidates import Candidates, present_position
from ..running.evaluation import Evaluation
from ._search_space import SearchSpace, Selection, gain_in_one_shape
from .placement_rules import PlacementRules
from .strategy import Search, Trials, recorded, trials_of_selections


class Sequential(Search):
    """One transducer at a time, with the others in place, until no move improves the gain.

    It begins with the positions that the experiment states. For n transducers with m places each
    it takes n m evaluations a round instead of m^n, and may end at a local maximum.

    Parameters
    ----------
    rounds
        Rounds, at most.

    Examples
    --------
    >>> bp.design.Sequential(rounds=3)
    Sequential(rounds=3)
    """

    rounds: int = eqx.field(static=True, default=5)

    def __check_init__(self) -> None:
        check_count("rounds", self.rounds, 1, "design.Sequential(rounds=5)")

    def trials(self, space: SearchSpace) -> Trials:
        """Try the places of one transducer after the other."""
        candidates = space.candidates()

        def move_each(evaluation: Evaluation, selection: Selection) -> Trials:
            moved = [transducer for transducer in candidates if transducer.name in selection]
            steps = self._steps(evaluation, moved, space.rules)
            return Trials.joined([Trials.none(evaluation), *steps])

        return trials_of_selections(space, space.groups(candidates), move_each)

    def _steps(
        self, evaluation: Evaluation, moved: Sequence[Candidates], rules: PlacementRules
    ) -> Iterator[Trials]:
        counts = np.array([len(transducer.positions) for transducer in moved])
        # The stated position comes last: the search starts there, but it is no candidate.
        extended = [
            transducer.followed_by(present_position(evaluation.experiment, transducer.name))
            for transducer in moved
        ]
        current = counts.copy()
        for round_number in range(self.rounds):
            before = current.copy()
            for column in range(len(moved)):
                step = evaluation.part(round_number * len(moved) + column, self.rounds * len(moved))
                cells = _cells_of_column(current, column, counts)
                cells = _allowed(rules, evaluation, extended, cells, counts)
                if not len(cells):
                    return
                gain = gain_in_one_shape(step, extended, cells, int(counts.max()))
                current = cells[np.argmax(gain[:, 0])]
                if np.all(current < counts):
                    yield Trials.of(recorded(extended, cells), gain)
                else:
                    yield Trials.none(evaluation)._replace(evaluations=len(cells))
            if np.array_equal(current, before):
                return


def _cells_of_column(current: np.ndarray, column: int, counts: np.ndarray) -> np.ndarray:
    """All places of one transducer, with the others in place [cell, transducer]."""
    cells = np.repeat(current[None], counts[column], axis=0)
    cells[:, column] = np.arange(counts[column])
    return cells


def _allowed(
    rules: PlacementRules,
    evaluation: Evaluation,
    extended: Sequence[Candidates],
    cells: np.ndarray,
    counts: np.ndarray,
) -> np.ndarray:
    """Allowed cells; transducers that were not moved yet are ignored, since they will be."""
    decided = np.flatnonzero(np.min(cells < counts, axis=0))
    moved = [extended[int(column)] for column in decided]
    all_names = {transducer.name for transducer in extended}
    undecided = all_names - {transducer.name for transducer in moved}
    allowed = rules.allowed_cells(evaluation.experiment, moved, cells[:, decided], undecided)
    return cells[allowed]
