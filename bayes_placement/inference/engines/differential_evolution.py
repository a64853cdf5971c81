"""Differential evolution from a population of starts (Storn and Price 1997)."""

from collections.abc import Callable

import numpy as np

from .least_squares import ParameterPoints

GENERATIONS = 300
"""Most generations."""


def evolved(
    costs: Callable[[ParameterPoints], np.ndarray], starts: ParameterPoints, seed: int
) -> np.ndarray:
    """Return the point of the least cost that a population reaches [unknown].

    A cost that is not a number counts as infinite. Points stay within a width of the first
    population on either side.
    """
    width = np.ptp(starts, axis=0)
    from scipy import optimize  # it takes long to import

    best = optimize.differential_evolution(
        lambda vectors: np.nan_to_num(costs(vectors.T), nan=np.inf),
        list(zip(starts.min(0) - width, starts.max(0) + width, strict=True)),
        init=starts,
        vectorized=True,
        updating="deferred",
        polish=False,
        rng=seed,
        maxiter=GENERATIONS,
    )
    return best.x
