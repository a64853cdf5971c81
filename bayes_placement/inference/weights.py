"""How far weights may be trusted: effective number of draws or nodes, tail of the weights."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

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


def effective_size(log_weight: Any) -> Any:
    """Effective number of draws or nodes of these weights, which need not sum to one.

    The square of the sum of the weights over the sum of their squares (Kish).
    """
    # Of known weights by NumPy, which compiles nothing for each of their numbers.
    module: Any = jnp if isinstance(log_weight, jax.core.Tracer) else np
    weight = module.exp(log_weight - module.max(log_weight))
    return module.sum(weight) ** 2 / module.sum(weight**2)


def pareto_k(log_weight: Any) -> float:
    """Shape of the tail of the weights; above `GOOD_PARETO_K` estimates cannot be trusted.

    Zero for equal weights, which have no tail; infinite where there are too few, or nearly all of
    them vanish, so that no tail is left to be fitted.
    """
    finite = np.asarray(log_weight)[np.isfinite(log_weight)]
    if finite.size < LEAST_WEIGHTS:
        return float("inf")
    if np.ptp(finite) < 1e-6:
        return 0.0
    from arviz_stats.base import array_stats  # it takes long to import

    with np.errstate(all="ignore"):  # a tail of zeros divides by zero
        k = float(array_stats.psislw(-finite)[1])  # it takes log likelihoods left out
    return k if np.isfinite(k) else float("inf")
