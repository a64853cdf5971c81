"""Densities of outputs by kernels: along the tangents of the response, and about the outputs.

Outputs lie near a surface of as few dimensions as there are unknowns. Kernels in the space of the
outputs blur it; kernels in the space of the unknowns, carried along tangents, do not. Those about
the outputs are Eqs. (29) and (31) of the paper with one bandwidth for each output, as in
`marginals.KDE`, laid out for speed; draws of the placement are the last axis.
"""

import functools
import operator
from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import cho_factor, cho_solve
from jax.scipy.special import logsumexp
from jaxtyping import Array, Float

from ...inference.marginals.kde import Kernel, silverman_width

BATCH = 32
"""Responses, and kernels, that are evaluated at once."""

STEP = 1e-4
"""Step along a coordinate of unit variance."""


class TangentKernels(NamedTuple):
    """Density of outputs whose errors have unit variance."""

    outputs: Float[Array, "kernel output"]
    slopes: Float[Array, "kernel output coordinate"]

    @classmethod
    def of(
        cls, respond: Callable[[Array], Array], draws: Float[Array, "kernel coordinate"]
    ) -> "TangentKernels":
        """Kernels about draws, which are shrunk so that their covariance stays one."""
        count, dimension = draws.shape
        width = min(1.0, silverman_width(count, dimension))
        centres = np.sqrt(1 - width**2) * draws
        # By differences: derivatives of eigenproblems take minutes to compile.
        stepped = centres[:, None] + STEP * jnp.eye(dimension)
        points = jnp.concatenate([centres[:, None], stepped], axis=1)
        outputs = responses(respond, points.reshape(count * (dimension + 1), dimension)).reshape(
            count, dimension + 1, -1
        )
        slopes = (outputs[:, 1:] - outputs[:, :1]) / STEP
        return cls(outputs[:, 0], width * jnp.swapaxes(slopes, 1, 2))

    def log_density(self, y: Float[Array, "data output"]) -> Float[Array, "data"]:
        """Log density but for a constant, each kernel by Woodbury's identity."""

        def of_kernel(kernel: tuple[Array, Array]) -> Float[Array, "data"]:
            output, slope = kernel
            residual = y - output
            return -0.5 * jnp.sum(residual**2, axis=1) + _tangent_term(residual, slope)

        terms = jax.lax.map(of_kernel, (self.outputs, self.slopes), batch_size=BATCH)
        return logsumexp(terms, axis=0) - jnp.log(len(self.outputs))


def _tangent_term(
    residual: Float[Array, "data output"], slope: Float[Array, "output coordinate"]
) -> Float[Array, "data"]:
    """Change of the log density of the errors by the slope of a kernel, by Woodbury's identity."""
    if slope.shape[1] == 0:  # no unknown coordinate; an empty matrix has no factors
        return jnp.zeros(len(residual))
    tangential = (residual @ slope).T
    factor = cho_factor(jnp.eye(len(tangential)) + slope.T @ slope, lower=True)
    explained = jnp.sum(tangential * cho_solve(factor, tangential), axis=0)
    return 0.5 * explained - jnp.sum(jnp.log(jnp.diag(factor[0])))


def responses(respond: Callable[[Array], Array], points: Float[Array, "point coordinate"]) -> Array:
    """Response at each point."""
    return jax.lax.map(respond, points, batch_size=BATCH)


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
