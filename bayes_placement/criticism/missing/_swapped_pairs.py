"""Which transducers of a side may have been swapped: the cost of all pairs at once.

Of a swapped pair the record of each is compared with the response of the other. So the cost is a
sum of two terms, each of one record and one response, and what all other unknowns absorb of these:
the number that a scan gives, without one evaluation of the model.
"""

from collections import defaultdict
from collections.abc import Sequence
from typing import TypeGuard

import numpy as np
from jaxtyping import Float, Int

from ...effects.effect import Effect
from ...effects.library import kind_of
from ...effects.swapped import Swapped
from ...experiment.observe import Complex
from ...inference.output_residuals import LOGARITHMIC_ERROR
from ...inference.residuals import Problem
from ..screening_lines import at_screening_lines
from ._at_channels import data_of
from ._hypotheses import Hypothesis, linear_logarithmic


def likeliest(base: Hypothesis, effects: Sequence[Effect], most: int) -> list[Effect]:
    """Return effects, of each kind of swapped pairs those alone that leave least, so many.

    All, where records have gaps or are no complex FRFs.
    """
    screened = at_screening_lines(base.problem)
    problem = screened if isinstance(screened, Problem) else screened.problem
    if not isinstance(problem.experiment.observe, Complex) or not problem.data.measured.all():
        return list(effects)
    swaps = defaultdict(list)
    for effect in effects:
        if is_swap(effect):
            swaps[kind_of(effect)].append(effect)
    kept = [
        id(of_kind[place])
        for of_kind in swaps.values()
        for place in np.argsort(_costs(base, problem, of_kind), kind="stable")[:most]
    ]
    return [effect for effect in effects if not is_swap(effect) or id(effect) in kept]


def is_swap(effect: Effect) -> TypeGuard[Swapped]:
    """Whether it swaps two transducers, all of their records."""
    return isinstance(effect, Swapped) and getattr(effect, effect.absent[0]) == 1.0


def _costs(base: Hypothesis, problem: Problem, swaps: Sequence[Swapped]) -> np.ndarray:
    """Cost of each of the pairs of one side, once all else is fitted."""
    side, instruments = swaps[0].side, problem.experiment.instruments
    names = [*instruments.side(side)]
    by_count = defaultdict(list)
    for number, transducer in enumerate(instruments.side(side).values()):
        by_count[len(transducer.channels)].append(number)
    costs = np.full((len(names), len(names)), np.inf)
    for numbers in by_count.values():
        data = np.stack([data_of(problem, side, (names[number],)) for number in numbers])
        costs[np.ix_(numbers, numbers)] = costs_of_pairs(base, problem, data)
    pairs = [[instruments.number(each, side) for each in effect.pair] for effect in swaps]
    first, second = np.array(pairs).T
    return costs[first, second]


def costs_of_pairs(
    base: Hypothesis, problem: Problem, data: Int[np.ndarray, "transducer number"]
) -> Float[np.ndarray, "transducer transducer"]:
    """Cost of each pair, the data of each in the same order.

    The problem is that of the hypothesis at the lines of scans; numbers are those of the data of
    each transducer.
    """
    linear = linear_logarithmic(base)
    parts = np.moveaxis(np.asarray(problem.data.z), -2, 0)
    logs = np.stack([0.5 * np.log(np.sum(parts**2, axis=0)), np.arctan2(*parts[::-1])], axis=-2)
    before, logs = linear.residual[data], logs.ravel()[data]
    weight = np.sqrt(base.problem.count / problem.count)  # of a line that stands for several
    is_angle = (np.indices(problem.data.z.shape)[-2] == 1).ravel()[data[0]]
    squares = np.empty((len(data), len(data)))
    pulls = np.empty((len(data), len(data), len(linear.slopes)))
    for number, own in enumerate(data):
        ratio = LOGARITHMIC_ERROR / weight * before + logs - logs[number]
        ratio = np.where(is_angle, np.angle(np.exp(1j * ratio)), ratio)
        swapped = weight / LOGARITHMIC_ERROR * ratio
        squares[number] = np.sum(swapped**2 - before[number] ** 2, axis=1)
        pulls[number] = (swapped - before[number]) @ linear.slopes[:, own].T
    return linear.cost_with(squares + squares.T, pulls + pulls.swapaxes(0, 1))
