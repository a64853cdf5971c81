"""map: in, a posterior; out, its highest points from many starts, and a Gaussian about the best.

Equation (26). Not known here: structures, placement.
"""

from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import differential_evolution, minimize

from ..._types import InputError, Key, Progress
from ..weights import GOOD_PARETO_K, pareto_k
from .engine import Engine, EngineDraws, PosteriorDensity

Objective = Callable[[Any], Any]

_SEARCHES = ("gradient", "evolutionary")


class MAP(Engine):
    """Maximum of the posterior density of the named values, Eq. (26), with Laplace covariance.

    Parameters
    ----------
    starts
        Starts drawn from the prior (for the evolutionary search, its population).
    search
        `gradient`: SciPy's L-BFGS-B from every start. `evolutionary`: SciPy's differential
        evolution, then L-BFGS-B.
    draws
        Draws from the Gaussian about the maximum.
    """

    starts: int = eqx.field(static=True, default=32)
    search: str = eqx.field(static=True, default="gradient")
    draws: int = eqx.field(static=True, default=1000)

    def __check_init__(self) -> None:
        if self.search not in _SEARCHES:
            raise InputError(
                f"engines.MAP has no search {self.search!r}. The searches are "
                f"{' and '.join(_SEARCHES)}: MAP(search='evolutionary')."
            )

    def run(self, posterior: PosteriorDensity, key: Key, progress: Progress) -> EngineDraws:
        """Search from many starts and draw from the Gaussian about the best point."""
        start_key, draw_key = jax.random.split(key)

        def cost(flat: Any) -> Any:
            density = posterior.log_prior(flat) - posterior.log_jacobian(flat)
            return -(posterior.log_likelihood(flat) + density)

        starts = np.asarray(posterior.sample_prior(start_key, self.starts))
        if self.search == "evolutionary":
            seed = int(jax.random.randint(start_key, (), 0, 2**31 - 1))
            starts = _evolved(cost, starts, seed)
        ends = _descend(cost, starts, progress)
        best = min(ends, key=lambda end: end.fun)
        reached = sum(bool(end.fun < best.fun + 0.1) for end in ends)
        return self._laplace(posterior, cost, jnp.asarray(best.x), draw_key, reached, len(ends))

    def _laplace(
        self,
        posterior: PosteriorDensity,
        cost: Objective,
        mode: Any,
        key: Key,
        reached: int,
        of: int,
    ) -> EngineDraws:
        values, vectors = np.linalg.eigh(np.asarray(jax.jit(jax.hessian(cost))(mode)))
        flat = bool(np.any(values < 1e-8 * values.max()))
        root = vectors / np.sqrt(np.maximum(values, 1e-8 * values.max()))
        normal = jax.random.normal(key, (self.draws, mode.size))
        position = mode + normal @ jnp.asarray(root).T
        log_volume = 0.5 * mode.size * np.log(2 * np.pi) + np.linalg.slogdet(root)[1]
        evidence = float(-cost(mode) + posterior.log_jacobian(mode) + log_volume)
        likelihood = jax.jit(jax.vmap(posterior.log_likelihood))(position)
        density = likelihood + jax.jit(jax.vmap(posterior.log_prior))(position)
        k = pareto_k(np.asarray(density) + 0.5 * np.sum(np.asarray(normal) ** 2, axis=1))
        return EngineDraws(
            position=position[None],
            log_likelihood=likelihood[None],
            log_evidence=float("nan") if flat else evidence,
            mode=mode,
            attributes={"starts": of, "starts_at_best": reached, "pareto_k": k},
            warnings=_warnings(flat, k, reached, of),
        )

    def settings(self) -> dict[str, Any]:
        """Name and sizes."""
        return {"engine": "MAP", "starts": self.starts, "search": self.search, "draws": self.draws}


def _descend(cost: Objective, starts: np.ndarray, progress: Progress) -> list[Any]:
    value_and_grad = jax.jit(jax.value_and_grad(cost))

    def numbers(flat: np.ndarray) -> tuple[float, np.ndarray]:
        value, gradient = value_and_grad(jnp.asarray(flat))
        return float(value), np.nan_to_num(np.asarray(gradient))

    ends = []
    for done, start in enumerate(starts, start=1):
        end = minimize(numbers, start, jac=True, method="L-BFGS-B", options={"maxiter": 500})
        if np.isfinite(end.fun):
            ends.append(end)
        progress(done / len(starts))
    if not ends:
        raise InputError(
            "No start of engines.MAP reached a finite posterior density. Check the units of the "
            "measurement and the priors: print(experiment)."
        )
    return ends


def _evolved(cost: Objective, starts: np.ndarray, seed: int) -> np.ndarray:
    """Best point of a differential evolution that begins at draws from the prior."""
    many = jax.jit(jax.vmap(cost))

    def costs(vectors: np.ndarray) -> np.ndarray:
        return np.nan_to_num(np.asarray(many(jnp.asarray(vectors.T))), nan=np.inf)

    width = np.ptp(starts, axis=0)
    bounds = list(zip(starts.min(0) - width, starts.max(0) + width, strict=True))
    best = differential_evolution(
        costs,
        bounds,
        init=starts,
        vectorized=True,
        updating="deferred",
        polish=False,
        rng=seed,
        maxiter=300,
    )
    return best.x[None]


def _warnings(flat: bool, k: float, reached: int, of: int) -> tuple[str, ...]:
    warnings = []
    if flat:
        warnings.append(
            "The posterior is flat at its maximum, or the maximum lies at the edge of a prior, so "
            "the Laplace covariance means nothing in that direction; use engines.SMC()."
        )
    if k > GOOD_PARETO_K and not flat:
        warnings.append(
            f"The posterior is not near the Gaussian of Laplace's method: Pareto k = {k:.2f} is "
            f"above {GOOD_PARETO_K}; its mode stands, its spread and evidence do not, so use "
            "engines.SMC()."
        )
    if of > 1 and reached == 1:
        warnings.append(
            f"Only one of {of} starts reached the best point found, so a better one may exist; use "
            "more starts, MAP(starts=128)."
        )
    return tuple(warnings)
