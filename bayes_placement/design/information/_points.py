"""_points: in, the laws of some unknowns; out, points of their prior, several times over.

Not known here: what the unknowns are. Points come in replicates that are independent of each
other, so that the spread between them tells the error.
"""

from typing import Any

import jax
import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from ..._types import InfeasibleError, InputError
from ...inference.coordinates import Coordinates

KINDS = ("sobol", "plain")
"""Scrambled Sobol points, or independent draws as in the paper."""

_EDGE = 1e-12  # nearest probability to 0 and 1


def scores(kind: str, replicates: int, count: int, dimension: int, seed: int) -> np.ndarray:
    """Standard normal scores [replicate, point, unknown].

    Parameters
    ----------
    kind
        One of `KINDS`.
    replicates, count, dimension
        Replicates, points of each, and unknowns.
    seed
        Seed.

    Raises
    ------
    ValueError
        If there is no such kind.
    """
    if kind not in KINDS:
        raise InputError(
            f"sampling={kind!r} was given; {' or '.join(map(repr, KINDS))} is needed: quasi-random "
            "points, whose error falls faster, or independent draws."
        )
    rng = np.random.default_rng(seed)
    if kind == "plain" or dimension == 0:
        return rng.standard_normal((replicates, count, dimension))
    power = int(np.ceil(np.log2(max(count, 2))))
    drawn = [qmc.Sobol(dimension, rng=one).random_base2(power) for one in rng.spawn(replicates)]
    return ndtri(np.clip(np.stack(drawn)[:, :count], _EDGE, 1 - _EDGE))


def values(laws: dict[str, Any], normal: Any) -> dict[str, Any]:
    """Values by name at scores [..., unknown]; the laws may be traced.

    Raises
    ------
    InfeasibleError
        If a law has no inverse distribution function.
    """
    coordinates = Coordinates(laws)
    several: Any = coordinates.values
    for _ in range(normal.ndim - 1):
        several = jax.vmap(several)
    return several(normal)


def dimension(laws: dict[str, Any]) -> int:
    """Number of scores that the laws take."""
    return Coordinates(laws).dimension


def shares(count: int, replicates: int, what: str) -> int:
    """Points of each replicate.

    Raises
    ------
    InfeasibleError
        If there are too few.
    """
    if replicates < 2 or count // replicates < 2:
        raise InfeasibleError(
            f"{what}={count} points in replicates={replicates} were given; at least two "
            "replicates of two points are needed, since their spread is the error of the estimate."
        )
    return count // replicates
