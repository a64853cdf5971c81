"""Sizes that can be negative, what was removed or comes too early: priors of them, and words."""

import math
from typing import Any

import jax.numpy as jnp
from numpyro.distributions import Distribution, TransformedDistribution, Uniform, constraints
from numpyro.distributions.transforms import AffineTransform, ExpTransform, ParameterFreeTransform


class SinhTransform(ParameterFreeTransform):
    """Hyperbolic sine of a real number."""

    domain = constraints.real
    codomain = constraints.real
    sign = 1

    def __call__(self, x: Any) -> Any:
        """Sinh x."""
        return jnp.sinh(x)

    def _inverse(self, y: Any) -> Any:
        return jnp.arcsinh(y)

    def log_abs_det_jacobian(self, x: Any, y: Any, intermediates: Any = None) -> Any:
        """Log cosh x."""
        return 0.5 * jnp.log1p(y**2)


def negative_log_uniform(least: float, greatest: float) -> Distribution:
    """Distribution of minus a log-uniform number between two positive ones."""
    logarithm = Uniform(math.log(least), math.log(greatest))
    return TransformedDistribution(logarithm, [ExpTransform(), AffineTransform(0.0, -1.0)])


def log_uniform_of_either_sign(least: float, low: float, high: float) -> Distribution:
    """Distribution of a number of either sign whose order of magnitude is not known.

    Its density, proportional to 1 / sqrt(x^2 + least^2), is flat where the size x is below the
    least that matters and log-uniform above. A uniform prior would leave next to nothing for a
    small size: any kind of effect with a log-uniform prior would be claimed in its place.
    """
    ends = Uniform(math.asinh(low / least), math.asinh(high / least))
    return TransformedDistribution(ends, [SinhTransform(), AffineTransform(0.0, least)])
