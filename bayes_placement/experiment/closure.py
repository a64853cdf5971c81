"""What hangs on ports closes the receptance: the one formula for everything attached or inserted.

H' = H_oi - H_op Z (I + H_pp Z)^-1 H_pi with Z = N / D on the ports, one after the other, the last
one first, which is block elimination (Sherman and Morrison, Ann. Math. Stat. 21 (1950) 124).
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Inexact

from ..modes.ports import PortLaw

Matrix = Complex[Array, "response reference frequency"]
"""Receptance [m/N] between response and reference points, of which the last are ports."""

Closed = Complex[Array, "fewer_responses fewer_references frequency"]
"""The same between all but the ports that were closed."""

ONE_BY_ONE = 4
"""Most ports of one law that are closed one after the other; more are closed by one solution."""


def closed(matrix: Matrix, law: PortLaw) -> Closed:
    """Receptance between all but the last points, the ports on which a law hangs."""
    if law.points.count > ONE_BY_ONE:
        return _closed_at_once(matrix, law)
    single = jnp.ndim(law.numerator) < 2
    for port in reversed(range(law.points.count)):
        numerator = law.numerator if single else law.numerator[port]
        denominator = law.denominator if single else law.of_each()[1][port]
        matrix = closed_at_last(matrix, numerator, denominator)
    return matrix


def closed_at_last(
    matrix: Matrix,
    numerator: Inexact[Array, "*#frequency"],
    denominator: Inexact[Array, "*#frequency"] | float = 1.0,
) -> Closed:
    """Receptance between all points but the last, a port with a stiffness N / D [N/m]."""
    resisting = denominator + numerator * matrix[-1, -1]
    if isinstance(denominator, float):
        share = numerator * reciprocal(resisting)
    else:  # what is cheap XLA computes again for each element of the matrix; a division is not
        share = numerator / resisting
    return matrix[:-1, :-1] - matrix[:-1, -1, None] * share * matrix[-1, None, :-1]


def _closed_at_once(matrix: Matrix, law: PortLaw) -> Closed:
    """All ports by one solution of (D + N H_pp) x = N H_pi at each line."""
    ports = law.points.count
    numerator, denominator = law.of_each()
    by_line = jnp.moveaxis(matrix, -1, 0)
    driven = numerator.T[:, :, None] * by_line[:, -ports:, :]
    inner = driven[:, :, -ports:] + jax.vmap(jnp.diag)(denominator.T)
    force = jnp.linalg.solve(inner, driven[:, :, :-ports])
    return jnp.moveaxis(by_line[:, :-ports, :-ports] - by_line[:, :-ports, -ports:] @ force, 0, -1)


def reciprocal(value: Inexact[Array, "*shape"]) -> Inexact[Array, "*shape"]:
    """One over a number; of a complex one without the scaling that takes most of a division.

    Dynamic stiffness is far from the ends of the range of numbers, so that squares are safe.
    """
    if not jnp.iscomplexobj(value):
        return 1 / value
    real, imaginary = jnp.real(value), jnp.imag(value)
    over_square = 1 / (real * real + imaginary * imaginary)
    return jax.lax.complex(real * over_square, -imaginary * over_square)


def in_series(
    laws: Sequence[PortLaw], flexibility: Inexact[Array, "port port"]
) -> Inexact[Array, "port port"]:
    """Dynamic stiffness at one line in series with the flexibility R of the modes left out.

    (1 + Z R)^-1 Z is (D + N R)^-1 N.
    """
    pairs = [law.of_each() for law in laws]
    numerator, denominator = (jnp.concatenate(parts)[:, 0] for parts in zip(*pairs, strict=True))
    factor = jnp.diag(denominator) + numerator[:, None] * flexibility
    return jnp.linalg.solve(factor, jnp.diag(numerator) + 0 * factor)
