"""Search space of a placement: candidates, exchangeable transducers, and optional ones."""

import itertools
from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import equinox as eqx
import numpy as np

from ..._shared.errors import InputError
from ...experiment.experiment import Experiment
from ...experiment.variants import channel_numbers, with_only
from .._candidates import Candidates, candidates, present_position
from ..running.evaluation import Evaluation
from .placement_rules import PlacementRules

Places: TypeAlias = Mapping[str, object]
"""By the name of the transducer: recorded positions [m] or tolerance regions, or one region."""

Group: TypeAlias = tuple[str, ...]
"""Names of transducers that are exchangeable: they differ in their name only."""

Selection: TypeAlias = tuple[str, ...]
"""Names of the transducers that are placed; the others are left out."""


class SearchSpace(NamedTuple):
    """Transducers to be placed, with their candidates, rules and costs."""

    evaluation: Evaluation
    """How information is estimated, of the experiment with all its transducers."""
    places: Places
    """Places to try, by the name of the transducer."""
    rules: PlacementRules
    """Rules for the placements."""
    cost: Mapping[str, float]
    """Information gain that some transducers must add to be placed [nat], by name; all others are
    always placed."""

    def checked(self) -> "SearchSpace":
        """Return the search space after a check of its rules and costs."""
        rules = self.rules.checked(self.experiment)
        for name, cost in self.cost.items():
            if name not in self.places or not cost >= 0:
                raise InputError(
                    f'A cost of {cost:g} nat of "{name}" was given; a cost that is not negative of '
                    f"a transducer to be placed ({', '.join(self.places) or 'none'}) is needed, "
                    'since it decides whether that one is placed: cost={"s1": 0.2}.'
                )
        return self._replace(rules=rules)

    @property
    def experiment(self) -> Experiment:
        """The experiment with all its transducers."""
        return self.evaluation.experiment

    @property
    def mounted(self) -> list[str]:
        """Names of the transducers that stay."""
        names = [*self.experiment.sensor, *self.experiment.actuator]
        return [name for name in names if name not in self.places]

    def candidates(self) -> list[Candidates]:
        """Candidates of each transducer."""
        return candidates(self.experiment, self.places)

    def groups(self, moved: Sequence[Candidates]) -> list[Group]:
        """Groups of exchangeable transducers among those to be placed."""
        groups: list[list[Candidates]] = []
        for transducer in moved:
            for group in groups:
                if self._exchangeable(group[0], transducer):
                    group.append(transducer)
                    break
            else:
                groups.append([transducer])
        return [tuple(transducer.name for transducer in group) for group in groups]

    def _exchangeable(self, first: Candidates, second: Candidates) -> bool:
        return (
            self.cost.get(first.name) == self.cost.get(second.name)
            and np.array_equal(first.recorded, second.recorded)
            and differ_in_name_only(self.experiment, first.name, second.name)
            and bool(eqx.tree_equal(first.positions, second.positions))
        )

    def selections(self, groups: Sequence[Group]) -> list[Selection]:
        """All selections that can measure, the largest first.

        Transducers without a cost are always placed; of exchangeable ones the first are taken.
        """
        counts = [
            range(len(group), -1, -1) if group[0] in self.cost else [len(group)] for group in groups
        ]
        selections = []
        for numbers in itertools.product(*counts):
            pairs = zip(groups, numbers, strict=True)
            chosen = {name for group, number in pairs for name in group[:number]}
            selections.append(tuple(name for name in self.places if name in chosen))
        return [selection for selection in selections if self.can_measure(selection)]

    def can_measure(self, selection: Collection[str]) -> bool:
        """Return whether a selection, with those mounted, has a sensor and an actuator."""
        present = {*self.mounted, *selection}
        sides = (self.experiment.sensor, self.experiment.actuator)
        return all(present & set(side) for side in sides)

    def evaluation_of(self, selection: Sequence[str]) -> Evaluation:
        """Evaluation of the experiment with a selection and those that are mounted."""
        names = [*self.mounted, *selection]
        present = with_only(self.experiment, sensors=names, actuators=names)
        return self.evaluation._replace(experiment=present)

    def price(self, selection: Sequence[str]) -> float:
        """Sum of the costs of a selection [nat]."""
        return float(sum(self.cost.get(name, 0.0) for name in selection))


def differ_in_name_only(experiment: Experiment, first: str, second: str) -> bool:
    """Return whether two transducers differ only in their name and place."""
    for side, word in ((experiment.sensor, "sensors"), (experiment.actuator, "actuators")):
        if first not in side or second not in side:
            continue
        noise, pair = experiment.noise, (first, second)
        levels = [noise and noise.of(**{word: channel_numbers(side, {name})}) for name in pair]
        fields = [(side[name].directions, side[name].angles) for name in pair]
        equal = eqx.tree_equal(*levels) and eqx.tree_equal(*fields)
        return bool(equal) and not experiment.instrument_effects
    return False


def gain_in_one_shape(
    evaluation: Evaluation, moved: Sequence[Candidates], cells: np.ndarray, size: int
) -> np.ndarray:
    """Information gain at combinations of candidates [cell, transducer], all calls compiled once.

    Cells are repeated up to the size, and each candidate is listed once for each cell, so that all
    calls with the same transducers differ only in values.
    """
    padded = np.concatenate([cells, np.repeat(cells[-1:], max(size - len(cells), 0), axis=0)])
    repeated = [
        transducer.subset(column) for transducer, column in zip(moved, padded.T, strict=True)
    ]
    diagonal = np.repeat(np.arange(len(padded))[:, None], len(moved), axis=1)
    return evaluation.at(repeated, diagonal)[: len(cells)]


def gain_as_mounted(evaluation: Evaluation) -> np.ndarray:
    """Information gain [1, 1 + replicate] of the experiment with all transducers as they are."""
    name = next(iter(evaluation.experiment.sensor))
    stated = present_position(evaluation.experiment, name)
    return evaluation.at([stated], np.zeros((1, 1), int))
