"""Modes of a structure with hinges, or with compliant parts of a finite element model."""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jax.scipy.linalg import solve_triangular
from jaxtyping import Array, Float

from .._shared.dimensions import Parameter
from . import _cuts
from ._cuts import Cuts
from .beams.waveguide import Waveguide
from .changed import original_waveguide
from .flexible_parts import (
    CompliantModes,
    FlexiblePart,
    Interface,
    ResidualShapes,
    compliant_modes,
    with_flexible_parts,
)
from .modes import AxisShapes, Coordinates, Modes

_ROUNDING = 1e-12  # of the mass of the structure, added where modes span a shape entirely


class Hinge(NamedTuple):
    """A place where an internal force moves the two sides of a cut relative to each other."""

    at: Parameter
    """Where [m]."""
    order: int
    """Order of the derivative of the shape that makes the force: 2 for the bending moment of a
    beam, 3 for its shear force, 1 for the axial force of a bar."""
    compliance: Parameter
    """Relative rotation or displacement per internal force: [rad/(N m)] for a moment, [m/N] for a
    force."""


class _ResidualCuts(ResidualShapes):
    """Constraint modes of cuts of a uniform waveguide, less their part in its modes."""

    waveguide: Waveguide
    cuts: Cuts
    participation: Float[Array, "mode cut"]
    changed: bool = eqx.field(static=True)

    def shapes(
        self, position: Coordinates, derivative: int, mode_shapes: AxisShapes
    ) -> Float[Array, "axis cut"]:
        """Shapes of the cuts, less their part in the modes of the waveguide."""
        # Modes that a preload or shear has changed span the same shapes as those of the waveguide.
        spanned = self.waveguide.shapes(position, derivative) if self.changed else mode_shapes
        shapes = _cuts.shapes(self.waveguide, self.cuts, position, derivative)
        return shapes - spanned @ self.participation


def with_compliance(modes: Modes, compliances: Sequence[Hinge | FlexiblePart]) -> Modes:
    """Put hinges in a uniform bar or beam, or make parts of a finite element model flexible."""
    hinges = [hinge for hinge in compliances if isinstance(hinge, Hinge)]
    if not hinges:
        parts = [part for part in compliances if not isinstance(part, Hinge)]
        return with_flexible_parts(modes, parts)
    return _with_hinges(modes, sorted(hinges, key=lambda hinge: hinge.order))


def _with_hinges(modes: Modes, hinges: list[Hinge]) -> CompliantModes:
    waveguide, rigid = original_waveguide(modes), modes.rigid_body_modes
    cuts = _cuts.cut(waveguide, [hinge.at for hinge in hinges], [hinge.order for hinge in hinges])
    participation = _cuts.participation(modes, waveguide, cuts)
    of_waveguide = (
        participation if waveguide is modes else _cuts.participation(waveguide, waveguide, cuts)
    )
    factor = _mass_factor(waveguide, cuts, of_waveguide)
    flexibility = jnp.stack([waveguide.mean_flexibility_beyond(order) for order in cuts.orders])
    compliance = _in_series(waveguide, cuts, [hinge.compliance for hinge in hinges])
    residual = _ResidualCuts(
        waveguide, cuts, jnp.pad(of_waveguide, ((rigid, 0), (0, 0))), waveguide is not modes
    )
    orthonormal = solve_triangular(factor, jnp.eye(len(factor)), trans=1, lower=True)
    interface = Interface(participation, orthonormal, factor.T, jnp.diag(flexibility), compliance)
    return compliant_modes(modes, residual, interface)


def _mass_factor(
    waveguide: Waveguide, cuts: Cuts, participation: Float[Array, "elastic cut"]
) -> Float[Array, "cut cut"]:
    """Cholesky factor of the mass matrix of the residual shapes."""
    mass = _cuts.mass(waveguide, cuts)
    margin = _ROUNDING * jnp.diag(jnp.diag(mass)) + jnp.finfo(float).tiny * jnp.eye(len(mass))
    return jnp.linalg.cholesky(mass - participation.T @ participation + margin)


def _in_series(
    waveguide: Waveguide, cuts: Cuts, compliances: list[Parameter]
) -> Float[Array, "cut cut"]:
    """Compliances in series with the stiffness of a statically indeterminate structure.

    C (1 + S C)^-1, one hinge after the other.
    """
    stiffness = _cuts.stiffness(waveguide, cuts)
    total = jnp.zeros_like(stiffness)
    for number, compliance in enumerate(compliances):
        # Relative displacements at all cuts for a unit one at this, with the hinges before it.
        displacement = jnp.zeros(len(compliances)).at[number].set(1.0)
        displacement -= total @ stiffness[:, number]
        in_series = compliance / (1 + compliance * (stiffness[number] @ displacement))
        total += in_series * jnp.outer(displacement, displacement)
    return total
