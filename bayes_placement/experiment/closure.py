"""What hangs on ports closes the receptance: the one formula for everything attached or inserted.

H' = H_oi - H_op Z (I + H_pp Z)^-1 H_pi with Z = N / D on the ports, one after the other, the last
one first, which is block elimination (Sherman and Morrison, Ann. Math. Stat. 21 (1950) 124).

What depends on the amplitude a of its port does so by a describing function: a |1 + h Z(a)| = |u|
with the receptance h of the port and its amplitude u without the attachment (Krack and Gross,
Harmonic Balance for Nonlinear Vibration Problems, doi:10.1007/978-3-030-14023-6). Of several roots
it is the least.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Complex, Float, Inexact

from ..effects.amplitude_attachment import AmplitudeAttachment
from ..effects.effect import Omega
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
        resisting = denominator + numerator * matrix[-1, -1]
        if isinstance(denominator, float):
            share = numerator * reciprocal(resisting)
        else:  # what is cheap XLA computes again for each element of the matrix; a division is not
            share = numerator / resisting
        matrix = matrix[:-1, :-1] - matrix[:-1, -1, None] * share * matrix[-1, None, :-1]
    return matrix


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


NODES = 32
"""Steps of the scan: the force at which an amplitude jumps is exact to 1e-4 of it."""

CLOSE = 1e-14
"""Relative change of an amplitude below which it is known."""

STEPS = 30
"""Most steps or halvings between two nodes: enough where two roots are about to meet."""

NEAREST = 1e-6
"""Least distance of a node from the threshold of a law, over the threshold [1]."""

LEAST_LOSS = 1e-6
"""Least loss angle of a receptance that is told from none [rad]."""

Amplitude: TypeAlias = Float[Array, "actuator frequency"]
"""One number for each actuator, which drives alone, and each line."""

Excess: TypeAlias = Callable[[Array], Array]
"""Logarithm of the square of a |1 + h Z(a)| / |u|, by that of a / |u|."""

Steps: TypeAlias = tuple[Array, Array, Array, Array, Array]
"""Steps taken, the ends of a bracket, the point and the one before."""

Ends: TypeAlias = tuple[Array, Array]
"""Value and slope at one end of a step."""


def attached(
    matrix: Complex[Array, "response reference frequency"],
    law: AmplitudeAttachment,
    omega: Omega,
    force: Float[Array, "frequency"],
) -> Complex[Array, "response-1 reference-1 frequency"]:
    """Receptance between all points but the last, the port that feels the law.

    The matrix is between sensors, actuators and the port. Each actuator drives alone, by a force of
    this amplitude [N].
    """
    driving_point, driven = matrix[-1, -1], matrix[-1, :-1]
    moved = amplitude(law, omega, driving_point, driven * force)
    stiffness = law.equivalent_stiffness(moved, omega)
    share = stiffness * reciprocal(1 + stiffness * driving_point)
    return matrix[:-1, :-1] - matrix[:-1, -1, None] * share * driven


def amplitude(
    law: AmplitudeAttachment,
    omega: Omega,
    driving_point: Complex[Array, "frequency"],
    free: Complex[Array, "actuator frequency"],
) -> Amplitude:
    """Least amplitude of the port at which forces balance [m].

    Without the law the port has the driving-point receptance [m/N], and the free displacement [m].
    """
    square = _squared(free)
    moves = square > 0
    size = jnp.sqrt(jnp.where(moves, square, 1.0))

    def excess(logarithm: Array) -> Array:
        stiffness = law.equivalent_stiffness(size * jnp.exp(logarithm), omega)
        return 2 * logarithm + jnp.log(_squared(1 + driving_point * stiffness))

    def root(excess: Excess, _: Amplitude) -> Amplitude:
        threshold = law.threshold() / size
        low, high = _limits(law, omega, driving_point, size)
        return _refined(excess, _least_bracket(excess, threshold, low, high))

    # The implicit function theorem gives the derivatives, whatever the steps to the root were.
    logarithm = jax.lax.custom_root(excess, jnp.zeros_like(size), root, _divided)
    return jnp.where(moves, size * jnp.exp(logarithm), 0.0)


def _divided(slope: Callable[[Array], Array], change: Array) -> Array:
    """Solve a linear equation for each number by itself."""
    return change / slope(jnp.ones_like(change))


def _squared(value: Inexact[Array, "*shape"]) -> Float[Array, "*shape"]:
    """Square of the magnitude."""
    return jnp.real(value) ** 2 + jnp.imag(value) ** 2


def _limits(
    law: AmplitudeAttachment, omega: Omega, driving_point: Array, size: Amplitude
) -> tuple[Amplitude, Amplitude]:
    """Least and greatest amplitude, over that without the attachment.

    Below, forces of the stiffest kind are too small. Above, |1 + h Z| is never less than the loss
    angle of h, since neither the structure nor a passive attachment gives energy.
    """
    at_threshold = law.equivalent_stiffness(jnp.full_like(size, law.threshold()), omega)
    stiffness = jnp.maximum(jnp.abs(at_threshold), jnp.abs(law.equivalent_stiffness(size, omega)))
    receptance = jnp.abs(driving_point)
    loss = jnp.abs(jnp.imag(driving_point)) / jnp.maximum(receptance, jnp.finfo(float).tiny)
    low = 1 / (1 + receptance * stiffness)
    return low, jnp.broadcast_to(1.1 / jnp.maximum(loss, LEAST_LOSS), low.shape)


class _Bracket(NamedTuple):
    """Neighbouring nodes, at the first of which the excess is negative and then no more."""

    low: Array
    high: Array
    found: Bool[Array, "actuator frequency"]

    def up_to(self, node: Array, value: Array) -> "_Bracket":
        """Go on to the next node, where the end is not found yet."""
        low = jnp.where(self.found | (value >= 0), self.low, node)
        return _Bracket(low, jnp.where(self.found, self.high, node), self.found | (value >= 0))


def _least_bracket(excess: Excess, threshold: Array, low: Array, high: Array) -> _Bracket:
    """Nodes about the least root: the threshold, then at equal ratios of distances from it.

    The stiffness is constant up to the threshold, and may grow steeply from there. A crest between
    two nodes, where the excess is positive for a short while, is a node as well.
    """
    first = jnp.log(jnp.maximum(threshold, low))
    nearest = jnp.maximum(low - threshold, NEAREST * threshold)
    start = jnp.log(nearest)
    step = jnp.log(jnp.maximum(high - threshold, 2 * nearest) / nearest) / NODES

    def at(distance: Array) -> Array:
        return jnp.log(threshold + jnp.exp(distance))

    def goes_on(state: tuple[Array, _Bracket, Ends]) -> Array:
        return (state[0] <= NODES) & ~jnp.all(state[1].found)

    def advanced(state: tuple[Array, _Bracket, Ends]) -> tuple[Array, _Bracket, Ends]:
        number, bracket, before = state
        node = start + number * step
        ends = _with_slope(lambda distance: excess(at(distance)), node)
        crest = at(node - step * _back_to_crest(before, ends, step))
        return number + 1, bracket.up_to(crest, excess(crest)).up_to(at(node), ends[0]), ends

    begun = _Bracket(jnp.log(low), first, excess(first) >= 0)
    nothing = jnp.zeros_like(low), jnp.zeros_like(low)
    return jax.lax.while_loop(goes_on, advanced, (jnp.zeros((), int), begun, nothing))[1]


def _back_to_crest(before: Ends, after: Ends, step: Array) -> Array:
    """Share of a step from its end back to a crest of the cubic with these values and slopes.

    Zero where there is none (Nocedal and Wright, Numerical Optimization, Eq. 3.59).
    """
    (value, rising), (end, falling) = before, after
    is_crest = (rising > 0) & (falling < 0)
    middle = (rising + falling) - 3 * (end - value) / step
    root = jnp.sqrt(jnp.where(is_crest, middle**2 - rising * falling, 1.0))
    share = (middle + root - falling) / (rising - falling + 2 * root)
    return jnp.where(is_crest, share, 0.0)


def _refined(excess: Excess, bracket: _Bracket) -> Array:
    """Root between two nodes, by Newton's steps and by halving where these leave the bracket."""

    def goes_on(state: Steps) -> Array:
        return (state[0] < STEPS) & jnp.any(jnp.abs(state[3] - state[4]) > CLOSE)

    def closer(state: Steps) -> Steps:
        number, low, high, point, _ = state
        value, slope = _with_slope(excess, point)
        low, high = jnp.where(value < 0, point, low), jnp.where(value < 0, high, point)
        newton = point - value / slope
        is_inside = (newton >= low) & (newton <= high)
        return number + 1, low, high, jnp.where(is_inside, newton, (low + high) / 2), point

    middle = (bracket.low + bracket.high) / 2
    begun = jnp.zeros((), int), bracket.low, bracket.high, middle, jnp.full_like(middle, jnp.inf)
    return jax.lax.while_loop(goes_on, closer, begun)[3]


def _with_slope(function: Excess, point: Array) -> Ends:
    """Value and slope of a function of each number by itself."""
    return jax.jvp(function, (point,), (jnp.ones_like(point),))
