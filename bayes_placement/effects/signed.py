"""Priors of negative sizes: what was removed, or is stiffer than assumed."""

import math

from numpyro.distributions import Distribution, TransformedDistribution, Uniform
from numpyro.distributions.transforms import AffineTransform, ExpTransform


def negative_log_uniform(least: float, greatest: float) -> Distribution:
    """Distribution of minus a log-uniform number between two positive ones."""
    logarithm = Uniform(math.log(least), math.log(greatest))
    return TransformedDistribution(logarithm, [ExpTransform(), AffineTransform(0.0, -1.0)])
