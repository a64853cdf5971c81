"""Decimal logarithm, in single precision in less than half of the time that the compiler takes.

Maps of information are mostly logarithms of single precision.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.polynomial import Chebyshev, Polynomial

DEGREE = 8
"""Degree of the polynomial, by which the result is right within three units of rounding."""

MANTISSA_BITS = 23
_HALF_OCTAVE = np.sqrt(0.5).astype(np.float32).view(np.int32)
_EXPONENT = np.int32(-(1 << MANTISSA_BITS))
_TINY = np.finfo(np.float32).tiny


def log10(value: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Decimal logarithm of positive numbers; minus infinity of zero and, if single, next to it."""
    return _log10_of_single(value) if value.dtype == jnp.float32 else jnp.log10(value)


@jax.custom_jvp
def _log10_of_single(value: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    bits = jax.lax.bitcast_convert_type(value, jnp.int32)
    # The number is 2^n (1 + t), t about zero: n in the upper bits is taken away.
    exponent = (bits - _HALF_OCTAVE) & _EXPONENT
    beyond_one = jax.lax.bitcast_convert_type(bits - exponent, jnp.float32) - 1
    series = jnp.full_like(beyond_one, _SERIES[-1])
    for term in _SERIES[-2::-1]:
        series = series * beyond_one + term
    octaves = exponent.astype(jnp.float32) * np.float32(np.log10(2) / 2**MANTISSA_BITS)
    result = beyond_one * series + octaves
    positive = jnp.where(value >= _TINY, result, -jnp.inf)
    return jnp.where(value < jnp.inf, positive, value)  # infinite, or NaN


@_log10_of_single.defjvp
def _slope(primals: Any, tangents: Any) -> Any:
    (value,), (change,) = primals, tangents
    return _log10_of_single(value), change / (value * np.float32(np.log(10)))


def _series() -> Float[np.ndarray, "term"]:
    """Polynomial for log10(1 + t) / t, from the root of 1/2 to that of 2."""
    interval = [np.sqrt(0.5) - 1, np.sqrt(2.0) - 1]
    ratio = Chebyshev.interpolate(lambda t: np.log1p(t) / (t * np.log(10)), DEGREE, interval)
    return ratio.convert(kind=Polynomial).coef.astype(np.float32)


_SERIES = _series()
