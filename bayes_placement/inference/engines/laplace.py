"""Laplace's approximation: a Gaussian about the mode of a posterior."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

LEAST_CURVATURE = 1e-8
"""Least curvature, over the greatest, below which a direction counts as flat."""


class Laplace(NamedTuple):
    """Gaussian about a mode."""

    mode: Float[np.ndarray, "unknown"]
    """Its mean [unknown]."""
    root: Float[np.ndarray, "unknown unknown"]
    """Factor of its covariance, root @ root.T [unknown, unknown]."""
    is_flat: bool
    """Whether the posterior is flat along some direction, where the Gaussian means nothing."""

    @property
    def covariance(self) -> Float[np.ndarray, "unknown unknown"]:
        """Covariance."""
        return self.root @ self.root.T

    @property
    def log_volume(self) -> float:
        """Log of the integral of a Gaussian of height one."""
        return 0.5 * self.mode.size * np.log(2 * np.pi) + float(np.linalg.slogdet(self.root)[1])

    def widened(self, factor: float) -> "Laplace":
        """Return the Gaussian with standard deviations that are so many times as large."""
        return self._replace(root=factor * self.root)

    def points(
        self, normal: Float[np.ndarray, "draw unknown"]
    ) -> Float[np.ndarray, "draw unknown"]:
        """Draws, from standard normal ones."""
        return self.mode + normal @ self.root.T

    def log_density(self, normal: Float[np.ndarray, "draw unknown"]) -> Float[np.ndarray, "draw"]:
        """Log density of the draws that standard normal ones give."""
        return -0.5 * np.einsum("di,di->d", normal, normal) - self.log_volume


def laplace(
    mode: Float[np.ndarray, "unknown"],
    curvature: Float[np.ndarray, "unknown unknown"],
    least_share: float = LEAST_CURVATURE,
) -> Laplace:
    """Gaussian of the curvature of minus the log posterior density at its mode.

    The least share is the least curvature, over the greatest, that is more than rounding.
    """
    if not np.isfinite(curvature).all():
        return Laplace(mode, np.full(curvature.shape, np.nan), True)
    values, vectors = np.linalg.eigh(curvature)
    least = least_share * values.max(initial=0.0)
    covariance = (vectors / np.maximum(values, least)) @ vectors.T
    return Laplace(mode, np.linalg.cholesky(covariance), bool(np.any(values < least)))
