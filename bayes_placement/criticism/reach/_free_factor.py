"""A factor on channels that is free at each line: what anything done to their record could do.

Residuals of a factor 1 + t are r + a t at each line, as those of a law on a port: a is what they
change by once the response of these channels is doubled. Where each line has one such channel, t
explains all that it measured: then only a factor of few numbers tells something.
"""

import functools
from collections.abc import Callable

import equinox as eqx
import numpy as np
from jaxtyping import Float

from ...inference.residuals import Problem
from ._free_law import AtPort, Channels, Lines, Points, complex_residuals, over
from ._slopes import Along, Slopes, Sparsity


class Responses:
    """Residuals and responses of a problem, of the last points kept: many channels ask for them."""

    def __init__(self, problem: Problem):
        self.problem = problem
        # Against data of zero a residual is the response itself.
        silent = eqx.tree_at(lambda data: data.z, problem.data, np.zeros_like(problem.data.z))
        of_zero = Problem(
            problem.experiment,
            silent,
            sizes=problem.sizes,
            baseline=problem.baseline,
            further=problem.further,
        )
        of_zero.squares.take_structure(problem.squares)
        self._both, self._kept = (problem, of_zero), dict[str, tuple[bytes, list[np.ndarray]]]()

    def at(self, points: Points) -> list[Channels]:
        """Complex residuals and responses."""
        return self._known("at", points, lambda each: each.squares.residuals(points)[0])

    def along(self, points: Points) -> list[Along]:
        """Their slopes along the groups of unknowns."""
        return self._known("along", points, lambda each: each.squares.along_groups(points).slopes)

    def _known(
        self, what: str, points: Points, evaluate: Callable[[Problem], np.ndarray]
    ) -> list[np.ndarray]:
        key = points.tobytes()
        if self._kept.get(what, (None,))[0] != key:
            values = [complex_residuals(evaluate(each), each) for each in self._both]
            self._kept[what] = key, values
        return self._kept[what][1]

    @functools.cached_property
    def sparsity(self) -> Sparsity:
        """Which residuals each unknown changes."""
        return Sparsity.of(self.problem)


class FreeFactor:
    """An experiment in which a factor on some channels may be any.

    `affected` is 1 on the FRFs that have the factor, 0 on all others.
    """

    def __init__(self, responses: Responses, affected: Float[np.ndarray, "#sensor #actuator 1"]):
        self._responses, self.problem, self.held = responses, responses.problem, list[int]()
        of_experiment = np.broadcast_to(affected[..., None], self.problem.data.z.shape)
        everywhere = self.problem.of_experiment(of_experiment)  # in no earlier state
        self.data = everywhere.astype(bool)
        self._affected = complex_residuals(everywhere, self.problem).real

    @property
    def sparsity(self) -> Sparsity:
        """Which residuals each unknown changes."""
        return self._responses.sparsity

    def at(self, points: Points) -> AtPort:
        """Residuals, and what a factor changes: it feels no structure, so that h is zero."""
        free, response = self._responses.at(points)
        nothing = np.zeros((len(points), free.shape[-1]), complex)
        return AtPort(free, self._affected * response, nothing)

    def about(self, points: Points, stiffness: Lines) -> AtPort:
        """Return the same, which is so for any factor."""
        return self.at(points)

    def residuals(self, points: Points, numerator: Lines, denominator: Lines) -> Channels:
        """Residuals with a change t of the factor, numerator over denominator."""
        return self.at(points).left(numerator / denominator)

    def slopes(self, points: Points, numerator: Lines, denominator: Lines) -> Slopes:
        """Slopes of the residuals along all unknowns, the factor held."""
        free, response = self._responses.along(points)
        strength = (numerator / denominator)[:, None, None]
        return Slopes(free + self._affected * response * strength, self.sparsity)

    def typical(self, at: AtPort) -> Lines:
        """A gain: where the response is nearly zero a free factor is large, and slopes with it."""
        pull, information = (each.sum(axis=1) for each in (at.pull(), at.information()))
        gain = -over(pull, information)
        return np.repeat(gain[:, None], at.free.shape[-1], axis=1)

    def released(self) -> "FreeFactor":
        """Return the same with nothing held."""
        return self
