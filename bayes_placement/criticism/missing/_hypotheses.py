"""An experiment with none, one or several effects that may be missing, each fitted."""

import functools
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np

from ...effects.effect import Effect, take_long
from ...effects.library import kind_of
from ...experiment.experiment import Experiment
from ...experiment.model_error import ModalErrors
from ...experiment.noise import Data
from ...inference.engines.empirical_bayes import DECREASING_ERRORS, Rival
from ...inference.engines.least_squares import Jacobian
from ...inference.engines.levenberg_marquardt import Fit
from ...inference.residuals import Problem, point_in_problem
from ..kept_fits import NO_RIVAL, kept_with_sizes
from ..screening_lines import at_screening_lines
from ._descents import fit_alone
from ._linear import Linear
from ._outliers import Mixture, mixture


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An experiment with none, one or several effects, fitted.

    Effects have priors. `near` are ends of descents along logarithmic residuals [start, unknown],
    of the exact model. `deviations` are standard deviations of the log of each unknown size of the
    model error, by name. `as_rival` is the evidence on the way to its fit with model error, `exact`
    its fit without; None where there is none.
    """

    effects: tuple[Effect, ...]
    problem: Problem
    fit: Fit
    near: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    deviations: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    has_errors: bool = False
    as_rival: Rival = NO_RIVAL
    exact: "Hypothesis | None" = None

    def point_in(self, problem: Problem, onto: np.ndarray | None = None) -> np.ndarray:
        """The fit as coordinates of a problem; what is new there as in `onto`, else at medians."""
        return point_in_problem(self.problem, self.fit.point, problem, onto)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of its effects, sorted."""
        return tuple(sorted(kind_of(effect) for effect in self.effects))

    @functools.cached_property
    def variants(self) -> tuple[str, ...]:
        """What its effects are about, sorted, where others of their kind may stand for them."""
        return tuple(sorted(effect.variant for effect in self.effects))

    @functools.cached_property
    def log_orders(self) -> float:
        """Log of the number of orders of its effects in which each has another of the same kind."""
        return math.fsum(math.lgamma(count + 1) for count in Counter(self.kinds).values())

    @property
    def log_evidence(self) -> float:
        """Log evidence of its kinds, no order of effects of one kind being another hypothesis.

        Places and strengths of m effects of one kind are independent in the prior, so that the
        posterior density has m! modes, one for each order, all alike. Laplace's method sees one.
        """
        return self.fit.log_evidence + self.log_orders

    @functools.cached_property
    def is_noise_known(self) -> bool:
        """Whether the level of the noise is stated, or read from the data."""
        noise = self.problem.experiment.noise
        return noise is not None and noise.deviation(self.problem.data) is not None

    @functools.cached_property
    def residual(self) -> np.ndarray:
        """Residuals at its fit over their standard deviations [datum]."""
        return self.problem.squares.residuals(self.fit.point[None])[0][0]

    @functools.cached_property
    def with_outliers(self) -> Mixture:
        """Likelihood at its fit where a few data may be outliers."""
        return mixture(self.residual, self.problem.count)

    @property
    def chi2_per_datum(self) -> float:
        """Mean square of the residuals over their variance."""
        return self.fit.squares / self.problem.count

    @property
    def chi2_when_exact(self) -> float:
        """That of its fit without model error; NaN where there is none."""
        return float("nan") if self.exact is None else self.exact.chi2_per_datum


@functools.lru_cache(maxsize=4)  # of the hypotheses that are extended
def logarithmic_jacobian(hypothesis: Hypothesis) -> Jacobian:
    """Logarithmic residuals at its fit, at the lines of scans, and their slopes."""
    screened = at_screening_lines(hypothesis.problem)
    return screened.squares.jacobian(hypothesis.fit.point[None], True)


@functools.lru_cache(maxsize=4)
def linear_logarithmic(hypothesis: Hypothesis) -> Linear:
    """The same, linear in the unknowns."""
    residual, _, slopes, _ = logarithmic_jacobian(hypothesis)
    return Linear(residual[0], slopes[0])


def null_hypothesis(experiment: Experiment, data: Data) -> Hypothesis:
    """Fit the experiment as it is given."""
    problem = Problem(experiment, data)
    return Hypothesis((), problem, *fit_alone(problem))


def with_errors(exact: Hypothesis, errors: ModalErrors, rival: Rival = NO_RIVAL) -> Hypothesis:
    """Fit a hypothesis once more, with a model error.

    Errors begin at zero, where the exact model follows the data best on a logarithmic scale, and
    where it fits them best: a fit whose errors have already taken up what an effect does would keep
    them.

    A hypothesis that stays far behind its rival is left as it is.
    """
    problem = problem_with_errors(exact, errors)
    before = np.concatenate([exact.near, exact.fit.point[None]])
    starts = np.zeros((len(before), problem.dimension))
    starts[:, : exact.problem.dimension] = before  # errors are the last unknowns
    sized = kept_with_sizes(problem, starts, decreasing_errors(problem, DECREASING_ERRORS), rival)
    return replace(exact, **vars(sized), has_errors=True, exact=exact)


def problem_with_errors(exact: Hypothesis, errors: ModalErrors) -> Problem:
    """Return the problem of a hypothesis with a model error."""
    before = exact.problem
    return Problem(before.experiment.with_errors(errors), before.data, baseline=before.baseline)


def decreasing_errors(problem: Problem, relative_errors: Sequence[float]) -> Sequence[float]:
    """Relative errors that data have besides, at first; the last alone where modes are observed.

    A resonance that is off is flat in an FRF; a natural frequency is not, wherever it is.
    """
    is_modal = problem.experiment.observe.is_modal
    return relative_errors[-1:] if is_modal else relative_errors


def rival_among(hypotheses: Sequence[Hypothesis]) -> Rival:
    """Return the hypothesis of the greatest evidence as a rival; without any, there is none."""
    best = max(hypotheses, key=lambda hypothesis: hypothesis.fit.log_evidence, default=None)
    return NO_RIVAL if best is None else best.as_rival


def takes_long(hypothesis: Hypothesis) -> bool:
    """Whether it has an effect that takes long to evaluate."""
    return take_long(hypothesis.effects)


def finite(hypotheses: Iterable[Hypothesis]) -> list[Hypothesis]:
    """Those with a finite density."""
    return [hypothesis for hypothesis in hypotheses if np.isfinite(hypothesis.fit.log_evidence)]
