"""A waveguide, a uniform bar or beam: its waves, and its static response by polynomials.

Cosines and sines of many phases at once are nine times as fast here as those of the compiler. In
double precision it has no vectors for these and calls a function for each number. Polynomials
become vectors, but take longer to compile, which is worth it in maps of information alone.
"""

import abc
import math
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.special import zeta

from ..._shared.dimensions import Parameter
from ..._shared.ranges import POSITIVE
from ..._shared.sites import is_unknown, unit
from ..modes import Coordinates, Flexibility, Modes, Orders
from . import _beam_statics

Position = Float[Array, ""] | float | int


class Waveguide(Modes):
    """A uniform bar or beam, for which every static shape is a polynomial.

    Inertia relief of rigid-body modes: static shapes are orthogonal to them in mass, and a force
    is balanced by the rigid-body acceleration that it causes.
    """

    length: Parameter = eqx.field(metadata=unit("m", within=POSITIVE))
    area: Parameter = eqx.field(metadata=unit("m2", within=POSITIVE))
    youngs_modulus: Parameter = eqx.field(metadata=unit("Pa", within=POSITIVE))
    density: Parameter = eqx.field(metadata=unit("kg/m3", within=POSITIVE))
    wave_numbers: tuple[float, ...] = eqx.field(static=True)
    ends: tuple[str, str] = eqx.field(static=True)
    rigid_body_modes: int = eqx.field(static=True, repr=False)
    axes: tuple[int, ...] = eqx.field(static=True, repr=False)
    static_correction: bool = eqx.field(static=True, default=True, kw_only=True)
    half_order: eqx.AbstractClassVar[int]

    @property
    @abc.abstractmethod
    def stiffness(self) -> Parameter:
        """Axial stiffness E A [N] of a bar, bending stiffness E I [N m2] of a beam."""

    def bounds(self) -> tuple[float, Parameter]:
        """Return the two ends [m]; a position within the least length is on every length."""
        if is_unknown(self.length):
            return 0.0, float(self.length.support.lower_bound)  # type: ignore[union-attr]
        return 0.0, self.length  # which may be an input of a compiled function

    def static_flexibility(
        self, position: Coordinates, other: Coordinates, orders: Orders = (0, 0)
    ) -> Flexibility:
        """Static flexibility [m/N] of all elastic modes; None if not asked for."""
        if not self.static_correction:
            return None
        return (self.green(position, other, orders) / self.stiffness)[None, None]

    def second_flexibility_left_out(
        self, position: Coordinates, other: Coordinates, orders: Orders
    ) -> Flexibility:
        """Sum over the modes left out of phi phi / omega_n^4 [m s2/N], of internal forces alone."""
        if not self.static_correction or min(orders) < self.half_order:
            # Of displacements rounding would be greater than what is left out.
            return jnp.zeros((1, 1))
        elastic = slice(self.rigid_body_modes, None)
        scaled = (
            self.shapes(position, orders[0])[:, elastic] / self.angular_frequency()[elastic] ** 4
        )
        kept = scaled @ self.shapes(other, orders[1])[:, elastic].T
        mass_per_length = self.density * self.area
        return mass_per_length * self.green(position, other, orders, 2) / self.stiffness**2 - kept

    def green(
        self, position: Position, other: Position, orders: Orders = (0, 0), power: int = 1
    ) -> Float[Array, ""]:
        """Green's function for unit stiffness and mass a length, and its derivatives.

        Where a derivative is discontinuous, at equal positions [m], it is the mean of both sides;
        delta functions are left out. Of power 2 it is the Green's function applied twice.
        """
        x, y = jnp.asarray(position / self.length), jnp.asarray(other / self.length)
        distance = jnp.asarray((position - other) / self.length)
        unit = _beam_statics.green(self.half_order, self.ends, x, y, distance, orders, power)
        return unit * self.length ** (2 * self.half_order * power - 1 - sum(orders))

    def mean_flexibility_beyond(self, order: int) -> Float[Array, ""]:
        """Mean of 1 / omega_n^2 [s2] over the modes left out, weighted by a constraint mode.

        The constraint mode is that of a cut with an internal force of this order (`_cuts`). The
        weight of a mode falls as n^-decay and omega_n^2 grows as n^growth, so the mean is a
        ratio of two sums over n > N, Hurwitz's zeta functions.
        """
        growth = 2 * self.half_order
        decay = 2 * (growth - order)
        last = self.wave_numbers[-1] / np.pi
        share = last**growth * zeta(decay + growth, last + 1) / zeta(decay, last + 1)
        return float(share) / self.angular_frequency()[-1] ** 2


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
