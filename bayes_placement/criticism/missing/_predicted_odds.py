"""Which effects are worth a fit together with a model error: their odds to first order."""

from collections.abc import Sequence

import numpy as np
from scipy.special import logsumexp

from ...effects.effect import Effect
from ...inference.engines.empirical_bayes import SHORT, LinearModel
from ...inference.residuals import Problem, fields_of
from ._compiled_ahead import compiled_ahead
from ._hypotheses import Hypothesis
from ._posterior_odds import Comparison
from ._scan import other_places
from ._suspicion import ROUNDING, changes, weak_points

POINTS = 200
"""Greatest number of places and settings of an effect."""

ALWAYS = 4
"""Effects that are fitted whatever is predicted, those by which the exact model gains most: a large
effect is not linear in its strength."""

FARTHEST = float(np.log(100.0))
"""Greatest log of the factor by which sizes of errors differ from those without the effect."""


def worth_fitting(
    null: Hypothesis,
    exact: Comparison,
    hypotheses: Sequence[Hypothesis],
    fitted: Sequence[Hypothesis] = (),
) -> list[Hypothesis]:
    """Effects whose predicted odds may be the greatest, and a few more, the best first.

    They exceed those of no effect, and do not fall far short of those of what is fitted already.

    The prediction is optimistic: of each place and setting it takes the best strength, of either
    sign. At the best of them errors have sizes of their own: where a single error was large because
    an effect is missing, the size of all others falls with it.

    The null is without effects, with model error, and passes its check. `exact` is the comparison
    without model error, for the prior odds. Hypotheses are single effects in descending order of
    evidence: fitted without model error, or of that of the null and where a scan sees them. Those
    fitted have model error.
    """
    model = _ErroneousModel(null)
    prior_of_none = exact.log_prior(null)
    problems = compiled_ahead(model.problem(hypothesis) for hypothesis in hypotheses)
    odds = [
        model.log_evidence_gained(hypothesis, problem) + exact.log_prior(hypothesis) - prior_of_none
        for hypothesis, problem in zip(hypotheses, problems, strict=True)
    ]
    reached = max((exact.log_odds(hypothesis) for hypothesis in fitted), default=-np.inf)
    least = max(0.0, reached - exact.log_odds(null) - SHORT)
    ranked = sorted(zip(odds, range(len(odds)), strict=True), reverse=True)
    return [
        hypotheses[number] for predicted, number in ranked if predicted > least or number < ALWAYS
    ]


class _ErroneousModel:
    """A fit with model error, linearised: errors and parameters are refitted with an effect."""

    def __init__(self, null: Hypothesis):
        self.null = null
        problem = null.problem
        residual, _, slopes, _ = problem.squares.jacobian(null.fit.point[None])
        self.residual, self.slopes = residual[0], slopes[0]
        self.errors = [problem.errors_of(size) for size in problem.unknown_sizes]
        self.information = self.slopes @ self.slopes.T
        self.curvature = self.information + np.eye(len(self.slopes))

    def problem(self, hypothesis: Hypothesis) -> Problem:
        """Return the problem of a hypothesis with model error, to be evaluated at few points."""
        before, errors = hypothesis.problem, self.null.problem.experiment.model_error
        if (before.experiment.model_error is None) == (errors is None):  # it is compiled already
            return before.at_sizes(self.null.problem.sizes)
        return Problem(
            before.experiment.with_errors(errors),
            before.data,
            sizes=self.null.problem.sizes,
            baseline=before.baseline,
            effort=0,
        )

    def log_evidence_gained(self, hypothesis: Hypothesis, problem: Problem) -> float:
        """Log of the mean likelihood ratio over places and settings, at the best strengths."""
        points = self._points(hypothesis, problem)
        change = self._residual_change(problem, hypothesis.effects[0], points)
        change = change[np.all(np.isfinite(change), axis=1)]
        # At the best fit the slope of the cost along all that is refitted is zero.
        pull = -change @ self.residual
        absorbed = change @ self.slopes.T
        stiffness = np.einsum("bn,bn->b", change, change) - np.einsum(
            "bi,bi->b", absorbed, np.linalg.solve(self.curvature, absorbed.T).T
        )
        is_sensitive = stiffness > ROUNDING**2
        if not is_sensitive.any():
            return -np.inf
        gain = 0.5 * pull[is_sensitive] ** 2 / stiffness[is_sensitive]
        best = change[is_sensitive][np.argmax(gain)]
        return float(logsumexp(gain) - np.log(len(points)) + self._gained_by_other_sizes(best))

    def _residual_change(self, problem: Problem, effect: Effect, points: np.ndarray) -> np.ndarray:
        """What an effect changes at points; a vector of strengths along its best direction."""
        _, change = changes(problem, effect, points, self.residual)
        if len(change) == len(points):
            return change
        return np.stack([self._best_direction(part) for part in np.split(change, len(points))])

    def _best_direction(self, change: np.ndarray) -> np.ndarray:
        """The sum of changes [component, datum] that explains most once all else is refitted."""
        if not np.isfinite(change).all():
            return np.full(change.shape[1], np.nan)
        absorbed = change @ self.slopes.T
        stiffness = change @ change.T - absorbed @ np.linalg.solve(self.curvature, absorbed.T)
        strengths, *_ = np.linalg.lstsq(stiffness, -change @ self.residual, rcond=ROUNDING)
        return np.asarray(strengths @ change)

    def _gained_by_other_sizes(self, change: np.ndarray) -> float:
        """Log evidence gained once errors have the sizes that suit them together with an effect.

        The model is linear in the errors and in the strength of the effect. Any strength is as
        probable.
        """
        across = self.slopes @ change
        information = np.block([[self.information, across[:, None]], [across, change @ change]])
        pull = information[:, :-1] @ self.null.fit.point
        pull[:-1] -= self.slopes @ self.residual
        pull[-1] -= change @ self.residual
        precision = np.ones(len(pull))
        precision[-1] = 1e-12 * information[-1, -1]
        limit = np.full(len(self.errors), FARTHEST)
        return LinearModel(information, pull, precision, self.errors).best_sizes(-limit, limit)[1]

    def _points(self, hypothesis: Hypothesis, problem: Problem) -> np.ndarray:
        """The effect at its weakest, at all its places and where the exact model has it."""
        (effect,) = hypothesis.effects
        points = weak_points(problem, effect, POINTS)
        fields = fields_of(effect, problem)
        points = np.concatenate([points, points[:1]])
        for name, word in fields.items():
            if word != effect.absent[0]:
                fitted = hypothesis.fit.point[hypothesis.problem.coordinates.places[name]]
                points[-1, problem.coordinates.places[name]] = fitted
        columns = other_places(problem, list(fields))
        points[:, columns] = self.null.point_in(problem)[columns]
        return points
