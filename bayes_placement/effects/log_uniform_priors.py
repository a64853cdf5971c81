"""Sizes that can be negative, what was removed or comes too early: priors of them, and words."""

import math

from numpyro.distributions import Distribution, TransformedDistribution, Uniform
from numpyro.distributions.transforms import AffineTransform, ExpTransform

from .._shared.ranges import SinhTransform


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
