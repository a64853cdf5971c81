"""Cosine and sine; of many phases at once nine times as fast as those of the compiler.

In double precision it has no vectors for these and calls a function for each number. Polynomials
become vectors, but take longer to compile, which is worth it in maps of information alone.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

Phase = Float[Array, "*phase"]
Pair = tuple[Phase, Phase]

_HIGH, _LOW = float.fromhex("0x1.921fb544p+0"), float.fromhex("0x1.0b4611a626331p-34")
"""A quarter of a period in two parts: small multiples of the first one are exact."""

_TERMS = [(-1) ** (order // 2) / math.factorial(order) for order in range(18)]
"""Taylor's series of both. What is left of it within an eighth of a period is below 1e-17."""

_MANY: ContextVar[bool] = ContextVar("many_phases", default=False)


@contextmanager
def many_phases() -> Iterator[None]:
    """Let what is traced meanwhile compute cosines and sines of many phases at once."""
    token = _MANY.set(True)
    try:
        yield
    finally:
        _MANY.reset(token)


def cosine_and_sine(phase: Phase) -> Pair:
    """Cosine and sine of a phase [rad]."""
    return _by_polynomials(phase) if _MANY.get() else (jnp.cos(phase), jnp.sin(phase))


@jax.custom_jvp
def _by_polynomials(phase: Phase) -> Pair:
    """Both within 3e-16, for up to thousands of periods."""
    quarters = jnp.round(phase / (math.pi / 2))
    rest = (phase - quarters * _HIGH) - quarters * _LOW
    even = _polynomial(_TERMS[0::2], rest**2)
    odd = rest * _polynomial(_TERMS[1::2], rest**2)
    turned = quarters - 4 * jnp.floor(quarters / 4)  # 0, 1, 2 or 3
    is_odd = (turned == 1) | (turned == 3)
    cosine, sine = jnp.where(is_odd, odd, even), jnp.where(is_odd, even, odd)
    return (
        jnp.where((turned == 1) | (turned == 2), -cosine, cosine),
        jnp.where(turned >= 2, -sine, sine),
    )


@_by_polynomials.defjvp
def _slopes(primals: tuple[Phase], tangents: tuple[Phase]) -> tuple[Pair, Pair]:
    (change,) = tangents
    cosine, sine = _by_polynomials(*primals)
    return (cosine, sine), (-sine * change, cosine * change)


def _polynomial(terms: list[float], x: Phase) -> Phase:
    total = jnp.full_like(x, terms[-1])
    for term in reversed(terms[:-1]):
        total = total * x + term
    return total
