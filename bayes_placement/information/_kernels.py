"""_kernels: in, outputs of many placements; out, the log of their density at the measured ones.

Not known here: where the outputs come from. Eqs. (29) and (31) of the paper with one bandwidth for
each component, as in `marginals.KDE`, laid out for speed: placements last.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from .._kernel_density import SHRINKAGE


class Kernel(NamedTuple):
    """Relative width of Gaussian kernels, and how far their centres are shrunk to their mean."""

    width: float
    shrinkage: float


def kernel(name: str, draws: int, components: int) -> Kernel:
    """Kernel for so many draws of so many outputs."""
    factor = (4 / (draws * (components + 2))) ** (1 / (components + 4))
    width, shrinkage = SHRINKAGE[name](factor, draws)
    return Kernel(float(width), float(shrinkage))


def log_density(
    outputs: Float[Array, "*output place"],
    measured: Float[Array, "*output"],
    variance: Float[Array, "*output"],
    own: Kernel,
) -> Float[Array, ""]:
    """Log of the kernel density estimate at the measured outputs.

    Parameters
    ----------
    outputs
        Outputs of the draws.
    measured
        Where the density is wanted.
    variance
        Variance of the output error, zero for none.
    own
        Kernel.
    """
    # Differences from what was measured: single precision is lost on the level otherwise.
    apart = outputs - measured[..., None]
    draws = apart.shape[-1]
    # Means as products with a vector: XLA sums along the last axis one number after the other.
    share = jnp.full(draws, 1 / draws, apart.dtype)
    mean = (apart @ share)[..., None]
    square = ((apart - mean) ** 2 @ share)[..., None] * (draws / (draws - 1))
    total = own.width**2 * square + variance[..., None]
    scale = jnp.sqrt(total)
    missed = (mean + own.shrinkage * (apart - mean)) / scale
    outer = tuple(range(missed.ndim - 1))
    terms = -0.5 * jnp.sum(missed**2, axis=outer)
    volume = jnp.sum(jnp.log(scale)) + 0.5 * jnp.log(2 * jnp.pi).astype(scale.dtype) * scale.size
    most = jnp.max(terms)
    return jnp.log(jnp.exp(terms - most) @ share) + most - volume
