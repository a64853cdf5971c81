"""Density of outputs with unit errors, by normal kernels along the tangents of the response.

Outputs lie near a surface of as few dimensions as there are unknowns. Kernels in the space of the
outputs blur it; kernels in the space of the unknowns, carried along tangents, do not.
"""

from collections.abc import Callable
from typing import NamedTuple

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
