"""Between what numbers quantities and priors can be, a field's own by `within=...`; quantiles."""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike
from numpyro.distributions import (
    Delta,
    Distribution,
    ExpandedDistribution,
    Independent,
    LogUniform,
    Normal,
    TransformedDistribution,
    Uniform,
    constraints,
)
from numpyro.distributions.transforms import AffineTransform, ExpTransform, ParameterFreeTransform
from scipy.special import ndtr, ndtri

from .compiled import compiled

IMPOSSIBLE = 1e-6
"""Probability that a prior may give to values that cannot be."""

ALIKE = (Independent, ExpandedDistribution)
"""Distributions that repeat another one."""


class Range(NamedTuple):
    """Between what numbers a quantity can be, and what is meant where it is not."""

    least: float
    most: float
    """The least and the greatest number that it can be."""
    reason: str
    """What is needed, for the error."""


POSITIVE = Range(0.0, np.inf, "it must be above zero")
NOT_NEGATIVE = Range(0.0, np.inf, "it must not be negative")
SHARE_OF_CRITICAL = Range(
    0.0, 1.0, "a damping ratio is a share of critical damping between 0 and 1, not percent: 0.05"
)
_SHARE_OF_STIFFNESS = "a loss factor is a share between 0 and 1 of the stiffness, not percent: 0.05"
LOSS_FACTOR = Range(0.0, 1.0, _SHARE_OF_STIFFNESS)
SIGNED_LOSS_FACTOR = Range(-1.0, 1.0, _SHARE_OF_STIFFNESS)
SHARE_OF_AMPLITUDE = Range(0.0, 1.0, "a ratio of noise is a share of the amplitude: 0.05 for 5 %")
SHARE_LOST = Range(-np.inf, 1.0, "no more than all is lost, a share and not percent: 0.2")
RELATIVE = Range(-0.9, 1.0, "a drift is a relative change, not percent: 0.05")
DELAY = Range(-1.0, 1.0, "a delay is in seconds, not ms: 1e-3")
ANGLE = Range(-np.pi, np.pi, "angles are in rad, not degrees: numpy.deg2rad(5.0)")
RATE = Range(-0.9, 1.0, "an error of a sampling rate is a relative one, not percent: 0.05")
ORDER = Range(0.0, 1.0, "an order is between that of a spring, 0, and that of a dashpot, 1")
CHANGE = Range(-0.9, 1.0, "a change of a modulus is a relative one, not percent: -0.02")
SIZE = Range(-0.5, 1.0, "an error of a dimension is a relative one, not percent: 0.05")


def described(prior: Distribution) -> str:
    """Write a distribution as its name and arguments, Uniform(0.02, 0.06), or as it was made."""
    if isinstance(prior, Independent):
        return described(prior.base_dist)
    if isinstance(prior, ExpandedDistribution):
        return f"{int(np.prod(prior.shape()))} {described(prior.base_dist)}"
    if type(prior) is TransformedDistribution:
        words = described(prior.base_dist)
        for transform in prior.transforms:
            words = _transformed(transform, words)
        return words
    values = [getattr(prior, name, None) for name in prior.arg_constraints]
    return f"{type(prior).__name__}({', '.join(_number(v) for v in values if v is not None)})"


def _transformed(transform: object, words: str) -> str:
    """Write a transform of what is described by words: -1 + exp(Normal(0, 1.5))."""
    if isinstance(transform, AffineTransform):
        location, scale = _number(transform.loc), _number(transform.scale)
        scaled = words if scale == "1" else f"{scale} {words}"
        return scaled if location == "0" else f"{location} + {scaled}"
    return f"{type(transform).__name__.removesuffix('Transform').lower()}({words})"


def _number(value: object) -> str:
    """Write a number, or the first and the last of several; `traced` where it has no value yet."""
    if isinstance(value, jax.core.Tracer):
        return "traced"
    words = [f"{number:.6g}" for number in np.ravel(np.asarray(value))]
    if len(set(words)) == 1:
        return words[0]
    return f"[{', '.join(words if len(words) < 4 else [words[0], '...', words[-1]])}]"


def reach(prior: Distribution) -> tuple[float, float]:
    """Least and greatest value of a prior, tails of a probability of 1e-6 left out.

    Infinite where they are not known, for want of a quantile function.
    """
    if isinstance(prior, Delta):
        return float(np.min(prior.v)), float(np.max(prior.v))
    low, high = ends(prior)
    if low == -np.inf:
        low = _quantile(prior, IMPOSSIBLE, low)
    return low, _quantile(prior, 1 - IMPOSSIBLE, high) if high == np.inf else high


def ends(prior: Distribution) -> tuple[float, float]:
    """Where a prior begins and ends; infinite on a side where it does not."""
    if isinstance(prior, Uniform | LogUniform):
        return float(np.min(prior.low)), float(np.max(prior.high))
    support = prior.support
    if isinstance(support, constraints.independent):
        support = support.base_constraint
    low = float(np.min(getattr(support, "lower_bound", -np.inf)))
    return low, float(np.max(getattr(support, "upper_bound", np.inf)))


def _quantile(prior: Distribution, probability: float, unknown: float) -> float:
    shares = np.array([[probability], [1 - probability]])
    first, last = (plain_quantile(prior, normal) for normal in ndtri(shares))
    if first is not None and last is not None:  # of a negative scale the upper end comes first
        return float(np.min([first, last]) if probability < 0.5 else np.max([first, last]))
    try:
        value = compiled(type(prior).icdf).bound(prior, probability, effort=0)()
        return float(np.asarray(value).flat[0])
    except (NotImplementedError, ImportError):  # some inverses need TensorFlow
        return unknown


class SinhTransform(ParameterFreeTransform):
    """Hyperbolic sine of a real number."""

    domain = constraints.real
    codomain = constraints.real
    sign = 1

    def __call__(self, x: ArrayLike) -> Array:
        """Sinh x."""
        return jnp.sinh(x)

    def _inverse(self, y: ArrayLike) -> Array:
        return jnp.arcsinh(y)

    def log_abs_det_jacobian(self, x: object, y: ArrayLike, intermediates: object = None) -> Array:
        """Log cosh x."""
        return 0.5 * jnp.log1p(y**2)


PLAIN = {ExpTransform: np.exp, SinhTransform: np.sinh}
"""Functions of NumPy that transforms are."""


def is_plain(transform: object) -> bool:
    """Tell whether a transform is computed by NumPy."""
    return isinstance(transform, AffineTransform) or type(transform) in PLAIN


def plain_quantile(distribution: Distribution, normal: np.ndarray) -> np.ndarray | None:
    """Values at standard normal coordinates; None for a distribution that is not common."""
    if isinstance(distribution, ALIKE):
        return plain_quantile(distribution.base_dist, normal)
    if isinstance(distribution, Normal):
        return np.asarray(distribution.loc) + np.asarray(distribution.scale) * normal
    if isinstance(distribution, Uniform):
        low, high = np.asarray(distribution.low), np.asarray(distribution.high)
        return low + (high - low) * ndtr(normal)
    if not isinstance(distribution, TransformedDistribution):
        return None
    value = plain_quantile(distribution.base_dist, normal)
    if value is None or not all(map(is_plain, distribution.transforms)):
        return None
    for transform in distribution.transforms:
        value = _transformed_value(transform, value)
    return value


def _transformed_value(transform: object, value: np.ndarray) -> np.ndarray:
    if isinstance(transform, AffineTransform):
        return np.asarray(transform.loc) + np.asarray(transform.scale) * value
    with np.errstate(over="ignore"):  # infinite far out, as by JAX
        return PLAIN[type(transform)](value)


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
