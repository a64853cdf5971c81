"""frf: in, a structure without distributions and an angular frequency; out, receptance [m/N].

Not known here: probability, decibels, where the sensors were recorded.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float, Inexact

from .._types import InputError, Receptance
from ..effects._effect import CubicAttachment
from ..modes._repeated import carried
from ..modes.modes import Modes
from ..modes.points import Points, joined
from .structure import Structure

Omega = Inexact[Array, "frequency"]
NEWTON_STEPS = 60

Matrix = Complex[Array, "to from frequency"]


class Held(NamedTuple):
    """Points at which the structure is held, and the dynamic stiffness [N/m] of what holds it."""

    points: Points
    stiffness: Inexact[Array, "frequency"]


def receptance(
    structure: Structure,
    sensors: Points,
    actuators: Points,
    omega: Omega,
    *,
    held: Sequence[Held] = (),
    force: Float[Array, "frequency"] | None = None,
) -> Receptance:
    r"""Receptance between points of a structure with all its effects, Eqs. (6), (7) and (18).

    The modal sum with the static flexibility of the modes left out, then each attachment by the
    formula of Sherman and Morrison: one port after the other, which is block elimination.

    Parameters
    ----------
    structure
        Structure whose parameters are numbers.
    sensors, actuators
        Where it is read and driven.
    omega
        Angular frequency [rad/s], time convention exp(+i omega t).
    held
        Further linear attachments, those of the instruments.
    force
        Amplitude [N] of the force at each frequency; only cubic attachments need it.

    Returns
    -------
    Complex[Array, "sensor actuator frequency"]
        Receptance [m/N].

    Raises
    ------
    ValueError
        If an attachment depends on the amplitude and no force is known.
    """
    modes = structure.proper_modes()
    linear = [
        Held(one.points(modes), one.dynamic_stiffness(omega)) for one in structure.attachments
    ]
    attached = [*linear, *held]
    cubic = structure.cubic_attachments
    ports = [one.points for one in attached] + [one.points(modes) for one in cubic]
    read, driven = Seen.of(sensors, modes), Seen.of(actuators, modes)
    matrix = elastic(structure, modes, read, driven, omega)
    if not ports:
        return matrix
    seen = Seen.of(joined(ports), modes)
    # Apart, since sums of other sizes may round otherwise: what is between sensors and actuators
    # must not change by a single bit where a port is that holds nothing.
    whole = elastic(structure, modes, read.and_also(seen), driven.and_also(seen), omega)
    matrix = whole.at[: matrix.shape[0], : matrix.shape[1]].set(matrix)
    here = (sensors.position.shape[0], actuators.position.shape[0])
    place = 0
    for one in attached:
        for _ in range(one.points.position.shape[0]):
            matrix = attach(matrix, (here[0] + place, here[1] + place), one.stiffness)
            place += 1
    if not cubic:
        return matrix[: here[0], : here[1]]
    return attach_cubic(matrix, here, place, _only(cubic).hardening(), _known(force))


class Seen(NamedTuple):
    """Points, and the mode shapes along them, which are computed once."""

    points: Points
    shapes: Float[Array, "point mode"]

    @classmethod
    def of(cls, points: Points, modes: Modes) -> "Seen":
        """Read the shapes."""
        return cls(points, points.shapes(modes))

    def and_also(self, other: "Seen") -> "Seen":
        """Return these points and others."""
        shapes = jnp.concatenate([self.shapes, other.shapes])
        return Seen(joined([self.points, other.points]), shapes)


class Dynamic(NamedTuple):
    """What each mode adds to a receptance, as a factor of its shapes."""

    modal: Inexact[Array, "mode frequency"]
    beyond_static: Inexact[Array, "mode frequency"]
    relative_modulus: Inexact[Array, "frequency"]


def dynamic(structure: Structure, modes: Modes, omega: Omega) -> Dynamic:
    """Receptance of each mode of unit shape, that beyond its static part, and what divides this.

    The static flexibility is that of the modulus as drawn; damped, it is divided by the modulus
    that modes far above the lines have.
    """
    modulus = structure.relative_modulus(omega)
    natural, rigid = modes.angular_frequency(), modes.rigid_body_modes
    loss = structure.damping.loss(natural, omega, rigid)
    elastic_part = (natural**2)[:, None] * modulus - omega**2
    modal = 1 / (elastic_part + loss * structure.kept_damping())
    squares = jnp.concatenate([jnp.full(rigid, jnp.inf), natural[rigid:] ** 2])
    lossy = modulus + structure.damping.static_loss(omega) * structure.kept_damping()
    return Dynamic(modal, modal - 1 / (squares[:, None] * lossy), lossy)


def elastic(structure: Structure, modes: Modes, to: Seen, come_from: Seen, omega: Omega) -> Matrix:
    """Receptance [m/N] of the structure proper, static where modes are left out."""
    factors = dynamic(structure, modes, omega)
    coupled = _coupled(structure, modes, (to, come_from), factors.modal, omega)
    static = to.points.static_flexibility(modes, come_from.points)
    if static is None:
        return _modal_sum(to, come_from, factors.modal) + coupled
    beyond = _modal_sum(to, come_from, factors.beyond_static)
    return beyond + static[..., None] / factors.relative_modulus + coupled


def _modal_sum(to: Seen, come_from: Seen, modal: Inexact[Array, "mode frequency"]) -> Matrix:
    residues = to.shapes[:, None, :] * come_from.shapes[None, :, :]
    # Two real products cost half of one complex product with a real factor.
    return residues @ jnp.real(modal) + 1j * (residues @ jnp.imag(modal))


def _coupled(
    structure: Structure,
    modes: Modes,
    seen: tuple[Seen, Seen],
    modal: Inexact[Array, "mode frequency"],
    omega: Omega,
) -> Matrix | float:
    """What couples modes of one frequency: zero, with the derivative that their shapes lack."""
    coupling = modes.coupling()
    if coupling is None:
        return 0.0
    natural = modes.angular_frequency()

    def law(natural: Float[Array, "mode"]) -> Inexact[Array, "mode frequency"]:
        return structure.damping.loss(natural, omega, modes.rigid_body_modes)

    # The loss turns with the modes: l(K) changes by dl / d(omega_n^2) between equal frequencies.
    slope = jax.jvp(law, (natural,), (jnp.ones_like(natural),))[1]
    over = 0.5 / jnp.where(natural > 0, natural, jnp.inf)[:, None]
    growth = structure.relative_modulus(omega) + slope * over * structure.kept_damping()
    to, come_from = (one.shapes[:, :, None] * modal for one in seen)
    return carried(coupling, to * growth, come_from)


def attach(
    matrix: Matrix, port: tuple[int, int], stiffness: Inexact[Array, "*frequency"]
) -> Matrix:
    """Receptance once its port, a row and a column, is held by a dynamic stiffness [N/m]."""
    row, column = port
    share = stiffness / (1 + stiffness * matrix[row, column])
    return matrix - matrix[:, column, None] * share * matrix[row, None]


def attach_cubic(
    matrix: Matrix,
    here: tuple[int, int],
    place: int,
    hardening: Float[Array, ""],
    force: Float[Array, "frequency"],
) -> Receptance:
    """Receptance once a cubic spring holds the last port, each actuator driving alone.

    The equivalent stiffness k follows from the amplitude |u| and this from k: a fixed point.
    """
    rows, columns = here
    own = matrix[rows + place, columns + place]
    driven = matrix[rows + place, :columns]
    square = amplitude_squared(hardening * own, jnp.abs(driven * force) ** 2)
    stiffness = hardening * square
    share = stiffness / (1 + stiffness * own)
    return matrix[:rows, :columns] - matrix[:rows, columns + place, None] * share * driven


def amplitude_squared(
    product: Complex[Array, "frequency"], free: Float[Array, "actuator frequency"]
) -> Float[Array, "actuator frequency"]:
    r"""Least root x of x |1 + r x|^2 = b, the square of the amplitude on a cubic spring [m^2].

    Parameters
    ----------
    product
        r, hardening times receptance at the spring [1/m^2].
    free
        b, square of the amplitude without the spring [m^2].
    """
    slope, curve = 2 * jnp.real(product), jnp.abs(product) ** 2

    def newton(x: Array, b: Array) -> Array:
        value = ((curve * x + slope) * x + 1) * x - b
        return x - value / ((3 * curve * x + 2 * slope) * x + 1)

    start = jax.lax.stop_gradient(_start(slope, curve, free))
    fixed = jax.lax.fori_loop(0, NEWTON_STEPS, lambda _, x: newton(x, free), start)
    # One more step from a constant carries the derivative of the fixed point, exactly.
    return newton(jax.lax.stop_gradient(fixed), free)


def _start(slope: Array, curve: Array, b: Array) -> Array:
    """A start from which Newton's steps stay on one side of the least root.

    The curve rises from -b at 0. Where it bends down first, up to a summit, the root is before the
    summit if that is positive: begin at 0. In all other cases the root lies where the curve bends
    up: begin beyond it.
    """
    tiny = jnp.finfo(float).tiny
    root = jnp.sqrt(jnp.maximum(slope**2 - 3 * curve, 0.0))
    summit = jnp.where(slope < 0, -1 / jnp.minimum(slope - root, -tiny), 0.0)
    height = ((curve * summit + slope) * summit + 1) * summit - b
    before = (slope < 0) & (slope**2 > 3 * curve) & (height >= 0)
    bending = jnp.maximum(-slope, 0.0) / jnp.maximum(curve, tiny)
    beyond = jnp.where(slope < 0, 2 * bending + jnp.cbrt(b / jnp.maximum(curve, tiny)), b)
    return jnp.where(before, 0.0, beyond)


def _only(cubic: Sequence[CubicAttachment]) -> CubicAttachment:
    if len(cubic) > 1:
        names = " and ".join(one.name for one in cubic)
        raise InputError(
            f"The structure has several cubic attachments, {names}. One is possible, since the "
            "describing functions of several depend on each other. Keep one of them."
        )
    return cubic[0]


def _known(force: Float[Array, "frequency"] | None) -> Float[Array, "frequency"]:
    if force is None:
        raise InputError(
            "The structure has a cubic stiffness, whose response depends on how hard it is driven, "
            "but no force is known. Say it: Experiment(..., force_levels=[0.1, 1.0])."
        )
    return force
