"""search: in, places to try; out, those that were tried and what they teach, the best among them.

Ways to search for a placement. Not known here: how information is estimated.
"""

import abc
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import equinox as eqx
import numpy as np

from ..experiment import Experiment
from ._candidates import Candidates, candidates
from ._cells import grid
from ._evaluation import Evaluation
from ._rules import Rules

Places: TypeAlias = Mapping[str, Sequence[Any] | np.ndarray]
"""Recorded positions [m] or supports to try, by the name of the transducer."""


class Tried(NamedTuple):
    """Placements that were tried.

    Parameters
    ----------
    places
        Recorded place of each transducer [placement], by name.
    found
        Information [placement, 1 + replicate] [nat], in all and without each replicate.
    """

    places: list[dict[str, Any]]
    found: np.ndarray


class Search(eqx.Module):
    """A way to search for the best placement."""

    @abc.abstractmethod
    def tried(self, evaluation: Evaluation, places: Places, rules: Rules) -> Tried:
        """Try placements.

        Raises
        ------
        ValueError
            If none is allowed.
        """


class Exhaustive(Search):
    """All combinations of the places given."""

    def tried(self, evaluation: Evaluation, places: Places, rules: Rules) -> Tried:
        """Try all that are allowed."""
        several = candidates(evaluation.experiment, places)
        cells = grid(several)
        allowed = cells[rules.cells(evaluation.experiment, several, cells)]
        return Tried(_recorded(several, allowed), evaluation.at(several, allowed))


class Sequential(Search):
    """One transducer at a time, the others where they are, until nothing moves any more.

    Papadimitriou (2004, DOI 10.1177/1077546304041768). For n transducers and m places each it
    takes about n m evaluations a round in the place of m^n, and may end at a local maximum.

    Parameters
    ----------
    rounds
        Rounds, at most.
    """

    rounds: int = eqx.field(static=True, default=5)

    def tried(self, evaluation: Evaluation, places: Places, rules: Rules) -> Tried:
        """Try the places of one transducer after the other."""
        here, whole = evaluation, Tried([], np.zeros((0, 1 + evaluation.estimator.replicates)))
        now: dict[str, int] = {}
        for _ in range(self.rounds):
            before = dict(now)
            for name, several in places.items():
                one = candidates(here.experiment, {name: several})
                cells = grid(one)
                cells = cells[rules.cells(here.experiment, one, cells)]
                found = here.at(one, cells)
                whole = _with(whole, _completed(here.experiment, one, cells, places), found)
                now[name] = int(cells[np.argmax(found[:, 0]), 0])
                here = here._replace(experiment=_moved(here.experiment, one[0], now[name], several))
            if now == before:
                break
        return whole


def _moved(experiment: Experiment, one: Candidates, place: int, several: Any) -> Experiment:
    """Return the experiment with one transducer at one of its places."""
    side = "sensor" if one.name in experiment.sensor else "actuator"
    old = getattr(experiment, side)[one.name]
    new = old.moved(several[place], experiment.structure.modes)
    return eqx.tree_at(lambda tree: getattr(tree, side)[one.name], experiment, new)


def _recorded(several: Sequence[Candidates], cells: np.ndarray) -> list[dict[str, Any]]:
    return [
        {one.name: one.recorded[own] for one, own in zip(several, cell, strict=True)}
        for cell in cells
    ]


def _completed(
    experiment: Experiment, one: Sequence[Candidates], cells: np.ndarray, names: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Placements of one transducer, with the places of the others."""
    known = {**experiment.sensor, **experiment.actuator}
    others = {name: np.asarray(known[name].recorded) for name in names}
    return [others | place for place in _recorded(one, cells)]


def _with(whole: Tried, places: list[dict[str, Any]], found: np.ndarray) -> Tried:
    return Tried([*whole.places, *places], np.concatenate([whole.found, found]))
