"""Kernel density estimate of the outputs at the measured ones, laid out for speed.

Eqs. (29) and (31) of the paper with one bandwidth for each output, as in `marginals.KDE`; draws of
the placement are the last axis.
"""

import functools
import operator

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...inference.marginals.kernel_density import Kernel

MOST_LANES = 32
"""Sums that are formed side by side, at most."""

MOST_TERMS = 32
"""Outputs, at most, whose squares are added term by term, four times as fast as by a reduction."""


def log_density(
    outputs: Float[Array, "*output draw"],
    measured: Float[Array, "*output"],
    variance: Float[Array, "*output"],
    kernel: Kernel,
) -> Float[Array, ""]:
    """Log of the kernel density estimate at the measured outputs.

    The variance is that of the output error, zero for none.
    """
    draws = outputs.shape[-1]
    # Differences from what was measured: single precision is lost on the level otherwise.
    residual = outputs.reshape(-1, draws) - measured.ravel()[:, None]
    # Read twice below, but to be computed once.
    residual = jax.lax.optimization_barrier(residual)
    mean, spread = _moments(residual)
    scale = jnp.sqrt(kernel.width**2 * spread + variance.ravel())
    slope, level = kernel.shrinkage / scale, (1 - kernel.shrinkage) * mean / scale
    terms = -0.5 * _sum_of_squares(slope[:, None] * residual + level[:, None])
    volume = jnp.sum(jnp.log(scale)) + 0.5 * jnp.log(2 * jnp.pi).astype(scale.dtype) * scale.size
    greatest = jnp.max(_lanes(terms).max(axis=0))
    return jnp.log(_lanes(jnp.exp(terms - greatest)).sum(axis=0).sum() / draws) + greatest - volume


def _moments(
    values: Float[Array, "output draw"],
) -> tuple[Float[Array, "output"], Float[Array, "output"]]:
    """Mean and variance over the draws, in one pass."""
    draws = values.shape[-1]
    # From the first draw: sums of squares about a far point would lose the variance.
    first = values[:, :1]
    sums, squares = _sums_and_squares(_lanes(values - first))
    mean = sums.sum(axis=-1) / draws
    return mean + first[:, 0], (squares.sum(axis=-1) - draws * mean**2) / (draws - 1)


def _sums_and_squares(
    lanes: Float[Array, "output step lane"],
) -> tuple[Float[Array, "output lane"], Float[Array, "output lane"]]:
    """Sums of values and of their squares over the steps."""
    zero = jnp.zeros((), lanes.dtype)

    def add(first: tuple[Array, Array], second: tuple[Array, Array]) -> tuple[Array, Array]:
        return first[0] + second[0], first[1] + second[1]

    return tuple(jax.lax.reduce((lanes, lanes**2), (zero, zero), add, (lanes.ndim - 2,)))


def _sum_of_squares(values: Float[Array, "output draw"]) -> Float[Array, "draw"]:
    """Sum of squares over the outputs."""
    if len(values) > MOST_TERMS:
        return jnp.sum(values**2, axis=0)
    return functools.reduce(operator.add, [row**2 for row in values])


def _lanes(values: Float[Array, "*output draw"]) -> Float[Array, "*output step lane"]:
    """Draws in lanes: XLA adds along the last axis one number after the other."""
    draws = values.shape[-1]
    lanes = max(count for count in range(1, MOST_LANES + 1) if draws % count == 0)
    return values.reshape(*values.shape[:-1], draws // lanes, lanes)
