"""supports: in, a recorded place and a tolerance; out, the uniform law of where it may be.

Not known here: mode shapes, sensors, data. Also the Gauss quadrature of any law of one variable.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpyro.distributions import Distribution, Uniform

from ._types import InfeasibleError


class Segment(eqx.Module):
    """A stretch of a line structure: recorded place and what the glue may be off.

    Parameters
    ----------
    centre
        Recorded position along the structure [m].
    within
        Greatest deviation to either side [m]. The law is uniform, the least informative one
        (section 2.1 of the paper).
    """

    centre: float = eqx.field(static=True)
    within: float = eqx.field(static=True)

    def __init__(self, centre: float | int, *, within: float | int):
        self.centre = float(centre)
        self.within = float(within)
        if not self.within > 0:
            raise ValueError(
                f"Segment(within={within}) was given; a positive tolerance [m] is needed. For a "
                f"position known exactly, give the number itself: at={centre}."
            )

    def law(self, bounds: tuple[float, float]) -> Uniform:
        """Uniform law of the position [m], clipped to the structure.

        Raises
        ------
        ValueError
            If no part of the segment lies on the structure.
        """
        low = max(self.centre - self.within, bounds[0])
        high = min(self.centre + self.within, bounds[1])
        if not low < high:
            raise ValueError(
                f"Segment({self.centre}, within={self.within}) m has no point on the structure "
                f"({bounds[0]:g} to {bounds[1]:g} m)."
            )
        return Uniform(low, high)


def quadrature(
    law: Distribution, points: int, between: tuple[float, float] = (0.0, 1.0)
) -> tuple[Float[Array, "node"], Float[Array, "node"]]:
    """Nodes and weights that integrate over the law of one variable.

    Parameters
    ----------
    law
        A scalar distribution with an inverse cumulative distribution function.
    points
        Number of Gauss-Legendre nodes in probability.
    between
        Part of the law that is integrated, by its cumulative probabilities.

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
