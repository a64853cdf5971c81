"""_offer: in, an experiment and what may be placed where; out, choices of who is there, and where.

Not known here: how information is estimated, in what order placements are tried.
"""

import itertools
from collections.abc import Collection, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import equinox as eqx
import numpy as np

from ..._types import InputError
from ...experiment.experiment import Experiment
from .. import _fewer
from .._candidates import Candidates, candidates, where_it_is
from ..running._evaluation import Evaluation
from ._rules import Rules

Places: TypeAlias = Mapping[str, Any]
"""By the name of the transducer: recorded positions [m] or supports to try, or one support."""

Crew: TypeAlias = tuple[str, ...]
"""Names of those to be placed that are there."""


class Offer(NamedTuple):
    """What may be placed where.

    Parameters
    ----------
    evaluation
        How information is estimated, of the experiment with all its transducers.
    places
        Places to try, by the name of the transducer.
    rules
        What a placement must keep to.
    cost
        What some transducers must teach to be placed [nat], by name; all others are placed.
    """

    evaluation: Evaluation
    places: Places
    rules: Rules
    cost: Mapping[str, float]

    def checked(self) -> "Offer":
        """Return the offer, once all in it is known to fit.

        Raises
        ------
        ValueError
            If a rule or a cost does not.
        """
        self.rules.checked(self.experiment)
        for name, cost in self.cost.items():
            if name not in self.places or not cost >= 0:
                raise InputError(
                    f'A cost of {cost:g} nat of "{name}" was given; a cost that is not negative of '
                    f"one of those to be placed ({', '.join(self.places)}) is needed, since it "
                    f'tells whether that one is worth placing: cost={{"{next(iter(self.places))}": '
                    "0.2}."
                )
        return self

    @property
    def experiment(self) -> Experiment:
        """The experiment with all its transducers."""
        return self.evaluation.experiment

    @property
    def mounted(self) -> list[str]:
        """Names of those that stay where they are."""
        everyone = [*self.experiment.sensor, *self.experiment.actuator]
        return [name for name in everyone if name not in self.places]

    def lists(self) -> list[Candidates]:
        """Places to try for each transducer.

        Raises
        ------
        ValueError
            If there are none, or they do not fit the structure.
        """
        return candidates(self.experiment, self.places)

    def groups(self, several: Sequence[Candidates]) -> list[Crew]:
        """Names of those to be placed, those that can be exchanged together."""
        found: list[list[Candidates]] = []
        for one in several:
            own = next((group for group in found if self._exchangeable(group[0], one)), None)
            if own is None:
                found.append([one])
            else:
                own.append(one)
        return [tuple(one.name for one in group) for group in found]

    def _exchangeable(self, one: Candidates, other: Candidates) -> bool:
        names = one.name, other.name
        costs = [self.cost.get(name) for name in names]
        return (
            costs[0] == costs[1]
            and np.array_equal(one.recorded, other.recorded)
            and _fewer.alike(self.experiment, *names)
            and bool(eqx.tree_equal(one.laws, other.laws))
        )

    def crews(self, groups: Sequence[Crew]) -> list[Crew]:
        """All choices of who is there, the fullest first; what has no cost always is.

        Of those that can be exchanged the first ones are taken.
        """
        counts = [
            range(len(group), -1, -1) if group[0] in self.cost else [len(group)] for group in groups
        ]
        found = [
            tuple(name for name in self.places if name in _first(groups, count))
            for count in itertools.product(*counts)
        ]
        return [crew for crew in found if self.is_measurable(crew)]

    def is_measurable(self, crew: Collection[str]) -> bool:
        """Tell whether there is a sensor and an actuator."""
        return _fewer.is_measurable(self.experiment, [*self.mounted, *crew])

    def of(self, crew: Sequence[str]) -> Evaluation:
        """Evaluation of the experiment with these and those that are mounted."""
        present = _fewer.with_only(self.experiment, [*self.mounted, *crew])
        return self.evaluation._replace(experiment=present)

    def price(self, crew: Sequence[str]) -> float:
        """What they must teach [nat]."""
        return float(sum(self.cost.get(name, 0.0) for name in crew))


def at_places(
    evaluation: Evaluation, several: Sequence[Candidates], cells: np.ndarray, size: int
) -> np.ndarray:
    """Information at combinations of candidates [cell, transducer], compiled once for one size.

    Cells are filled up to the size, and each candidate is given as often as there are cells, so
    that all calls with the same transducers differ in numbers only.
    """
    filled = np.concatenate([cells, np.repeat(cells[-1:], max(size - len(cells), 0), axis=0)])
    listed = [one.chosen(own) for one, own in zip(several, filled.T, strict=True)]
    diagonal = np.repeat(np.arange(len(filled))[:, None], len(several), axis=1)
    return evaluation.at(listed, diagonal)[: len(cells)]


def as_it_is(evaluation: Evaluation) -> np.ndarray:
    """Information [1, 1 + replicate] of the experiment where all stay."""
    name = next(iter(evaluation.experiment.sensor))
    return evaluation.at([where_it_is(evaluation.experiment, name)], np.zeros((1, 1), int))


def part(evaluation: Evaluation, number: int, count: int) -> Evaluation:
    """Return the evaluation, whose progress is one of several parts of the whole."""
    whole = evaluation.progress
    return evaluation._replace(progress=lambda share: whole((number + share) / count))


def _first(groups: Sequence[Crew], counts: Sequence[int]) -> set[str]:
    pairs = zip(groups, counts, strict=True)
    return {name for group, count in pairs for name in group[:count]}
