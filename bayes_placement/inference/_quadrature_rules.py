"""Nodes and weights that integrate over distributions; one over finitely many values is summed."""

import functools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Shaped
from numpyro.distributions import Distribution

from .._shared.compiled import compiled
from .._shared.errors import InfeasibleError
from .._shared.sites import is_finite

Interval = tuple[float, float]
"""Part of a distribution, by its cumulative probabilities."""

ALL: Interval = (0.0, 1.0)

AtNodes = Float[Array, "node"]

legendre = functools.cache(np.polynomial.legendre.leggauss)
"""Nodes are the eigenvalues of a matrix: these are found once for each number of nodes."""


class ProductRule(NamedTuple):
    """Every combination of the nodes of several distributions, the last running fastest."""

    values: dict[str, Shaped[Array, "node"]]
    log_weight: Float[Array, "node"]


def product_rule(
    distributions: Mapping[str, Distribution],
    nodes: int,
    intervals: Sequence[Interval] | None = None,
) -> ProductRule:
    """Lay out the nodes of independent distributions.

    `nodes` are Gauss nodes of each continuous one, over all of it or over its interval.
    """
    pairs = zip(distributions.values(), intervals or [ALL] * len(distributions), strict=True)
    rules = [rule(distribution, nodes, interval) for distribution, interval in pairs]
    grids, log_weight = compiled(_product)(tuple(rules))
    return ProductRule(dict(zip(distributions, grids, strict=True)), log_weight)


def _product(rules: Sequence[tuple[Array, Array]]) -> tuple[list[Array], Array]:
    """Every combination of the nodes of some rules, the last one fastest; logs of weights."""
    grids = jnp.meshgrid(*(node for node, _ in rules), indexing="ij")
    weights = jnp.meshgrid(*(jnp.log(weight) for _, weight in rules), indexing="ij")
    return [grid.ravel() for grid in grids], sum(weights, jnp.zeros(())).ravel()


def rule(
    distribution: Distribution, nodes: int, interval: Interval = ALL
) -> tuple[Shaped[Array, "node"], Float[Array, "node"]]:
    """Nodes and weights that integrate over the distribution of one variable.

    It is over finitely many values, or has an inverse cumulative distribution function: then these
    are Gauss-Legendre nodes in probability, over all of it or an interval.
    """
    if distribution.shape() != ():
        raise InfeasibleError(
            "Quadrature needs scalar unknowns, but one of the unknowns has the shape "
            f"{distribution.shape()}. Declare its components one by one, or use "
            "marginals.Latent() with engines.SMC()."
        )
    if is_finite(distribution):
        values = distribution.enumerate_support(expand=False)
        return values, compiled(_probabilities)(distribution, values)
    node, weight = legendre(nodes)
    try:
        share = (interval[1] - interval[0]) / 2
        probability = interval[0] + share * (node + 1)
        return compiled(type(distribution).icdf)(distribution, probability), jax.device_put(
            weight * share
        )
    except (NotImplementedError, ImportError) as error:  # some inverses need TensorFlow
        raise InfeasibleError(
            "Quadrature needs the inverse distribution function of each unknown, which "
            f"{type(distribution).__name__} lacks. Use marginals.Latent() with engines.SMC() or "
            "NUTS()."
        ) from error


def _probabilities(distribution: Distribution, values: Shaped[Array, "node"]) -> AtNodes:
    return jnp.exp(distribution.log_prob(values))


def node_count(distribution: Distribution, nodes: int) -> int:
    """Number of nodes of a distribution."""
    finite = is_finite(distribution)
    return len(distribution.enumerate_support(expand=False)) if finite else nodes
