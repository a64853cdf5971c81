"""A factor on channels that is free at each line: what anything done to their record could do.

Residuals of a factor 1 + t are r + a t at each line, as those of a law on a port: a is what they
change by once the response of these channels is doubled. Where each line has one such channel, t
explains all that it measured: then only a factor of few numbers tells something.
"""

import equinox as eqx
import numpy as np
from jaxtyping import Float

from ...inference.residuals import Problem
from ._free_law import Along, AtPort, Channels, Lines, Points, complex_residuals, over


class FreeFactor:
    """An experiment in which a factor on some channels may be any.

    Parameters
    ----------
    problem
        The problem of the experiment.
    affected
        1 on the FRFs that have the factor, 0 on all others.
    """

    def __init__(self, problem: Problem, affected: Float[np.ndarray, "#sensor #actuator 1"]):
        self.problem, self.held = problem, list[int]()
        of_experiment = np.broadcast_to(affected[..., None], problem.data.z.shape)
        everywhere = problem.of_experiment(of_experiment)  # in no earlier state
        self._affected = complex_residuals(everywhere, problem).real
        # Against data of zero a residual is the response itself.
        silent = eqx.tree_at(lambda data: data.z, problem.data, np.zeros_like(problem.data.z))
        self._silent = Problem(
            problem.experiment,
            silent,
            sizes=problem.sizes,
            baseline=problem.baseline,
            further=problem.further,
        )
        self._silent.squares.take_structure(problem.squares)

    def at(self, points: Points) -> AtPort:
        """Residuals, and what a factor changes: it feels no structure, so that h is zero."""
        free, response = (
            complex_residuals(each.squares.residuals(points)[0], each)
            for each in (self.problem, self._silent)
        )
        nothing = np.zeros((len(points), free.shape[-1]), complex)
        return AtPort(free, self._affected * response, nothing)

    def residuals(self, points: Points, numerator: Lines, denominator: Lines) -> Channels:
        """Residuals with a change t of the factor, numerator over denominator."""
        return self.at(points).left(numerator / denominator)

    def slopes(self, points: Points, numerator: Lines, denominator: Lines) -> Along:
        """Slopes of the residuals along all unknowns, the factor held."""
        free, response = (
            complex_residuals(each.squares.jacobian(points).slopes, each)
            for each in (self.problem, self._silent)
        )
        strength = (numerator / denominator)[:, None, None]
        return free + self._affected * response * strength

    def typical(self, at: AtPort) -> Lines:
        """A gain: where the response is nearly zero a free factor is large, and slopes with it."""
        pull, information = (each.sum(axis=1) for each in (at.pull(), at.information()))
        gain = -over(pull, information)
        return np.repeat(gain[:, None], at.free.shape[-1], axis=1)

    def released(self) -> "FreeFactor":
        """Return the same with nothing held."""
        return self
