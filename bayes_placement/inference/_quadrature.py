"""_quadrature: in, laws of one variable; out, nodes and weights that integrate over them.

Not known here: what the variables are. A law over finitely many values is summed exactly.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Shaped
from numpyro.distributions import Distribution

from .._sites import is_finite
from .._types import InfeasibleError

Part = tuple[float, float]
WHOLE: Part = (0.0, 1.0)


class Tensor(NamedTuple):
    """Every combination of the nodes of several laws, the last law running fastest."""

    values: dict[str, Shaped[Array, "node"]]
    log_weight: Float[Array, "node"]


def tensor(
    laws: Mapping[str, Distribution], points: int, parts: Sequence[Part] | None = None
) -> Tensor:
    """Lay out the nodes of independent laws.

    Parameters
    ----------
    laws
        Scalar laws by name.
    points
        Gauss nodes for each continuous law.
    parts
        Part of each law, by its cumulative probabilities; the whole by default.

    Raises
    ------
    InfeasibleError
        If a law is no scalar or cannot be inverted.
    """
    pairs = zip(laws.values(), parts or [WHOLE] * len(laws), strict=True)
    rules = [rule(law, points, part) for law, part in pairs]
    grids = jnp.meshgrid(*(node for node, _ in rules), indexing="ij")
    weights = jnp.meshgrid(*(jnp.log(weight) for _, weight in rules), indexing="ij")
    values = {name: grid.ravel() for name, grid in zip(laws, grids, strict=True)}
    return Tensor(values, sum(weights, jnp.zeros(())).ravel())


def rule(
    law: Distribution, points: int, between: Part = WHOLE
) -> tuple[Shaped[Array, "node"], Float[Array, "node"]]:
    """Nodes and weights that integrate over the law of one variable.

    Parameters
    ----------
    law
        A scalar distribution, either over finitely many values or with an inverse cumulative
        distribution function.
    points
        Number of Gauss-Legendre nodes in probability.
    between
        Part of a continuous law that is integrated, by its cumulative probabilities.

    Raises
    ------
    InfeasibleError
        If the law is not a scalar or has no inverse cumulative distribution function.
    """
    if law.shape() != ():
        raise InfeasibleError(
            f"Quadrature needs scalar unknowns, but one has the shape {law.shape()}. "
            "Declare its components one by one, or use marginals.Latent()."
        )
    if is_finite(law):
        values = law.enumerate_support(expand=False)
        return values, jnp.exp(law.log_prob(values))
    node, weight = np.polynomial.legendre.leggauss(points)
    try:
        share = (between[1] - between[0]) / 2
        probability = between[0] + share * (node + 1)
        return law.icdf(jnp.asarray(probability)), jnp.asarray(weight * share)
    except (NotImplementedError, ImportError) as error:  # some inverses need TensorFlow
        raise InfeasibleError(
            f"Quadrature needs the inverse distribution function of a law, which "
            f"{type(law).__name__} lacks. Use marginals.Latent() with engines.SMC() or NUTS()."
        ) from error


def size(law: Distribution, points: int) -> int:
    """Number of nodes of a law."""
    return len(law.enumerate_support(expand=False)) if is_finite(law) else points
