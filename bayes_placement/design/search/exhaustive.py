"""exhaustive: in, lists of places; out, all of their combinations.

Not known here: how information is estimated.
"""

from ..running._cells import grid
from ..running._evaluation import Evaluation
from ._offer import Crew, Offer
from .search import Search, Tried, nothing, of_each_crew, once, recorded


class Exhaustive(Search):
    """All combinations of the places given; sensors that can be exchanged are not tried twice."""

    def tried(self, offer: Offer) -> Tried:
        """Try all that are allowed.

        Raises
        ------
        ValueError
            If none is.
        """
        several = offer.lists()
        groups = offer.groups(several)

        def all_of(here: Evaluation, crew: Crew) -> Tried:
            there = [one for one in several if one.name in crew]
            cells = grid(there)
            cells = cells[once(groups, there, cells)]
            cells = cells[offer.rules.cells(here.experiment, there, cells)]
            if not len(cells):
                return nothing(here)
            return Tried.of(recorded(there, cells), here.at(there, cells))

        return of_each_crew(offer, groups, all_of)
