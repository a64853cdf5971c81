"""Sizes of errors by the evidence, the errors themselves integrated out by Laplace's method.

MacKay (1992, doi:10.1162/neco.1992.4.3.415). The joint mode over errors and their sizes lies at
sizes of zero and means nothing; the evidence as a function of the sizes has a maximum that does.

In a linear model MacKay's fixed point, by which the squares of the errors of a size sum up to the
number of them that the data determine, is that maximum; where few are determined a fixed-point
iteration goes there slowly, a descent along the gradient does not.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Generic, NamedTuple, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float, Int
from numpy.linalg import LinAlgError
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from ..._shared.compiled import compiled
from ..._shared.sites import Unknown
from .least_squares import LeastSquares, ParameterPoints
from .levenberg_marquardt import GAIN, Fit, Laplace, best_fit, minimise

ROUNDS = 6
"""Greatest number of estimates of the sizes."""

SETTLED = 1.0
"""Gain of log evidence below which the sizes are settled; where the model misses the data, in units
of the mean square of its residuals, as deviations are too small there."""

DECREASING_ERRORS = (0.3, 0.1, 0.03, 0.01)
"""Relative errors that FRFs have besides, at first: a resonance that is off by more than its
bandwidth leaves the plain residual flat."""

FAR_BEHIND = 0.1
"""Log evidence a datum behind a rival at which a fit is given up: a rule of the search, no bound.
It is asked only once the sizes have followed the data; before, fits that end well lie farther."""

SMALL_ERROR = 0.1
"""Relative error of the FRFs, beside the model error, up to which a fit may be given up: one whose
log evidence is less than that of a rival by more than 1 for each datum, since it does not follow
what FRFs show to a tenth. Fits that end well are less behind."""

SHORT = 10.0
"""Log evidence by which a fit may fall short of a rival and still be kept: strong evidence
twice, and prior odds of effects that have more or fewer variants."""

FIRST_STEPS, FOLLOWED = 8, 2
"""Steps with each of these, and descents that are followed to the next."""

ALMOST = 0.1
"""Gain of log density of a step below which a descent ends that misses the data in spite of errors:
a rival of no other use."""

LARGEST_STEP = np.log(4.0)
"""Greatest change of the log of a size in one round."""

STEPS = 40

LEAST_SIZE = 1e-12
"""Least size of an error."""

Ends = Float[np.ndarray, "mode unknown"]
Kind = TypeVar("Kind", bound="Hierarchy")


@runtime_checkable
class Hierarchy(Protocol):
    """A problem of least squares whose errors have unknown sizes."""

    sizes: dict[str, float]
    squares: LeastSquares

    @property
    def unknown_sizes(self) -> Sequence[Unknown]:
        """Sizes that are unknown."""

    @property
    def count(self) -> int:
        """Number of data."""

    def at_sizes(self: Kind, sizes: Mapping[str, float]) -> Kind:
        """Return the problem at other sizes."""

    def errors_of(self, size: Unknown) -> np.ndarray:
        """Places of the errors of a size among the coordinates."""

    def with_sizes(self, points: np.ndarray, sizes: Mapping[str, np.ndarray]) -> np.ndarray:
        """Coordinates of all unknowns, from those of the problem and sizes by name."""

    def without_sizes(self, points: np.ndarray) -> np.ndarray:
        """Coordinates of the problem among those of all unknowns."""

    def weight(self, relative_error: float) -> np.ndarray | None:
        """Weight of each residual once FRFs have a further relative error."""


class Rival(NamedTuple):
    """Another fit, behind which a fit is given up."""

    with_small_error: float = -np.inf
    """Its log evidence once FRFs have a relative error of no more than `SMALL_ERROR` besides."""
    early: float = -np.inf
    """Its log evidence after the first steps without further errors."""
    evidence: float = -np.inf
    """Its log evidence in the end."""


@dataclass(frozen=True)
class Sized(Generic[Kind]):
    """A fit, and the problem at the sizes that were found for it."""

    problem: Kind
    """The problem."""
    fit: Fit
    """Its fit; the evidence is that of the model with unknown sizes."""
    deviations: dict[str, float]
    """Standard deviation of the log of each size, by name."""
    as_rival: Rival
    """Its evidence on the way, by which other fits are given up."""


def fitted_with_sizes(
    problem: Kind,
    starts: ParameterPoints,
    decreasing_errors: Sequence[float] = DECREASING_ERRORS,
    rival: Rival = Rival(),  # noqa: B008  it never changes
) -> Sized[Kind]:
    """Best fit from some starts, errors having the sizes of greatest evidence.

    FRFs have relative errors besides, one after the other, before they have none. A fit that is far
    behind its rival is given up.
    """
    with_small_error = -np.inf
    for relative_error in decreasing_errors:
        ends, fit = _fit(problem, starts, relative_error, FIRST_STEPS)
        is_weighed = problem.weight(relative_error) is not None  # not where the noise is unknown
        if is_weighed and relative_error <= SMALL_ERROR and with_small_error == -np.inf:
            with_small_error = fit.log_evidence
            if with_small_error < rival.with_small_error - problem.count:
                return _sized(problem, _fit(problem, ends[:1], steps=0)[1])
        problem, (starts,) = _at_better_sizes(problem, fit, (ends[:FOLLOWED],))
    sized, early = _settled(problem, starts, rival)
    return replace(sized, as_rival=Rival(with_small_error, early, sized.fit.log_evidence))


def _settled(problem: Kind, starts: ParameterPoints, rival: Rival) -> tuple[Sized[Kind], float]:
    """Estimate the sizes until the evidence no longer grows, or will not reach that of a rival.

    Rounds mostly gain less and less: a rule of the search, no bound. Also returned is the evidence
    after the first steps.
    """
    ends, fit = _fit(problem, starts, steps=FIRST_STEPS)
    early = fit.log_evidence
    if early < rival.early - FAR_BEHIND * problem.count:
        return _sized(problem, fit), early
    _, fit = _fit(problem, ends)
    best = _sized(problem, fit)
    for remaining in reversed(range(ROUNDS if problem.unknown_sizes else 0)):
        problem, (point,) = _at_better_sizes(problem, fit, (fit.point,))
        _, fit = _fit(problem, point[None], gain=GAIN if _may_be_right(problem, fit) else ALMOST)
        sized = _sized(problem, fit)
        gain = sized.fit.log_evidence - best.fit.log_evidence
        best = sized if gain > 0 else best
        reached = best.fit.log_evidence + remaining * max(gain, 0.0)
        least = SETTLED * max(1.0, fit.squares / problem.count)
        if gain < least or reached < rival.evidence - SHORT:
            break
    return best, early


def _may_be_right(problem: Hierarchy, fit: Fit) -> bool:
    """Whether residuals are not far larger than chance, five deviations of chi2, lets them be."""
    return bool(fit.squares <= problem.count + 5 * np.sqrt(2 * problem.count))


def _sized(problem: Kind, fit: Fit) -> Sized[Kind]:
    fit, deviations = _integrated(problem, fit)
    return Sized(problem, fit, deviations, Rival())


def _at_better_sizes(
    problem: Kind, fit: Fit, points: Sequence[np.ndarray]
) -> tuple[Kind, list[np.ndarray]]:
    """The problem at better sizes, and points of the same errors there."""
    if not problem.unknown_sizes:
        return problem, list(points)
    sizes = _better(problem, fit)
    moved = [_rescaled(problem, point, sizes) for point in points]
    return problem.at_sizes(sizes), moved


def _fit(
    problem: Hierarchy,
    starts: ParameterPoints,
    relative_error: float = 0.0,
    steps: int = STEPS,
    gain: float = GAIN,
) -> tuple[Ends, Fit]:
    """Final points of the descents, the best first and each mode once, and the best fit."""
    objective = problem.squares.objective(weight=problem.weight(relative_error))
    ends, normal = minimise(objective, starts, steps=steps, gain=gain, count=problem.count)
    order = np.argsort(np.nan_to_num(normal.cost, nan=np.inf))
    fit = best_fit(ends, normal, problem.count)
    return _distinct(ends[order], fit.gaussian), fit


def _distinct(ends: ParameterPoints, gaussian: Laplace) -> Ends:
    """The first point, and those that differ from it by more than a posterior deviation."""
    deviation = np.sqrt(np.diag(gaussian.covariance))
    differs = np.any(np.abs(ends - ends[0]) > deviation, axis=1)
    differs[0] = True
    return ends[differs]


def _determined(problem: Hierarchy, fit: Fit, size: Unknown) -> tuple[float, float]:
    """Sum of the squared errors of a size, and how many of them the data determine."""
    places = problem.errors_of(size)
    variance = np.diag(fit.gaussian.covariance)[places]
    squares = float(np.sum(fit.point[places] ** 2))
    return squares, float(np.sum(np.clip(1 - variance, 0.0, 1.0)))


def _better(problem: Hierarchy, fit: Fit) -> dict[str, float]:
    """Sizes of the greatest evidence of the model that is linear about a fit, none much changed."""
    unknown = problem.unknown_sizes
    if not np.isfinite(fit.gaussian.root).all():
        return dict(problem.sizes)
    root = solve_triangular(fit.gaussian.root, np.eye(len(fit.point)), lower=True)
    curvature = root.T @ root
    prior = np.ones(len(fit.point))
    linear = LinearModel(
        curvature - np.diag(prior),
        curvature @ fit.point - fit.gradient,  # a descent cut short is still pulled on
        prior,
        [problem.errors_of(size) for size in unknown],
    )
    before = np.log([problem.sizes[size.name] for size in unknown])
    low, high = np.transpose([bounds_of_log(size) for size in unknown])

    def log_prior(logs: np.ndarray) -> tuple[float, np.ndarray]:
        values = zip(unknown, np.exp(before + logs), strict=True)
        densities, slopes = np.transpose([_log_prior(size, value) for size, value in values])
        return float(densities.sum()), slopes

    logs, _ = linear.best_sizes(
        np.clip(low - before, -LARGEST_STEP, 0.0),
        np.clip(high - before, 0.0, LARGEST_STEP),
        log_prior,
    )
    sizes = np.exp(before + logs)
    return {size.name: _within(size, value) for size, value in zip(unknown, sizes, strict=True)}


def _within(size: Unknown, value: float) -> float:
    """Size within the support of its prior."""
    low, high = bounds_of_log(size)
    return float(np.clip(value, np.exp(low), np.exp(high)))


def bounds_of_log(size: Unknown) -> tuple[float, float]:
    """Least and greatest log of a size in the support of its prior."""
    support = size.distribution.support
    low = max(float(getattr(support, "lower_bound", 0.0)), LEAST_SIZE)
    return float(np.log(low)), float(np.log(getattr(support, "upper_bound", np.inf)))


def log_density(size: Unknown, values: Float[np.ndarray, "value"]) -> Float[np.ndarray, "value"]:
    """Log prior density of the log of a size, at values of the size."""
    log_prob = compiled(type(size.distribution).log_prob)
    return np.asarray(log_prob(size.distribution, values)) + np.log(values)


def _log_prior(size: Unknown, value: float) -> tuple[float, float]:
    """Log prior density of the log of a size, and its slope."""
    step = 1e-3
    low, middle, high = (_within(size, value * np.exp(side * step)) for side in (-1, 0, 1))
    densities = log_density(size, np.array([low, middle, high]))
    slope = (densities[2] - densities[0]) / max(float(np.log(high / low)), 1e-9)
    return float(densities[1]), float(slope)


def _rescaled(problem: Hierarchy, point: np.ndarray, sizes: Mapping[str, float]) -> np.ndarray:
    """Point of the same errors at other sizes."""
    moved = point.copy()
    for size in problem.unknown_sizes:
        moved[..., problem.errors_of(size)] *= problem.sizes[size.name] / sizes[size.name]
    return moved


def _integrated(problem: Hierarchy, fit: Fit) -> tuple[Fit, dict[str, float]]:
    """Fit with the evidence integrated over the sizes, and how well these are known.

    About its maximum the log evidence falls as the number of determined errors times the square of
    the change of the log of a size. Where few are determined it falls on one side only, and the
    prior of the size limits the width.
    """
    log_evidence, deviations = fit.log_evidence, {}
    for size in problem.unknown_sizes:
        _, determined = _determined(problem, fit, size)
        deviation = 1 / np.sqrt(2 * max(determined, 0.5))
        width = np.sqrt(2 * np.pi) * deviation
        density, _ = _log_prior(size, problem.sizes[size.name])
        log_evidence += min(0.0, density + float(np.log(width)))
        deviations[size.name] = float(deviation)
    return fit._replace(log_evidence=log_evidence), deviations


Logs = Float[np.ndarray, "size"]
Slope = Callable[[Logs], tuple[float, Logs]]


class LinearModel(NamedTuple):
    """Minus log likelihood, half u' A u - b' u, of errors with normal priors."""

    information: Float[np.ndarray, "unknown unknown"]
    """A, Fisher's information of the data."""
    pull: Float[np.ndarray, "unknown"]
    """b, what the data pull at."""
    precision: Float[np.ndarray, "unknown"]
    """Precision of the prior of each unknown."""
    errors: Sequence[Int[np.ndarray, "error"]]
    """Unknowns whose priors have one size, for each size."""

    def log_evidence(self, logs: Logs) -> tuple[float, Logs]:
        """Log evidence but for a constant, and its slopes along the logs of factors on the sizes.

        Minus infinity where rounding leaves no positive definite matrix.
        """
        precision = self.precision.copy()
        for places, log in zip(self.errors, logs, strict=True):
            precision[places] = self.precision[places] * np.exp(-2 * log)
        try:
            factor = cho_factor(self.information + np.diag(precision), lower=True)
        except LinAlgError:  # what the prior determines alone is lost in rounding
            return -np.inf, np.zeros(len(logs))
        covariance = cho_solve(factor, np.eye(len(precision)))
        mean = covariance @ self.pull
        volume = 0.5 * np.sum(np.log(precision)) - np.sum(np.log(np.diag(factor[0])))
        spread = precision * (mean**2 + np.diag(covariance))
        slopes = [np.sum(spread[places]) - len(places) for places in self.errors]
        return float(0.5 * self.pull @ mean + volume), np.array(slopes)

    def best_sizes(
        self, low: Logs, high: Logs, log_prior: Slope | None = None
    ) -> tuple[Logs, float]:
        """Logs of the factors on the sizes of the greatest evidence, and the log evidence gained.

        Zero lies between the least and the greatest log of each. Their prior is uniform by default.
        """

        def cost(logs: Logs) -> tuple[float, Logs]:
            value, slopes = self.log_evidence(logs)
            prior, of_prior = (0.0, 0.0) if log_prior is None else log_prior(logs)
            return -value - prior, -slopes - of_prior

        start = np.zeros(len(self.errors))
        if not start.size or not np.isfinite(before := cost(start)[0]):
            return start, 0.0
        bounds = np.transpose([low, high])
        from scipy.optimize import minimize  # it takes long to import

        result = minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds)
        return np.asarray(result.x), float(before - result.fun)
