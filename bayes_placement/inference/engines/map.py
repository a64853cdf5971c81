"""Highest points of a posterior from many starts, and a Gaussian about the best, Eq. (26)."""

import json
from collections.abc import Callable
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..._shared.arguments import check_count
from ..._shared.compiled import compiled
from ..._shared.dimensions import Key
from ..._shared.errors import MORE_STARTS, InputError
from ..._shared.progress import Progress
from ..estimates import GOOD_PARETO_K, Given, pareto_k
from .empirical_bayes import Hierarchy, Sized, fitted_with_sizes
from .engine import Draws, Engine, EngineDraws, Flat, PerDraw, PosteriorDensity, Scalar, Settings
from .least_squares import NormalEquations, ParameterPoints, SquaresAndPrior, Terms, evolved
from .levenberg_marquardt import LARGEST, Laplace, Objective, laplace, minimise
from .mode_with_sizes import evolved_without_errors, mode_with_sizes, near_modes

Cost = Callable[[PosteriorDensity, Flat], Scalar]
Curvature = Float[Array, "unknown unknown"]
Expansion = tuple[Scalar, Flat, Curvature]
Point = Float[np.ndarray, "unknown"]

SEARCHES = ("gradient", "evolutionary")

NEAR, STEPS, GAIN = 10, 200, 1e-10
"""Steps along logarithmic residuals, those to the end, and the gain of log density that ends it."""

MOST_DAMPING = 1e8
"""Damping above which a descent ends: from a single start it must get past bends and ridges."""

PRIOR_DRAWS, WIDEST = 32, 3.0
"""Fewest draws of the prior, and the deviations of it from which on a Gaussian means nothing."""

ALIKE = 0.1
"""Difference of log density below which two starts end at the same mode."""


class MAP(Engine):
    """Maximum of the posterior density of the named values, Eq. (26), with Laplace covariance.

    Where the model is one of least squares (placement latent, Gaussian noise), the curvature is
    that of Gauss and Newton; else it is the Hessian, with its eigenvalues made positive. Where
    errors have unknown sizes (`model_error.Embedded`), these are the sizes of greatest evidence.

    Parameters
    ----------
    starts
        Starts drawn from the prior (for the evolutionary search, its population).
    search
        `gradient`: Levenberg's and Marquardt's method from every start. `evolutionary`: SciPy's
        differential evolution, then the same from its best point; errors of unknown sizes stay
        zero until then.
    draws
        Draws from the Gaussian about the maximum.
    begin
        Value of every unknown by name, from which alone the search begins, such as those of a fit
        that `improve` made: `ledger.steps[-1].values`. By default it begins at the starts.

    Examples
    --------
    >>> bp.engines.MAP(starts=4).settings()
    {'engine': 'MAP', 'starts': 4, 'search': 'gradient', 'draws': 1000}
    """

    starts: int = eqx.field(static=True, default=32)
    search: str = eqx.field(static=True, default="gradient")
    draws: int = eqx.field(static=True, default=1000)
    begin: Given | None = None

    def __check_init__(self) -> None:
        check_count("starts", self.starts, 1, "engines.MAP(starts=32)")
        check_count("draws", self.draws, 1, "engines.MAP(draws=1000)")
        if self.search not in SEARCHES:
            raise InputError(
                f"engines.MAP has no search {self.search!r}. The searches are "
                f"{' and '.join(SEARCHES)}: MAP(search='evolutionary')."
            )

    def run(self, posterior: PosteriorDensity, key: Key, progress: Progress) -> EngineDraws:
        """Search from many starts and draw from the Gaussian about the best point."""
        start_key, draw_key = jax.random.split(key)
        hierarchy = posterior.hierarchy()
        if hierarchy is not None:
            return self._with_sizes(posterior, hierarchy, start_key, progress)
        starts = self._starts(posterior, start_key)
        if self.search == "evolutionary" and self.begin is None:
            seed = int(jax.random.randint(start_key, (), 0, 2**31 - 1))
            batch_costs = compiled(_costs).bound(posterior)
            starts = evolved(lambda points: np.asarray(batch_costs(points)), starts, seed)[None]
        near, ends, costs = _descend(posterior, starts)
        progress(0.9)
        best = int(np.argmin(costs))
        reached = int(np.sum(costs < costs[best] + ALIKE))
        draws = self._laplace(posterior, near[best], ends[best], draw_key, reached, len(costs))
        progress(1.0)
        return draws

    def _with_sizes(
        self, posterior: PosteriorDensity, problem: Hierarchy, key: Key, progress: Progress
    ) -> EngineDraws:
        """Mode at sizes of greatest evidence; the joint mode with the errors means nothing."""
        seed = int(jax.random.randint(key, (), 0, 2**31 - 1))
        if self.begin is not None:
            fit = _fit_from(posterior, problem, self.begin)
        else:
            starts = problem.without_sizes(self._starts(posterior, key))
            if self.search == "evolutionary":
                starts = evolved_without_errors(problem, starts, seed)
            fit = fitted_with_sizes(problem, near_modes(problem, starts))
        sized = mode_with_sizes(fit, self.draws, seed)
        progress(0.9)
        position = jnp.asarray(sized.points)
        density, likelihood = compiled(_densities)(posterior, position)
        k = pareto_k(np.asarray(density) - sized.log_density)
        progress(1.0)
        return EngineDraws(
            position=position[None],
            log_likelihood=likelihood[None],
            log_evidence=sized.log_evidence,
            mode=jnp.asarray(sized.mode),
            attributes={"pareto_k": k},
            warnings=_warnings(sized.is_flat, k, 0, 0),
        )

    def _starts(self, posterior: PosteriorDensity, key: Key) -> ParameterPoints:
        """Where the search begins."""
        if self.begin is None:
            return np.asarray(posterior.sample_prior(key, self.starts))
        return np.asarray(posterior.vector(self.begin))[None]

    def _laplace(
        self, posterior: PosteriorDensity, near: Point, mode: Point, key: Key, reached: int, of: int
    ) -> EngineDraws:
        log_height, curvature = compiled(_height_and_curvature)(posterior, mode)
        gaussian = laplace(mode, np.asarray(curvature))
        prior = np.asarray(posterior.sample_prior(key, max(self.starts, PRIOR_DRAWS)))
        is_flat = gaussian.is_flat or _reaches_beyond(gaussian, prior)
        if is_flat:
            # Over the flat vector the prior is curved everywhere, so draws stay within it.
            over_vector = compiled(_curvature_over_vector)(posterior, near)
            gaussian = laplace(near, _positive(np.asarray(over_vector)))
        normal = np.asarray(jax.random.normal(key, (self.draws, mode.size)))
        position = jnp.asarray(gaussian.points(normal))
        evidence = float(log_height + gaussian.log_volume)
        density, likelihood = compiled(_densities)(posterior, position)
        k = pareto_k(np.asarray(density) - gaussian.log_density(normal))
        return EngineDraws(
            position=position[None],
            log_likelihood=likelihood[None],
            log_evidence=float("nan") if is_flat else evidence,
            mode=jnp.asarray(mode),
            attributes={"starts": of, "starts_at_best": reached, "pareto_k": k},
            warnings=_warnings(is_flat, k, reached, of),
        )

    def settings(self) -> Settings:
        """Name and sizes."""
        sizes: Settings = {"starts": self.starts, "search": self.search, "draws": self.draws}
        if self.begin is None:
            return {"engine": "MAP", **sizes}
        begin = {name: np.asarray(value).tolist() for name, value in self.begin.items()}
        return {"engine": "MAP", **sizes, "begin": json.dumps(begin)}


