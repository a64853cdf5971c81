"""Which effects are worth a fit beside a model error: their odds to first order about it."""

from collections.abc import Sequence

import numpy as np
from scipy.special import logsumexp

from ...inference.residuals import Problem
from ._hypotheses import Hypothesis, fields_of
from ._posterior_odds import Comparison
from ._scan import carried_over, others
from ._score_test import weak_points

POINTS = 200
"""Greatest number of places and settings of an effect."""


def worth_fitting(
    null: Hypothesis, exact: Comparison, hypotheses: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """Effects whose predicted odds exceed those of no effect, the most promising first.

    The prediction is optimistic: of each place and setting it takes the best strength, of either
    sign, with errors of the sizes that they have without the effect. Where these are settled, an
    effect that gains little moves them little, and the gain changes in the second order only.

    Parameters
    ----------
    null
        The hypothesis without effects, with model error. It passes its check.
    exact
        The comparison without model error, for the prior odds.
    hypotheses
        Single effects, fitted without model error.
    """
    model = _ErroneousModel(null)
    prior_of_none = exact.log_prior(null)
    odds = [
        model.log_evidence_gained(hypothesis) + exact.log_prior(hypothesis) - prior_of_none
        for hypothesis in hypotheses
    ]
    ranked = sorted(zip(odds, range(len(odds)), strict=True), reverse=True)
    return [hypotheses[number] for predicted, number in ranked if predicted > 0]


class _ErroneousModel:
    """A fit with model error, linearised: errors and parameters give way to an effect."""

    def __init__(self, null: Hypothesis):
        self.null = null
        residual, _, slopes, _ = null.problem.squares.jacobian(null.fit.point[None])
        self.residual, self.slopes = residual[0], slopes[0]
        self.curvature = self.slopes @ self.slopes.T + np.eye(len(self.slopes))

    def log_evidence_gained(self, hypothesis: Hypothesis) -> float:
        """Log of the mean likelihood ratio over places and settings, at the best strengths."""
        points, problem = self._points(hypothesis)
        change = problem.squares.residuals(points)[0] - self.residual
        change = change[np.all(np.isfinite(change), axis=1)]
        # At the best fit the slope of the cost along all that gives way is zero.
        pull = -change @ self.residual
        absorbed = change @ self.slopes.T
        stiffness = np.einsum("bn,bn->b", change, change) - np.einsum(
            "bi,bi->b", absorbed, np.linalg.solve(self.curvature, absorbed.T).T
        )
        felt = stiffness > 0
        gain = 0.5 * pull[felt] ** 2 / stiffness[felt]
        return float(logsumexp(gain) - np.log(len(points))) if felt.any() else -np.inf

    def _points(self, hypothesis: Hypothesis) -> tuple[np.ndarray, Problem]:
        """The effect at its weakest, at all its places and where the exact model has it."""
        (effect,) = hypothesis.effects
        before = hypothesis.problem
        problem = Problem(
            before.experiment.with_errors(self.null.problem.experiment.model_error),
            before.data,
            sizes=self.null.problem.sizes,
            baseline=before.baseline,
        )
        points = weak_points(problem, effect, POINTS)
        fields = fields_of(effect, problem)
        points = np.concatenate([points, points[:1]])
        for name, word in fields.items():
            if word != effect.absent[0]:
                fitted = hypothesis.fit.point[before.coordinates.places[name]]
                points[-1, problem.coordinates.places[name]] = fitted
        columns = others(problem, list(fields))
        points[:, columns] = carried_over(self.null.fit.point, columns)
        return points, problem
