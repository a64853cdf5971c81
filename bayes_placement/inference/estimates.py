"""Mean, spread and their standard errors, from draws of a number with weights or in chains."""

from collections.abc import Mapping
from types import ModuleType
from typing import Any, NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

LogWeights = Float[Array | np.ndarray, "..."]
Number: TypeAlias = float | int | Array | np.ndarray

Given: TypeAlias = Mapping[str, Number]
"""Values by name, arrays as a whole or element by element."""

GOOD_PARETO_K = 0.7
"""Largest shape of the tail of importance weights at which estimates can be trusted.

Vehtari et al., Pareto smoothed importance sampling, J. Mach. Learn. Res. 25 (2024).
"""

LEAST_WEIGHTS = 25
"""Fewest weights that have a tail of five, which the fit of its shape needs."""

LEAST_NODES = 2.5
"""Least effective number of nodes along a coordinate that resolves an integral.

Nodes a distance d apart integrate a bell of standard deviation 0.7 d to a relative error of 1e-4,
and 2 sqrt(pi) 0.7 = 2.5 of them are effective under it.
"""


def effective_size(log_weight: LogWeights) -> Number:
    """Effective number of draws or nodes of these weights, which need not sum to one.

    The square of the sum of the weights over the sum of their squares (Kish).
    """
    # Of known weights by NumPy, which compiles nothing for each of their numbers.
    module: ModuleType = jnp if isinstance(log_weight, jax.core.Tracer) else np
    weight = module.exp(log_weight - module.max(log_weight))
    return module.sum(weight) ** 2 / module.sum(weight**2)


def pareto_k(log_weight: LogWeights) -> float:
    """Shape of the tail of the weights; above `GOOD_PARETO_K` estimates cannot be trusted.

    Zero for equal weights, which have no tail; infinite where there are too few, or nearly all of
    them vanish, so that no tail is left to be fitted.
    """
    finite = np.asarray(log_weight)[np.isfinite(log_weight)]
    if finite.size < LEAST_WEIGHTS:
        return float("inf")
    if np.ptp(finite) < 1e-6:
        return 0.0
    with np.errstate(all="ignore"):  # a tail of zeros divides by zero
        k = float(_statistics().psislw(-finite)[1])  # it takes log likelihoods left out
    return k if np.isfinite(k) else float("inf")


class Weighting(NamedTuple):
    """Weights of draws [chain, draw], and which of them depend on each other."""

    log_weight: np.ndarray | None = None
    """Logs of weights that sum to one, or None for equal weights."""
    lineage: np.ndarray | None = None
    """Number of the family of dependent draws that each belongs to, or None."""
    exact: bool = False
    """The draws are nodes of a quadrature: sums over them have no sampling error."""


class Figures(NamedTuple):
    """Mean, standard deviation and coefficient of variation with standard errors, diagnostics."""

    mean: float
    mean_error: float
    sd: float
    sd_error: float
    cv: float
    cv_error: float
    ess: float
    r_hat: float


def figures(values: np.ndarray, weighting: Weighting) -> Figures:
    """Figures of one number from its draws [chain, draw].

    Errors follow from the influence of each draw on the figure, summed by weight (independent
    draws), by family (populations that descend from common particles) or with the
    autocorrelation of the chain.
    """
    weight = _weights(values, weighting)
    mean = float(np.sum(weight * values))
    centred = values - mean
    sd = float(np.sqrt(np.sum(weight * centred**2)))
    on_sd = (centred**2 - sd**2) / (2 * sd) if sd > 0 else np.zeros_like(centred)
    size = abs(mean) if mean != 0 else float("nan")
    on_cv = on_sd / size - np.sign(mean) * sd * centred / size**2
    mean_error, sd_error = (standard_error(part, weighting) for part in (centred, on_sd))
    cv_error = standard_error(on_cv, weighting) if mean != 0 else float("nan")
    ess, r_hat = _ess(values, sd, mean_error, weighting), _r_hat(values, weighting)
    return Figures(mean, mean_error, sd, sd_error, sd / size, cv_error, ess, r_hat)


def standard_error(influence: np.ndarray, weighting: Weighting) -> float:
    """Standard error of a mean whose draws [chain, draw] have this influence, of mean zero."""
    if weighting.exact:
        return 0.0
    if weighting.log_weight is None and weighting.lineage is None:
        return float(_statistics().mcse(influence)) if np.ptp(influence) > 0 else 0.0
    shares = _weights(influence, weighting) * influence
    if weighting.lineage is None:
        return float(np.sqrt(np.sum(shares**2)))
    families = np.unique(weighting.lineage, return_inverse=True)[1].ravel()
    return float(np.sqrt(np.sum(np.bincount(families, shares.ravel()) ** 2)))


def _weights(values: np.ndarray, weighting: Weighting) -> np.ndarray:
    if weighting.log_weight is None:
        return np.full(values.shape, 1 / values.size)
    return np.exp(weighting.log_weight)


def _ess(values: np.ndarray, sd: float, error: float, weighting: Weighting) -> float:
    if weighting.log_weight is not None:
        return float(effective_size(weighting.log_weight))
    if weighting.lineage is None:
        return float(_statistics().ess(values)) if np.ptp(values) > 0 else float("nan")
    return float((sd / error) ** 2) if error > 0 else float("nan")


def _r_hat(values: np.ndarray, weighting: Weighting) -> float:
    in_chains = weighting.log_weight is None and values.shape[0] > 1
    return float(_statistics().rhat(values)) if in_chains and np.ptp(values) > 0 else float("nan")


def scalars(name: str, values: Array | np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Split draws [chain, draw, ...] of an array into draws of named numbers."""
    array = np.asarray(values)
    if array.ndim == 2:
        return [(name, array)]
    flat = array.reshape(*array.shape[:2], -1)
    return [(f"{name}[{i}]", flat[..., i]) for i in range(flat.shape[-1])]


def from_scalars(shapes: Mapping[str, tuple[int, ...]], values: Given) -> dict[str, Number]:
    """Values by name, the elements of an array put together where they come one by one.

    Shapes are those that are needed; of an array there are all values together, or each element by
    its name: `structure.damping.ratio[0]`.
    """
    return {name: _value(name, shape, values) for name, shape in shapes.items()}


def _value(name: str, shape: tuple[int, ...], values: Given) -> Number:
    if not shape or name in values:
        return values[name]
    count = int(np.prod(shape))
    return np.array([values[f"{name}[{number}]"] for number in range(count)]).reshape(shape)


def _statistics() -> Any:
    from arviz_stats.base import array_stats  # it takes long to import

    return array_stats