def _fit_from(posterior: PosteriorDensity, problem: Hierarchy, begin: Given) -> Sized[Hierarchy]:
    """Fit from known values and sizes; a size at an edge of its prior has no finite coordinate."""
    sizes = {name: begin[name] for name in problem.sizes if name in begin}
    within = {name: problem.sizes[name] for name in sizes}
    start = problem.without_sizes(np.asarray(posterior.vector({**begin, **within}))[None])
    at_sizes = problem.at_sizes({name: float(size) for name, size in sizes.items()})
    return fitted_with_sizes(at_sizes, start, decreasing_errors=())


def _reaches_beyond(gaussian: Laplace, prior: ParameterPoints) -> bool:
    """Whether a Gaussian is far wider than the prior, as at a corner, where all is flat alike."""
    deviation = np.sqrt(np.diag(gaussian.covariance))
    return bool(np.any(deviation > WIDEST * prior.std(axis=0)))


def _descend(
    posterior: PosteriorDensity, starts: ParameterPoints
) -> tuple[ParameterPoints, ParameterPoints, np.ndarray]:
    """Modes over the flat vector and of the named values, and the cost at the latter.

    The density over the flat vector comes first: it has a peak also where the density of the named
    values is greatest at the edge of a prior, and leads near to it.
    """
    largest = np.maximum(LARGEST, 3 * np.abs(starts).max(axis=0))
    over_vector, over_values = _objectives(posterior)
    descend = partial(minimise, largest=largest, most_damping=MOST_DAMPING)
    if isinstance(over_vector, SquaresAndPrior):
        starts, _ = descend(over_vector._replace(logarithmic=True), starts, steps=NEAR)
    near, _ = descend(over_vector, starts, steps=STEPS)
    ends, final = descend(over_values, near, steps=STEPS, gain=GAIN)
    finite = np.isfinite(final.cost)
    if not finite.any():
        raise InputError(
            "No start of engines.MAP reached a finite posterior density. Check the units of the "
            "measurement and the priors: print(experiment)."
        )
    return near[finite], ends[finite], final.cost[finite]


