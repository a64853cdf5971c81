"""search: in, what may be placed where; out, placements that were tried and what they teach.

What all ways to search have in common. Not known here: how information is estimated.
"""

import abc
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import equinox as eqx
import numpy as np

from .._candidates import Candidates
from ..running._evaluation import Evaluation
from ._offer import Crew, Offer, as_it_is, part


class Tried(NamedTuple):
    """Placements that were tried.

    Parameters
    ----------
    places
        Recorded place of each transducer that is there [placement], by name.
    found
        Information [placement, 1 + replicate] [nat], in all and without each replicate.
    like_best
        Which of them hardly differ from the best one [placement].
    evaluations
        How many placements were evaluated on the way.
    """

    places: list[dict[str, Any]]
    found: np.ndarray
    like_best: np.ndarray
    evaluations: int

    @staticmethod
    def of(places: list[dict[str, Any]], found: np.ndarray) -> "Tried":
        """Placements all of which differ."""
        return Tried(places, found, np.zeros(len(places), dtype=bool), len(places))

    @staticmethod
    def joined(several: Sequence["Tried"]) -> "Tried":
        """All of them in one list."""
        return Tried(
            [place for one in several for place in one.places],
            np.concatenate([one.found for one in several]),
            np.concatenate([one.like_best for one in several]),
            sum(one.evaluations for one in several),
        )


class Search(eqx.Module):
    """A way to search for the best placement."""

    @abc.abstractmethod
    def tried(self, offer: Offer) -> Tried:
        """Try placements.

        Raises
        ------
        ValueError
            If none is allowed.
        """


def nothing(evaluation: Evaluation) -> Tried:
    """No placement at all."""
    return Tried.of([], np.zeros((0, 1 + evaluation.estimator.replicates)))


def of_each_crew(
    offer: Offer, groups: Sequence[Crew], one: Callable[[Evaluation, Crew], Tried]
) -> Tried:
    """Placements tried with each choice of who is there, each choice searched by itself.

    Raises
    ------
    ValueError
        If none is allowed.
    """
    crews = offer.crews(groups)
    found = []
    for number, crew in enumerate(crews):
        here = part(offer.of(crew), number, len(crews))
        found.append(one(here, crew) if crew else Tried.of([{}], as_it_is(here)))
    whole = Tried.joined(found)
    if not whole.places:
        raise offer.rules.none_of()
    return whole


def recorded(several: Sequence[Candidates], cells: np.ndarray) -> list[dict[str, Any]]:
    """Recorded place of each transducer at combinations of candidates [cell, transducer]."""
    return [
        {one.name: one.recorded[own] for one, own in zip(several, cell, strict=True)}
        for cell in cells
    ]


def once(groups: Sequence[Crew], several: Sequence[Candidates], cells: np.ndarray) -> np.ndarray:
    """Which cells are left when those that can be exchanged are not tried twice."""
    column = {one.name: number for number, one in enumerate(several)}
    kept = np.ones(len(cells), dtype=bool)
    for group in groups:
        own = cells[:, [column[name] for name in group if name in column]]
        kept &= np.all(np.diff(own, axis=1) >= 0, axis=1)
    return kept
