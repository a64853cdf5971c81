"""_hinges: in, modes and places where the structure is more flexible; out, the modes with hinges.

Not known here: what made them flexible, attachments, damping, data.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._bounds import Bounds
from .._changed_modes import line_of, safe_root
from .._types import Parameter
from .._uniform_line import UniformLine
from ..modes import Modes
from . import _jumps
from ._jumps import Jumps

_HAIR = 1e-12  # of the mass of the structure, below which a remainder counts as nothing


class Hinge(NamedTuple):
    """A place where an internal force opens the structure.

    Parameters
    ----------
    at
        Where [m].
    order
        Order of the derivative of the shape that makes the force: 2 for the bending moment of a
        beam, 3 for its shear force, 1 for the axial force of a bar.
    compliance
        Jump per internal force: [rad/(N m)] for a moment, [m/N] for a force.
    """

    at: Parameter
    order: int
    compliance: Parameter


class HingedModes(Modes):
    """Modes of a structure with hinges; made by `hinged`.

    The flexibility of the structure grows by psi C' psi^T, where psi are the static shapes of unit
    jumps and C' the compliances in series with what holds the jumps. Its eigenvalues in the span
    of the kept modes and psi are 1 / omega_n^2: a Ritz procedure in flexibility, in which a
    compliance of zero changes nothing, bit for bit. As many modes are kept as before; what they
    lack is in the static flexibility, which is exact.
    """

    modes: Modes
    cuts: Jumps
    squares: Float[Array, "mode"]
    of_modes: Float[Array, "mode mode"]
    of_lacking: Float[Array, "hinge mode"]
    participation: tuple[Float[Array, "mode hinge"], Float[Array, "mode hinge"]]
    in_series: Float[Array, "hinge hinge"]
    axes: tuple[int, ...] = eqx.field(static=True)
    rigid_body_modes: int = eqx.field(static=True)

    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies [rad/s]."""
        return safe_root(self.squares)

    def shapes(
        self, position: Float[Array, "*coordinate"], derivative: int = 0
    ) -> Float[Array, "axis mode"]:
        """Mass-normalised mode shapes [kg^-1/2] and their derivatives."""
        kept, lacking = self._parts(position, derivative)
        return (kept @ self.of_modes + lacking @ self.of_lacking)[None]

    def static_flexibility(
        self, position: Float[Array, "*coordinate"], other: Float[Array, "*coordinate"]
    ) -> Float[Array, "axis axis"] | None:
        """Static flexibility [m/N] of all elastic modes, hinges included."""
        before = self.modes.static_flexibility(position, other)
        if before is None:
            return None
        here, there = self._jumps(position), self._jumps(other)
        return before + here @ self.in_series @ there

    def _parts(self, position: Float[Array, "*coordinate"], derivative: int) -> tuple[Array, Array]:
        """Kept modes, and what these lack of the shapes of the jumps."""
        line, kept = line_of(self.modes), self.modes.shapes(position, derivative)[0]
        jumps = _jumps.shapes(line, self.cuts, position, derivative)
        # Modes that a preload or shear has changed span the same shapes as those of the line.
        spanned = kept if line is self.modes else line.shapes(position, derivative)[0]
        return kept, jumps - spanned @ self.participation[0]

    def _jumps(self, position: Float[Array, "*coordinate"]) -> Float[Array, "hinge"]:
        kept, lacking = self._parts(position, 0)
        return lacking + kept @ self.participation[1]

    def bounds(self) -> Bounds:
        """Return the two ends of the structure [m]."""
        return self.modes.bounds()


def hinged(modes: Modes, hinges: list[Hinge]) -> HingedModes:
    """Open hinges in a uniform bar or beam.

    Raises
    ------
    ValueError
        If the structure is no uniform bar or beam.
    """
    line, rigid = line_of(modes), modes.rigid_body_modes
    hinges = sorted(hinges, key=lambda one: one.order)
    cuts = _jumps.jumps(line, [one.at for one in hinges], [one.order for one in hinges])
    squares = modes.angular_frequency() ** 2
    over_squares = 1 / squares[rigid:]
    own = _jumps.participation(modes, line, cuts)
    plain = own if line is modes else _jumps.participation(line, line, cuts)
    factor = _factor(line, cuts, plain)
    jumps = jnp.concatenate([own, factor.T])
    beyond = jnp.stack([line.mean_flexibility_beyond(order) for order in cuts.orders])
    in_series = _in_series(line, cuts, [one.compliance for one in hinges])
    flexibility = jnp.diag(jnp.concatenate([over_squares, beyond])) + jumps @ in_series @ jumps.T
    values, vectors = jnp.linalg.eigh(-flexibility)  # ascending: the lowest mode comes first
    kept = over_squares.size
    # At zero compliance the eigenvalues are those put in, so the difference is zero, exactly.
    growth = (over_squares + values[:kept]) / over_squares
    lacking = jax.scipy.linalg.solve_triangular(factor, vectors[kept:, :kept], trans=1, lower=True)
    return HingedModes(
        modes=modes,
        cuts=cuts,
        squares=jnp.concatenate([squares[:rigid], squares[rigid:] * (1 + growth / (1 - growth))]),
        of_modes=jax.scipy.linalg.block_diag(jnp.eye(rigid), vectors[:kept, :kept]),
        of_lacking=jnp.pad(lacking, ((0, 0), (rigid, 0))),
        participation=(_padded(plain, rigid), _padded(own, rigid)),
        in_series=in_series,
        axes=modes.axes,
        rigid_body_modes=rigid,
    )


def _padded(elastic: Float[Array, "elastic hinge"], rigid: int) -> Float[Array, "mode hinge"]:
    return jnp.pad(elastic, ((rigid, 0), (0, 0)))


def _factor(
    line: UniformLine, cuts: Jumps, kept: Float[Array, "elastic hinge"]
) -> Float[Array, "hinge hinge"]:
    """Cholesky factor of the mass of what the kept modes lack of the jumps."""
    mass = _jumps.mass(line, cuts)
    hair = _HAIR * jnp.diag(jnp.diag(mass)) + jnp.finfo(float).tiny * jnp.eye(len(cuts.orders))
    return jnp.linalg.cholesky(mass - kept.T @ kept + hair)


def _in_series(
    line: UniformLine, cuts: Jumps, compliances: list[Parameter]
) -> Float[Array, "hinge hinge"]:
    """Compliances in series with what holds the jumps in a statically indeterminate structure.

    C (1 + S C)^-1, one hinge after the other.
    """
    held = _jumps.stress(line, cuts)
    total = jnp.zeros_like(held)
    for one, compliance in enumerate(compliances):
        opened = jnp.zeros(len(compliances)).at[one].set(1.0) - total @ held[:, one]
        total += compliance / (1 + compliance * (held[one] @ opened)) * jnp.outer(opened, opened)
    return total
