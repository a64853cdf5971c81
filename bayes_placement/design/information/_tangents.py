"""_tangents: in, responses to unknown coordinates; out, the density of outputs with unit errors.

Kernels in the space of the coordinates, carried on to the outputs along tangents: outputs lie near
a surface of as few dimensions as there are unknowns, to which kernels in the space of the outputs
are blind. Not known here: what the coordinates are.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.linalg import cho_factor, cho_solve
from jax.scipy.special import logsumexp
from jaxtyping import Array, Float

from ...inference.marginals.kernel_density import silverman_width

BATCH = 32
"""Responses, and kernels, that are evaluated at once."""

STEP = 1e-4
"""Step along a coordinate of unit variance."""


class Kernels(NamedTuple):
    """Density of outputs whose errors have the variance one: kernels along tangents."""

    outputs: Float[Array, "kernel output"]
    slopes: Float[Array, "kernel output coordinate"]

    @classmethod
    def of(cls, respond: Callable[[Array], Array], drawn: Float[Array, "kernel coordinate"]) -> Any:
        """Kernels about draws, which are drawn together so that their covariance stays one."""
        count, dimension = drawn.shape
        width = min(1.0, silverman_width(count, dimension))
        centres = np.sqrt(1 - width**2) * drawn
        # By differences: derivatives of eigenproblems take minutes to compile.
        aside = centres[:, None] + STEP * jnp.eye(dimension)
        points = jnp.concatenate([centres[:, None], aside], axis=1)
        outputs = all_of(respond, points.reshape(count * (dimension + 1), dimension)).reshape(
            count, dimension + 1, -1
        )
        slopes = (outputs[:, 1:] - outputs[:, :1]) / STEP
        return cls(outputs[:, 0], width * jnp.swapaxes(slopes, 1, 2))

    def log_density(self, y: Float[Array, "data output"]) -> Float[Array, "data"]:
        """Log density but for a constant, each kernel by Woodbury's identity."""

        def one(kernel: tuple[Array, Array]) -> Float[Array, "data"]:
            centre, slope = kernel
            apart = y - centre
            return -0.5 * jnp.sum(apart**2, axis=1) + _along(apart, slope)

        each = jax.lax.map(one, (self.outputs, self.slopes), batch_size=BATCH)
        return logsumexp(each, axis=0) - jnp.log(len(self.outputs))


def _along(
    apart: Float[Array, "data output"], slope: Float[Array, "output coordinate"]
) -> Float[Array, "data"]:
    """What a kernel adds to the log density of errors alone, by Woodbury's identity."""
    if slope.shape[1] == 0:  # nothing is unknown; an empty matrix has no factors
        return jnp.zeros(len(apart))
    along = (apart @ slope).T
    factor = cho_factor(jnp.eye(len(along)) + slope.T @ slope, lower=True)
    explained = jnp.sum(along * cho_solve(factor, along), axis=0)
    return 0.5 * explained - jnp.sum(jnp.log(jnp.diag(factor[0])))


def all_of(respond: Callable[[Array], Array], points: Float[Array, "point coordinate"]) -> Array:
    """Response to each of several points."""
    return jax.lax.map(respond, points, batch_size=BATCH)