def _objectives(posterior: PosteriorDensity) -> tuple[Objective, Objective]:
    """Minus log density over the flat vector, and that of the named values."""
    priors = [_Smooth(posterior, cost) for cost in (_vector_prior_cost, _prior_cost)]
    problem = posterior.least_squares()
    if problem is not None:
        first, second = (problem.objective(prior=prior.convex) for prior in priors)
        return first, second
    return _Newton(posterior, _vector_cost), _Newton(posterior, _cost)


class _Smooth:
    """A function of the flat vector with its derivatives, at points."""

    def __init__(self, posterior: PosteriorDensity, function: Cost):
        self._value = compiled(_value).bound(function, posterior)
        self._expansion = compiled(_expansion).bound(function, posterior)

    def cost(self, points: ParameterPoints) -> np.ndarray:
        """Its value [point]."""
        return np.array([float(self._value(point)) for point in points])

    def terms(self, points: ParameterPoints) -> Terms:
        """Its value, gradient and Hessian."""
        parts = zip(*(jax.device_get(self._expansion(point)) for point in points), strict=True)
        return Terms(*(np.stack(part) for part in parts))

    def convex(self, points: ParameterPoints) -> Terms:
        """The same, with the eigenvalues of the Hessian made positive."""
        terms = self.terms(points)
        return terms._replace(curvature=_positive(terms.curvature))


class _Newton(_Smooth):
    """Newton's equations, with the eigenvalues of the Hessian made positive."""

    def normal_equations(self, points: ParameterPoints) -> NormalEquations:
        """Normal equations at points; there are no squares."""
        return NormalEquations(*self.convex(points), np.zeros(len(points)))


def _prior_cost(posterior: PosteriorDensity, flat: Flat) -> Scalar:
    """Minus log prior density of the named values."""
    return posterior.log_jacobian(flat) - posterior.log_prior(flat)


def _vector_prior_cost(posterior: PosteriorDensity, flat: Flat) -> Scalar:
    """Minus log prior density over the flat vector."""
    return -posterior.log_prior(flat)


def _vector_cost(posterior: PosteriorDensity, flat: Flat) -> Scalar:
    """Minus log posterior density over the flat vector."""
    return -_height(posterior, flat)


def _cost(posterior: PosteriorDensity, flat: Flat) -> Scalar:
    """Minus log posterior density of the named values."""
    return _prior_cost(posterior, flat) - posterior.log_likelihood(flat)


def _costs(posterior: PosteriorDensity, points: Draws) -> PerDraw:
    return jax.vmap(lambda flat: _cost(posterior, flat))(points)


def _height(posterior: PosteriorDensity, flat: Flat) -> Scalar:
    """Log posterior density over the flat vector."""
    return posterior.log_prior(flat) + posterior.log_likelihood(flat)


def _densities(posterior: PosteriorDensity, points: Draws) -> tuple[PerDraw, PerDraw]:
    """Log posterior density over the flat vector, and log likelihood, at points."""
    return jax.vmap(lambda flat: (_height(posterior, flat), posterior.log_likelihood(flat)))(points)


def _height_and_curvature(posterior: PosteriorDensity, flat: Flat) -> tuple[Scalar, Curvature]:
    return _height(posterior, flat), _expansion(_cost, posterior, flat)[2]


def _curvature_over_vector(posterior: PosteriorDensity, flat: Flat) -> Curvature:
    return -_expansion(_height, posterior, flat)[2]


def _expansion(function: Cost, posterior: PosteriorDensity, flat: Flat) -> Expansion:
    """Value, gradient and Hessian of a function at a point."""

    def at(flat: Flat) -> Scalar:
        return function(posterior, flat)

    return (*jax.value_and_grad(at)(flat), jax.hessian(at)(flat))


def _value(function: Cost, posterior: PosteriorDensity, flat: Flat) -> Scalar:
    return function(posterior, flat)


def _positive(hessian: np.ndarray) -> np.ndarray:
    """Hessian with the absolute values of its eigenvalues; it leads away from saddles."""
    values, vectors = np.linalg.eigh(np.nan_to_num(hessian, posinf=0.0, neginf=0.0))
    return np.einsum("...ij,...j,...kj->...ik", vectors, np.abs(values), vectors)


def _warnings(flat: bool, k: float, reached: int, of: int) -> tuple[str, ...]:
    sentences = []
    if flat:
        sentences.append(
            "The posterior is flat at its maximum, or the maximum lies at the edge of a prior, so "
            "the Laplace covariance means nothing in that direction; use engines.SMC()."
        )
    if k > GOOD_PARETO_K and not flat:
        sentences.append(
            f"The posterior is not near the Gaussian of Laplace's method: Pareto k = {k:.2f} is "
            f"above {GOOD_PARETO_K}; its mode stands, its spread and evidence do not, so use "
            "engines.SMC()."
        )
    if of > 1 and reached == 1:
        sentences.append(
            f"Only one of {of} starts reached the best point found, so a better one may exist; use "
            f"more starts, {MORE_STARTS.python}."
        )
    return tuple(sentences)
