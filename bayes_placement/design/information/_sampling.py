"""Random points of unknowns, in replicates that are independent of each other.

The spread between replicates gives the error of an estimate from the points.
"""

from collections.abc import Callable
from typing import TypeAlias

import jax
import numpy as np
from jaxtyping import Array
from numpyro.distributions import Distribution
from scipy.special import ndtri

from ..._shared.errors import InputError
from ...inference.coordinates import Coordinates

SAMPLINGS = ("sobol", "plain")
"""Scrambled Sobol points, or independent draws as in the paper."""

Priors: TypeAlias = dict[str, Distribution]

_EDGE = 1e-12  # nearest probability to 0 and 1


def scores(sampling: str, replicates: int, count: int, dimension: int, seed: int) -> np.ndarray:
    """Standard normal scores [replicate, point, unknown].

    Sobol points have at most 21,201 coordinates; all further ones are independent draws, which
    leaves the estimate right and its error about that of independent draws.
    """
    check_sampling(sampling)
    random = np.random.default_rng(seed)
    if sampling == "plain" or dimension == 0:
        return random.standard_normal((replicates, count, dimension))
    return np.stack([_sobol(count, dimension, child) for child in random.spawn(replicates)])


def check_sampling(sampling: str) -> None:
    """Refuse a name of no sampling."""
    if sampling not in SAMPLINGS:
        raise InputError(
            f"sampling={sampling!r} was given; {' or '.join(map(repr, SAMPLINGS))} is needed: "
            "quasi-random points, whose error falls faster, or independent draws."
        )


def _sobol(count: int, dimension: int, random: np.random.Generator) -> np.ndarray:
    """Scores [point, unknown] of a scrambled Sobol sequence."""
    from scipy.stats import qmc  # it takes long to import

    sobol = min(dimension, qmc.Sobol.MAXDIM)
    power = int(np.ceil(np.log2(max(count, 2))))
    points = qmc.Sobol(sobol, rng=random).random_base2(power)[:count]
    normal = ndtri(np.clip(points, _EDGE, 1 - _EDGE))
    return np.hstack([normal, random.standard_normal((count, dimension - sobol))])


def values(distributions: Priors, normal: Array | np.ndarray) -> dict[str, Array]:
    """Values by name at scores [..., unknown]; the distributions may be traced."""
    function: Callable[..., dict[str, Array]] = Coordinates(distributions).values
    for _ in range(normal.ndim - 1):
        function = jax.vmap(function)
    return function(normal)


def dimension(distributions: Priors) -> int:
    """Number of scores that the distributions take."""
    return Coordinates(distributions).dimension


def draws_of_replicate(draws: int, replicates: int) -> int:
    """Draws of each replicate."""
    if replicates < 2 or draws // replicates < 2:
        raise InputError(
            f"draws={draws} in replicates={replicates} were given; at least two replicates of two "
            "draws are needed, since their spread gives the error of the estimate: "
            "KernelGain(draws=1000, replicates=4)."
        )
    return draws // replicates
