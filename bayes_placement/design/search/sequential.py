"""Sequential search: one transducer is moved after the other, until no move helps."""

from collections.abc import Iterator, Sequence

import equinox as eqx
import numpy as np

from .._candidates import Candidates, present_position
from ..running.evaluation import Evaluation
from ._search_space import SearchSpace, Selection, gain_in_one_shape
from .placement_rules import PlacementRules
from .strategy import Search, Trials, recorded, trials_of_selections


class Sequential(Search):
    """One transducer at a time, the others where they are, until no move helps any more.

    It begins with the positions that the experiment states. For n transducers and m places each it
    takes n m evaluations a round instead of m^n, and may end at a local maximum.

    Parameters
    ----------
    rounds
        Rounds, at most.
    """

    rounds: int = eqx.field(static=True, default=5)

    def trials(self, space: SearchSpace) -> Trials:
        """Try the places of one transducer after the other.

        Raises
        ------
        InputError
            If none is allowed.
        """
        candidates = space.candidates()

        def one_by_one(evaluation: Evaluation, selection: Selection) -> Trials:
            moved = [one for one in candidates if one.name in selection]
            steps = self._steps(evaluation, moved, space.rules)
            return Trials.joined([Trials.none(evaluation), *steps])

        return trials_of_selections(space, space.groups(candidates), one_by_one)

    def _steps(
        self, evaluation: Evaluation, moved: Sequence[Candidates], rules: PlacementRules
    ) -> Iterator[Trials]:
        counts = np.array([len(one.positions) for one in moved])
        # The stated position comes behind all others; it is where moving begins, no answer.
        extended = [
            one.followed_by(present_position(evaluation.experiment, one.name)) for one in moved
        ]
        current = counts.copy()
        for turn in range(self.rounds):
            before = current.copy()
            for column in range(len(moved)):
                step = evaluation.part(turn * len(moved) + column, self.rounds * len(moved))
                cells = _along(current, column, counts)
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


def _along(current: np.ndarray, column: int, counts: np.ndarray) -> np.ndarray:
    """All places of one transducer, the others where they are [cell, transducer]."""
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
    """Cells that are allowed; transducers that were not moved yet will be, and do not count."""
    decided = np.flatnonzero(np.min(cells < counts, axis=0))
    moved = [extended[int(column)] for column in decided]
    undecided = {one.name for one in extended} - {one.name for one in moved}
    allowed = rules.allowed_cells(evaluation.experiment, moved, cells[:, decided], undecided)
    return cells[allowed]
