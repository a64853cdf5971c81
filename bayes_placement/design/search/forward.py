"""forward: in, lists of places; out, those tried by placing one transducer after the other.

Not known here: how information is estimated.
"""

import itertools
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .._candidates import Candidates
from ..running._cells import grid
from ..running._evaluation import Evaluation
from ._offer import Crew, Offer, as_it_is, part
from .search import Search, Tried, nothing, recorded


class _Step(NamedTuple):
    """What was tried by adding some transducers, and the best of it.

    Parameters
    ----------
    tried
        Placements with these.
    cell
        Who is placed, at which of its places.
    net
        What that teaches less what it costs [nat].
    """

    tried: Tried
    cell: Mapping[str, int]
    net: float


class Forward(Search):
    """Forward sequential placement: one transducer after the other, where it teaches most.

    It begins without those to be placed, adds the one that teaches most, then, those before kept
    where they are, the next (Papadimitriou 2004, DOI 10.1177/1077546304041768). A sensor and an
    actuator without which nothing can be measured are placed together. What has a cost comes last,
    and only while it teaches more than it costs. For n sensors alike and m places it takes n m
    evaluations, and may end at a local maximum.
    """

    def tried(self, offer: Offer) -> Tried:
        """Add one transducer after the other.

        Raises
        ------
        ValueError
            If none is allowed.
        """
        several = {one.name: one for one in offer.lists()}
        groups = offer.groups(list(several.values()))
        now = _begin(offer)
        found = [now.tried]
        while options := _options(offer, groups, now.cell):
            steps = [
                _added(_evaluation(offer, now.cell, options, number), offer, several, now, added)
                for number, added in enumerate(options)
            ]
            found += [step.tried for step in steps]
            best = max(steps, key=lambda step: step.net)
            if _may_stop(offer, now.cell) and best.net <= now.net:
                break
            if not best.cell:
                raise offer.rules.none_of()
            now = best
        return Tried.joined(found)


def _begin(offer: Offer) -> _Step:
    """What those that are mounted teach, where that may be all."""
    if not _may_stop(offer, ()):
        return _Step(nothing(offer.evaluation), {}, -np.inf)
    found = as_it_is(offer.of(()))
    return _Step(Tried.of([{}], found), {}, float(found[0, 0]))


def _may_stop(offer: Offer, placed: Collection[str]) -> bool:
    """Whether those placed can measure, and all others may stay away."""
    return offer.is_measurable(placed) and set(offer.places) <= {*offer.cost, *placed}


def _options(offer: Offer, groups: Sequence[Crew], placed: Collection[str]) -> list[Crew]:
    """What may be added: one of those alike, first what must be there."""
    left = [
        next(one for one in group if one not in placed)
        for group in groups
        if not set(group) <= set(placed)
    ]
    sides = (offer.experiment.sensor, offer.experiment.actuator)
    there = {*offer.mounted, *placed}
    lacking = [
        _first([one for one in left if one in side], offer)
        for side in sides
        if not there & set(side)
    ]
    if lacking:
        return list(itertools.product(*lacking))
    return [(one,) for one in _first(left, offer)]


def _first(names: Sequence[str], offer: Offer) -> Sequence[str]:
    """Those without a cost, as long as there are any."""
    return [one for one in names if one not in offer.cost] or names


def _evaluation(
    offer: Offer, placed: Collection[str], options: Sequence[Crew], number: int
) -> Evaluation:
    steps = len(offer.places)
    here = part(offer.of([*placed, *options[number]]), len(placed), steps)
    return part(here, number, len(options))


def _added(
    here: Evaluation,
    offer: Offer,
    several: Mapping[str, Candidates],
    now: _Step,
    added: Crew,
) -> _Step:
    """Try all places of some more, the others where they are."""
    names = [*now.cell, *added]
    there = [several[name] for name in names]
    new = grid([several[name] for name in added])
    cells = np.concatenate([np.tile([*now.cell.values()], (len(new), 1)).astype(int), new], axis=1)
    cells = cells[offer.rules.cells(here.experiment, there, cells)]
    if not len(cells):
        return _Step(nothing(here), {}, -np.inf)
    found = here.at(there, cells)
    best = int(np.argmax(found[:, 0]))
    tried = Tried.of(recorded(there, cells), found)
    if not set(offer.places) <= {*offer.cost, *names}:
        tried = nothing(here)._replace(evaluations=len(cells))
    net = float(found[best, 0]) - offer.price(names)
    return _Step(tried, dict(zip(names, map(int, cells[best]), strict=True)), net)
