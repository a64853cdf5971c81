"""Some of many frequency lines, at which effects are screened. In a fit all of them count.

A problem comes in, the same at fewer lines goes out. What is looked for is not known here.

A scan and the descents after it find out where an effect may sit; that needs fewer data than a
verdict. A response at fewer lines is one more function to compile, which takes as long as both at
`MOST_DATA` data, so that fewer than twice as many are not thinned.
"""

import functools

import jax
import numpy as np

from ..effects.effect import take_long
from ..experiment.noise import Data
from ..experiment.variants import evenly_spread, with_effects_roughly, with_lines_at
from ..inference.engines.least_squares import LeastSquares, ParameterPoints
from ..inference.residuals import Problem
from ..inference.residuals_of_state import State

MOST_DATA = 16_384
"""Data at which effects are screened, where there are twice as many or more."""

FEWEST_LINES = 48
"""Lines of the descents after a scan where an effect takes long to evaluate."""

SAMPLE = 2000
"""Most data whose residuals are kept: they only say which effects are tried together."""


def at_screening_lines(problem: Problem) -> "Problem | Thinned":
    """Return the problem at as many lines as screening needs, or itself where these are all."""
    return _at_one_of(problem, problem.count // MOST_DATA)


def at_lines_of_descents(problem: Problem) -> "Problem | Thinned":
    """Return the problem at fewer lines where it takes long, as descents at all lines follow."""
    if not take_long(problem.experiment.effects):
        return at_screening_lines(problem)
    return at_about(problem, FEWEST_LINES)


def at_about(problem: Problem, lines: int) -> "Problem | Thinned":
    """Return the problem at so many lines or up to twice as many, or itself where it has fewer."""
    return _at_one_of(problem, max(_lines(state).size for state in problem.states) // lines)


@functools.lru_cache(maxsize=8)  # those that are scanned and compiled ahead
def _at_one_of(problem: Problem, step: int) -> "Problem | Thinned":
    return problem if step < 2 else Thinned(problem, step)


def sample(values: np.ndarray) -> np.ndarray:
    """Residuals or slopes [..., datum] of a sample of the data, evenly spread over all of them.

    Each counts for several, so that sums of products are those of all data but for the error of
    the sample.
    """
    size = values.shape[-1]
    return values if size <= SAMPLE else np.sqrt(size / SAMPLE) * at_sample(values)


def at_sample(values: np.ndarray) -> np.ndarray:
    """Values [..., datum] of the same sample, as they are."""
    size = values.shape[-1]
    return values if size <= SAMPLE else values[..., evenly_spread(size, SAMPLE)]


class Thinned:
    """A problem at some of its lines, evenly spread, each of which counts for several.

    Effects that are spread over a part have fewer ports.

    Its sums of squares, and its sums of logs, are those of the whole problem but for the error of
    the sample. States that observe modes keep them all.

    Of each `step` lines one is taken.
    """

    def __init__(self, whole: Problem, step: int):
        experiment, data, sizes, baseline, further = whole.content
        here = thinned(State(experiment, data), step)
        self.problem = Problem(
            here.experiment,
            here.data,
            sizes=sizes,
            baseline=None if baseline is None else thinned(baseline, step),
            further=[thinned(state, step) for state in further],
        )
        pairs = zip(whole.states, self.problem.states, strict=True)
        repeats = [
            (_lines(state).size / _lines(fewer).size, fewer.data.z.size) for state, fewer in pairs
        ]
        self.weight = np.concatenate([np.full(size, np.sqrt(count)) for count, size in repeats])
        # On the average of all states: logs come as one sum, and steer unknown noise alone.
        self._log_weight = whole.count / self.problem.count
        self.squares = LeastSquares(
            self._evaluated, whole.dimension, whole.count, alike=whole.squares.kinds
        )

    def _evaluated(
        self, points: ParameterPoints, logarithmic: bool
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residuals and sums of logs, each counted for the lines that it stands for."""
        residual, log_scale = self.problem.squares.residuals(points, logarithmic)
        residual *= self.weight
        return residual, log_scale * self._log_weight

    def deviations(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Standard deviation of each datum, see `Problem.deviations`."""
        return self.problem.deviations()

    def prepare(self) -> None:
        """Compile the residuals, unless that is done. Any thread may."""
        self.problem.prepare()


def thinned(state: State, step: int) -> State:
    """A state at one of so many of its lines, with effects in a form that takes less time."""
    if state.experiment.observe.is_modal:
        return state
    lines = _lines(state)
    count = -(-lines.size // step)
    chosen = lines[evenly_spread(lines.size, count)]
    data: Data = jax.tree.map(lambda values: values[..., chosen], state.data)
    rough = with_effects_roughly(with_lines_at(state.experiment, chosen))
    return state._replace(experiment=rough, data=data)


def _lines(state: State) -> np.ndarray:
    """Numbers of the lines, or modes, of which anything was measured."""
    measured = np.asarray(state.data.measured)
    return np.flatnonzero(measured.any(axis=tuple(range(measured.ndim - 1))))
