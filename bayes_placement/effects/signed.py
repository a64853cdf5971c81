"""Negative sizes, what was removed or is stiffer than assumed: priors of them, and words."""

import math
from collections.abc import Mapping

from numpyro.distributions import Distribution, TransformedDistribution, Uniform
from numpyro.distributions.transforms import AffineTransform, ExpTransform


def negative_log_uniform(least: float, greatest: float) -> Distribution:
    """Distribution of minus a log-uniform number between two positive ones."""
    logarithm = Uniform(math.log(least), math.log(greatest))
    return TransformedDistribution(logarithm, [ExpTransform(), AffineTransform(0.0, -1.0)])


def where_negative(field: str, estimates: Mapping[str, tuple[float, float]], words: str) -> str:
    """Words on a field whose estimated mean is negative; empty where it is not."""
    return words if estimates.get(field, (0.0, 0.0))[0] < 0 else ""
