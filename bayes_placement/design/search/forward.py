"""Forward sequential placement: one transducer is added after the other."""

import itertools
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import NamedTuple

import equinox as eqx
import numpy as np

from ..._shared.arguments import check_count
from .._candidates import Candidates, combinations, present_position
from ..running.evaluation import Evaluation
from . import Search, Trials, recorded, trials_of_selections
from ._search_space import (
    Group,
    PlacementRules,
    SearchSpace,
    Selection,
    gain_as_mounted,
    gain_in_one_shape,
)


class _Step(NamedTuple):
    """Trials with some added transducers, and the best of them."""

    trials: Trials
    """Placements with all of these transducers."""
    cell: Mapping[str, int]
    """Candidate of each transducer that is placed, by name."""
    net_gain: float
    """Information gain there less the cost [nat]."""


class Forward(Search):
    """Forward sequential placement: one transducer after the other, where its gain is greatest.

    It begins without the transducers to be placed, adds that of the greatest information gain,
    then, with the earlier ones kept in place, the next (Papadimitriou 2004, DOI
    10.1177/1077546304041768). A sensor and an actuator without which nothing can be measured are
    placed together. Transducers with a cost come last, and only while they add more than they cost.
    For n equal sensors and m places it takes n m evaluations, and may end at a local maximum.

    Examples
    --------
    >>> search = bp.design.Forward()
    >>> bp.place(experiment, places, search=search, estimator=estimator).search
    'Forward'
    """

    def trials(self, space: SearchSpace) -> Trials:
        """Add one transducer after the other."""
        candidates = {transducer.name: transducer for transducer in space.candidates()}
        groups = space.groups(list(candidates.values()))
        current = _as_mounted(space)
        trials = [current.trials]
        while options := _options(space, groups, current.cell):
            evaluations = _evaluations(space, current.cell, options)
            steps = [
                _added(evaluation, space, candidates, current, added)
                for evaluation, added in zip(evaluations, options, strict=True)
            ]
            trials += [step.trials for step in steps]
            best = max(steps, key=lambda step: step.net_gain)
            if _may_stop(space, current.cell) and best.net_gain <= current.net_gain:
                break
            if not best.cell:
                raise space.rules.none_allowed()
            current = best
        return Trials.joined(trials)


def _as_mounted(space: SearchSpace) -> _Step:
    """Information gain of the mounted transducers, if no other need be placed."""
    if not _may_stop(space, ()):
        return _Step(Trials.none(space.evaluation), {}, -np.inf)
    gain = gain_as_mounted(space.evaluation_of(()))
    return _Step(Trials.of([{}], gain), {}, float(gain[0, 0]))


def _may_stop(space: SearchSpace, placed: Collection[str]) -> bool:
    """Whether the placed transducers can measure, and all others may be left out."""
    return space.can_measure(placed) and set(space.places) <= {*space.cost, *placed}


def _options(
    space: SearchSpace, groups: Sequence[Group], placed: Collection[str]
) -> list[Selection]:
    """Transducers that may be added next, one of each group; first those needed to measure."""
    remaining = [
        next(name for name in group if name not in placed)
        for group in groups
        if not set(group) <= set(placed)
    ]
    present = {*space.mounted, *placed}
    lacking = [
        _without_cost_first([name for name in remaining if name in side], space)
        for side in (space.experiment.sensor, space.experiment.actuator)
        if not present & set(side)
    ]
    if lacking:
        return list(itertools.product(*lacking))
    return [(name,) for name in _without_cost_first(remaining, space)]


def _without_cost_first(names: Sequence[str], space: SearchSpace) -> Sequence[str]:
    """Transducers without a cost, as long as there are any."""
    return [name for name in names if name not in space.cost] or names


def _evaluations(
    space: SearchSpace, placed: Collection[str], options: Sequence[Selection]
) -> Iterator[Evaluation]:
    """Evaluation of each option, with its part of the progress."""
    for number, added in enumerate(options):
        evaluation = space.evaluation_of([*placed, *added])
        yield evaluation.part(len(placed), len(space.places)).part(number, len(options))


def _added(
    evaluation: Evaluation,
    space: SearchSpace,
    candidates: Mapping[str, Candidates],
    current: _Step,
    added: Selection,
) -> _Step:
    """Try all places of some added transducers, with the others in place."""
    names = [*current.cell, *added]
    moved = [candidates[name] for name in names]
    new = combinations([candidates[name] for name in added])
    previous = np.tile([*current.cell.values()], (len(new), 1)).astype(int)
    cells = np.concatenate([previous, new], axis=1)
    cells = cells[space.rules.allowed_cells(evaluation.experiment, moved, cells)]
    if not len(cells):
        return _Step(Trials.none(evaluation), {}, -np.inf)
    gain = evaluation.at(moved, cells)
    best = int(np.argmax(gain[:, 0]))
    trials = Trials.of(recorded(moved, cells), gain)
    if not set(space.places) <= {*space.cost, *names}:
        trials = Trials.none(evaluation)._replace(evaluations=len(cells))
    net_gain = float(gain[best, 0]) - space.price(names)
    return _Step(trials, dict(zip(names, map(int, cells[best]), strict=True)), net_gain)


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
