"""sequential: in, lists of places; out, those tried by moving one transducer after the other.

Not known here: how information is estimated.
"""

from collections.abc import Iterator, Sequence

import equinox as eqx
import numpy as np

from .._candidates import Candidates, where_it_is
from ..running._evaluation import Evaluation
from ._offer import Crew, Offer, at_places, part
from ._rules import Rules
from .search import Search, Tried, nothing, of_each_crew, recorded


class Sequential(Search):
    """One transducer at a time, the others where they are, until nothing moves any more.

    It begins with the places that the experiment states. For n transducers and m places each it
    takes n m evaluations a round in the place of m^n, and may end at a local maximum.

    Parameters
    ----------
    rounds
        Rounds, at most.
    """

    rounds: int = eqx.field(static=True, default=5)

    def tried(self, offer: Offer) -> Tried:
        """Try the places of one transducer after the other.

        Raises
        ------
        ValueError
            If none is allowed.
        """
        several = offer.lists()

        def moved(here: Evaluation, crew: Crew) -> Tried:
            there = [one for one in several if one.name in crew]
            return Tried.joined([nothing(here), *self._moved(here, there, offer.rules)])

        return of_each_crew(offer, offer.groups(several), moved)

    def _moved(
        self, here: Evaluation, several: Sequence[Candidates], rules: Rules
    ) -> Iterator[Tried]:
        counts = np.array([len(one.laws) for one in several])
        stated = [where_it_is(here.experiment, one.name) for one in several]
        whole = [one.along_with(now) for one, now in zip(several, stated, strict=True)]
        now = counts.copy()  # where it is stated to be: behind all others
        for turn in range(self.rounds):
            before = now.copy()
            for column in range(len(several)):
                step = part(here, turn * len(several) + column, self.rounds * len(several))
                cells = _allowed(rules, here, whole, _along(now, column, counts), counts)
                if not len(cells):
                    return
                learnt = at_places(step, whole, cells, int(counts.max()))
                now = cells[np.argmax(learnt[:, 0])]
                tried = Tried.of(recorded(whole, cells), learnt)
                chosen = np.all(now < counts)
                yield tried if chosen else nothing(here)._replace(evaluations=len(cells))
            if np.array_equal(now, before):
                return


def _along(now: np.ndarray, column: int, counts: np.ndarray) -> np.ndarray:
    """All places of one transducer, the others where they are now [cell, transducer]."""
    cells = np.repeat(now[None], counts[column], axis=0)
    cells[:, column] = np.arange(counts[column])
    return cells


def _allowed(
    rules: Rules,
    here: Evaluation,
    whole: Sequence[Candidates],
    cells: np.ndarray,
    counts: np.ndarray,
) -> np.ndarray:
    """Cells that are allowed; those that were not moved yet will be, and do not count."""
    chosen = [column for column, known in enumerate(np.min(cells < counts, axis=0)) if known]
    own = [whole[column] for column in chosen]
    away = {one.name for one in whole} - {one.name for one in own}
    return cells[rules.cells(here.experiment, own, cells[:, chosen], away)]
