"""_kernels: in, outputs of many placements; out, the log of their density at the measured ones.

Not known here: where the outputs come from. Eqs. (29) and (31) of the paper with one bandwidth for
each component, as in `marginals.KDE`, laid out for speed: placements last.
"""

import functools
import operator
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ...inference.marginals.kernel_density import Kernel

MOST_LANES = 128
"""Sums that are formed side by side, at most."""

MOST_TERMS = 32
"""Outputs, at most, whose squares are added term by term, four times as fast as by a reduction."""


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
    draws = outputs.shape[-1]
    # Differences from what was measured: single precision is lost on the level otherwise.
    apart = outputs.reshape(-1, draws) - measured.ravel()[:, None]
    # Read twice below: once is enough for whatever computes it.
    apart = jax.lax.optimization_barrier(apart)
    mean, square = _moments(apart)
    scale = jnp.sqrt(own.width**2 * square + variance.ravel())
    slope, level = own.shrinkage / scale, (1 - own.shrinkage) * mean / scale
    terms = -0.5 * _distance(slope[:, None] * apart + level[:, None])
    volume = jnp.sum(jnp.log(scale)) + 0.5 * jnp.log(2 * jnp.pi).astype(scale.dtype) * scale.size
    most = jnp.max(_lanes(terms).max(axis=0))
    return jnp.log(_lanes(jnp.exp(terms - most)).sum(axis=0).sum() / draws) + most - volume


def _moments(
    values: Float[Array, "output place"],
) -> tuple[Float[Array, "output"], Float[Array, "output"]]:
    """Mean and variance over the draws, in one go."""
    draws = values.shape[-1]
    # From one of the draws: sums of squares about a far point would lose the variance.
    first = values[:, :1]
    one, two = _both_sums(_lanes(values - first))
    mean = one.sum(axis=-1) / draws
    return mean + first[:, 0], (two.sum(axis=-1) - draws * mean**2) / (draws - 1)


def _both_sums(
    lanes: Float[Array, "output step lane"],
) -> tuple[Float[Array, "output lane"], Float[Array, "output lane"]]:
    """Sums of values and of their squares over the steps."""
    zero = jnp.zeros((), lanes.dtype)

    def add(left: Any, right: Any) -> Any:
        return left[0] + right[0], left[1] + right[1]

    return tuple(jax.lax.reduce((lanes, lanes**2), (zero, zero), add, (lanes.ndim - 2,)))


def _distance(missed: Float[Array, "output place"]) -> Float[Array, "place"]:
    """Sum of squares over the outputs."""
    if len(missed) > MOST_TERMS:
        return jnp.sum(missed**2, axis=0)
    return functools.reduce(operator.add, [one**2 for one in missed])


def _lanes(values: Float[Array, "*output place"]) -> Float[Array, "*output step lane"]:
    """Draws in lanes: XLA adds along the last axis one number after the other."""
    draws = values.shape[-1]
    lanes = max(count for count in range(1, MOST_LANES + 1) if draws % count == 0)
    return values.reshape(*values.shape[:-1], draws // lanes, lanes)
