"""An effect on a hypothesis at the channels that it changes: all other residuals stay as they are.

So that what a scan costs is the same whatever the number of channels. All transducers have one name
there, so that one compiled function serves all.
"""

import math
from collections import OrderedDict
from collections.abc import Collection
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float

from ...effects.effect import Effect
from ...effects.instrument_effect import Alone, InstrumentEffect
from ...experiment.experiment import Experiment
from ...experiment.transducers import Transducer
from ...experiment.variants import channel_numbers, with_only
from ...inference.residuals import Problem, fields_of
from ..screening_lines import Thinned, at_screening_lines
from ._hypotheses import Hypothesis
from ._linear import ALL, Some


@dataclass(frozen=True, eq=False)
class EffectAtData:
    """An effect on a hypothesis, at the data that it changes.

    The problem has it there; `evaluated` is the same, or at some of its lines. The point is the fit
    without it, in the coordinates of the problem, `columns` its unknowns among these. `data` are
    numbers of the data among those of the hypothesis, each with its weight.
    """

    problem: Problem
    evaluated: Problem | Thinned
    point: np.ndarray
    columns: np.ndarray
    data: Some
    weight: float = 1.0

    def points(self, own: np.ndarray) -> np.ndarray:
        """Coordinates [point, unknown] from those of the effect alone."""
        points = np.repeat(self.point[None], len(own), axis=0)
        points[:, self.columns] = own
        return points

    def logarithmic(self, own: np.ndarray) -> np.ndarray:
        """Logarithmic residuals [point, datum] at coordinates of the effect."""
        residual, _ = self.evaluated.squares.residuals(self.points(own), True)
        residual *= self.weight
        return residual

    def with_solved(self, own: np.ndarray, name: str) -> np.ndarray:
        """Coordinates of the effect with the strengths at which each pair of channels fits best.

        The unknown has one for each pair, in which FRFs of that pair are linear.
        """
        place = self.problem.coordinates.places[name]
        chosen = np.isin(self.columns, np.arange(place.start, place.stop))
        without, with_one = (
            self._of_pairs(np.where(chosen, strength, own)) for strength in (0.0, 1.0)
        )
        change = with_one - without
        pull, squares = (np.einsum("psad,psad->psa", change, each) for each in (without, change))
        solved = own.copy()
        solved[:, chosen] = (-pull / (1 + squares)).reshape(len(own), -1)
        return solved

    def _of_pairs(self, own: np.ndarray) -> Float[np.ndarray, "point sensor actuator datum"]:
        """Residuals of the state that the effect is in, of all force levels in one."""
        shape = np.shape(self.evaluated.problem.data.z)
        residual, _ = self.evaluated.squares.residuals(self.points(own))
        return residual[:, : math.prod(shape)].reshape(len(own), *shape[:2], -1)


def own_columns(effect: Effect, problem: Problem) -> np.ndarray:
    """Places of the unknowns of an effect among the coordinates of a problem that has it."""
    places = [problem.coordinates.places[name] for name in fields_of(effect, problem)]
    return np.concatenate(
        [np.zeros(0, dtype=int), *(np.arange(place.start, place.stop) for place in places)]
    )


def at_all_lines(base: Hypothesis, effect: Effect) -> EffectAtData:
    """An effect at all lines of the channels that it changes."""
    alone = _alone(base.problem, effect)
    if alone is None:
        problem = base.problem.with_effect(effect)
        return EffectAtData(
            problem, problem, base.point_in(problem), own_columns(effect, problem), ALL
        )
    return _of_channels(base, base.problem, alone)


def at_lines_of_scans(base: Hypothesis, effect: Effect) -> EffectAtData:
    """An effect at the lines of scans of the channels that it changes."""
    alone = _alone(base.problem, effect)
    if alone is None:
        whole = at_all_lines(base, effect)
        return replace(whole, evaluated=at_screening_lines(whole.problem))
    screened = at_screening_lines(base.problem)
    if isinstance(screened, Problem):
        return _of_channels(base, screened, alone)
    part = _of_channels(base, screened.problem, alone)
    return replace(part, weight=float(screened.weight[0]))


def data_changed(base: Hypothesis, effect: Effect) -> np.ndarray | None:
    """Numbers of the data of the few channels that an effect changes; None of all."""
    alone = _alone(base.problem, effect)
    return None if alone is None else data_of(base.problem, alone.side, alone.names)


def data_of(problem: Problem, side: str, names: Collection[str]) -> np.ndarray:
    """Numbers of the data of some transducers of a side."""
    rows = channel_numbers(getattr(problem.experiment, side), names)
    numbers = np.arange(problem.data.z.size).reshape(problem.data.z.shape)
    return np.take(numbers, rows, axis=("sensor", "actuator").index(side)).ravel()


def _alone(problem: Problem, effect: Effect) -> Alone | None:
    """An effect as of an experiment with the transducers alone that it changes; None of all.

    Of these the responses stay the same without the others: where nothing on the instruments loads
    the structure, and no errors of it are shared.
    """
    experiment = problem.experiment
    is_shared = experiment.instrument_effects or experiment.model_error or problem.baseline
    if is_shared or experiment.observe.is_modal or not isinstance(effect, InstrumentEffect):
        return None
    return None if effect.loads else effect.alone(experiment.instruments)


def _of_channels(base: Hypothesis, problem: Problem, alone: Alone) -> EffectAtData:
    """The effect on a problem of the base, at its channels."""
    experiment, keyword = problem.experiment, f"{alone.side}s"
    rows = channel_numbers(getattr(experiment, alone.side), alone.names)
    fewer = _named_by_number(with_only(experiment, **{keyword: alone.names}), alone.side)
    apart = Problem(fewer + alone.effect, problem.data.of(**{keyword: rows}))
    point, columns = _point(base, apart, alone), own_columns(alone.effect, apart)
    return EffectAtData(apart, apart, point, columns, data_of(problem, alone.side, alone.names))


def _named_by_number(experiment: Experiment, side: str) -> Experiment:
    """The experiment, its transducers of a side named 0, 1 and so on, and recorded nowhere."""

    def named(number: int, transducer: Transducer) -> Transducer:
        nowhere = jax.tree.map(lambda _: 0.0, transducer.recorded)
        return transducer.like(str(number), transducer.position, nowhere)

    transducers = getattr(experiment, side).values()
    by_number = OrderedDict((str(n), named(n, each)) for n, each in enumerate(transducers))
    return eqx.tree_at(
        lambda tree: getattr(tree, side),
        experiment,
        by_number,
        is_leaf=lambda leaf: isinstance(leaf, dict),
    )


def _point(base: Hypothesis, apart: Problem, alone: Alone) -> np.ndarray:
    """The fit in the coordinates of the problem of few transducers; zero what it does not have."""
    places, point = base.problem.coordinates.places, np.zeros(apart.dimension)
    for name, place in apart.coordinates.places.items():
        owner, _, rest = name.partition(".")
        number, _, field = rest.partition(".")
        before = f"{owner}.{alone.names[int(number)]}.{field}" if owner == alone.side else name
        if before in places:
            point[place] = base.fit.point[places[before]]
    return point
