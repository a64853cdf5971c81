"""A model fitted from given values of its unknowns, as far as descents from there lead."""

from collections.abc import Callable, Mapping

import numpy as np

from ...experiment.experiment import Experiment, Measurements
from ...inference.engines.least_squares import NormalEquations, ParameterPoints
from ...inference.engines.levenberg_marquardt import Objective, best_fit, minimise
from ...inference.residuals import Problem, sizes_of
from ..fitted import in_scalars, point_of

NEAR, STEPS = 10, 60
"""Steps along logarithmic residuals, which find resonances from afar, and those to the end."""

Values = Mapping[str, float]
"""Value of each unknown by name, elements of arrays one by one."""

Seen = Callable[[dict[str, float]], None]
"""Called with the values to which a descent has come."""


def fitted_from(
    experiment: Experiment, measurement: Measurements, values: Values, seen: Seen
) -> dict[str, float]:
    """Fit a model from given values alone; sizes of a model error stay as they are.

    `seen` is called with the best values so far, step by step.
    """
    sizes = {size.name: float(values[size.name]) for size in sizes_of(experiment)}
    problem = Problem(experiment, experiment.data(measurement), sizes=sizes)
    squares = problem.squares

    def watched(logarithmic: bool) -> "_Watched":
        objective = squares.objective(logarithmic=logarithmic)
        return _Watched(objective, lambda point: seen(_named(problem, point)))

    start = point_of(problem, values)[None]
    near, _ = minimise(watched(True), start, steps=NEAR)
    starts = np.concatenate([start, near])
    ends, normal = minimise(watched(False), starts, steps=STEPS, count=squares.count)
    return _named(problem, best_fit(ends, normal, squares.count).point)


class _Watched:
    """What a descent makes small, which tells where it has come to.

    `seen` is called with the best of the points at which slopes are taken.
    """

    def __init__(self, objective: Objective, seen: Callable[[np.ndarray], None]):
        self._objective, self._seen = objective, seen

    def cost(self, points: ParameterPoints) -> np.ndarray:
        """Minus log posterior density at points [point]."""
        return self._objective.cost(points)

    def normal_equations(self, points: ParameterPoints) -> NormalEquations:
        """The same, its gradient and curvature."""
        normal = self._objective.normal_equations(points)
        self._seen(points[int(np.argmin(np.nan_to_num(normal.cost, nan=np.inf)))])
        return normal


def _named(problem: Problem, point: np.ndarray) -> dict[str, float]:
    """Value of every unknown at a point, elements of arrays one by one."""
    named = problem.coordinates.named(point[None])
    return in_scalars({name: values[0] for name, values in named.items()}) | problem.sizes
