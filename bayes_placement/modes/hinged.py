"""hinged: in, modes and places where the structure is more flexible; out, the modes with hinges.

Not known here: what made them flexible, attachments, damping, data.
"""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .._types import Parameter
from . import _jumps
from ._jumps import Jumps
from .beams.uniform_line import UniformLine
from .changed import line_of
from .modes import Modes
from .opened import Lacking, OpenedModes, Opening, opened
from .yielding import Yielding, yielded

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


class _OfCuts(Lacking):
    """What the modes of a uniform line lack of the shapes of its cuts."""

    line: UniformLine
    cuts: Jumps
    participation: Float[Array, "mode hinge"]
    changed: bool = eqx.field(static=True)

    def shapes(
        self,
        position: Float[Array, "*coordinate"],
        derivative: int,
        kept: Float[Array, "axis mode"],
    ) -> Float[Array, "axis hinge"]:
        """Shapes of the cuts, without their part in the modes of the line."""
        # Modes that a preload or shear has changed span the same shapes as those of the line.
        spanned = self.line.shapes(position, derivative) if self.changed else kept
        jumps = _jumps.shapes(self.line, self.cuts, position, derivative)
        return jumps - spanned @ self.participation


def hinged(modes: Modes, hinges: Sequence[Hinge | Yielding]) -> Modes:
    """Open hinges in a uniform bar or beam, or let parts of a finite element model give way.

    Raises
    ------
    ValueError
        If the structure is no uniform bar or beam, or its supports cannot give way.
    """
    line_hinges = [one for one in hinges if isinstance(one, Hinge)]
    if not line_hinges:
        return yielded(modes, [one for one in hinges if not isinstance(one, Hinge)])
    return _cut(modes, sorted(line_hinges, key=lambda one: one.order))


def _cut(modes: Modes, hinges: list[Hinge]) -> OpenedModes:
    line, rigid = line_of(modes), modes.rigid_body_modes
    cuts = _jumps.jumps(line, [one.at for one in hinges], [one.order for one in hinges])
    own = _jumps.participation(modes, line, cuts)
    plain = own if line is modes else _jumps.participation(line, line, cuts)
    factor = _factor(line, cuts, plain)
    beyond = jnp.stack([line.mean_flexibility_beyond(order) for order in cuts.orders])
    in_series = _in_series(line, cuts, [one.compliance for one in hinges])
    lacking = _OfCuts(line, cuts, jnp.pad(plain, ((rigid, 0), (0, 0))), line is not modes)
    unit = jax.scipy.linalg.solve_triangular(factor, jnp.eye(len(factor)), trans=1, lower=True)
    return opened(modes, lacking, Opening(own, unit, factor.T, jnp.diag(beyond), in_series))


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
